// Input by pointer, wheel and keys: the target of each palm, and whether its fingers close.

import { about, add, clamp, cross, length, scale, sub, times, turn } from "./space.js";
import { on, send } from "./socket.js";

/** How far the fingertips are below the palm, m. */
const BELOW = 0.1;
/** Speeds of keys: over the table, up and down, m/s, and turning, rad/s. */
const SPEED = { over: 0.16, up: 0.1, turn: 0.9 };
/** How much a notch of the wheel lifts, m. */
const NOTCH = 0.008;
/** A palm that is blocked is not led farther than this past where it is, m. */
const PAST = 0.02;

export class Hands {
  constructor(stage) {
    this.stage = stage;
    this.active = 0;
    this.squeeze = 1.5;
    this.held = new Set();
    this.epoch = undefined;
    this.hands = stage.scene.hands.map(({ side }) => ({ side, at: undefined, q: [1, 0, 0, 0], closes: false, presses: false, changed: 0 }));
    this.isTracked = false;
    on("state", (state) => this.see(state));
  }

  get hand() {
    return this.hands[this.active];
  }

  see(state) {
    this.state = state;
    // The simulation has jumped, or this page is new: targets are the current poses.
    if (state.epoch !== this.epoch) {
      this.epoch = state.epoch;
      this.hands.forEach((hand, index) => {
        const { palm, tips, forces } = state.hands[index];
        const spread = Math.max(...tips.map((tip) => length(sub(tip, scale(tips.reduce(add, [0, 0, 0]), 1 / tips.length)))));
        Object.assign(hand, { at: palm.slice(0, 3), q: palm.slice(3), closes: spread < 0.035 && forces.some((force) => length(force) > 0.1), changed: 0 });
      });
    }
    this.hands.forEach((hand, index) => {
      const { palm, forces } = state.hands[index];
      const up = forces.reduce((sum, force) => sum + force[2], 0);
      if (up > 0.12 && hand.at[2] < palm[2] - PAST) hand.at[2] = palm[2] - PAST;
    });
  }

  /** Moves the palm of the active hand by a way, within reach of the scene. */
  move(way) {
    const { low, high, ground } = this.stage, { hand } = this;
    if (!hand.at) return;
    const at = add(hand.at, way);
    for (const axis of [0, 1]) at[axis] = clamp(at[axis], low[axis] - 0.3, high[axis] + 0.3);
    at[2] = clamp(at[2], ground.z + BELOW - 0.03, Math.max(high[2], ground.z) + 0.45);
    hand.at = at;
    hand.changed = performance.now();
  }

  turn(axis, angle) {
    if (!this.hand.at) return;
    this.hand.q = times(about(axis, angle), this.hand.q);
    const size = Math.hypot(...this.hand.q);
    this.hand.q = this.hand.q.map((part) => part / size);
    this.hand.changed = performance.now();
  }

  toggle() {
    this.hand.closes = !this.hand.closes;
    this.hand.changed = performance.now();
  }

  next() {
    this.active = (this.active + 1) % this.hands.length;
  }

  /** Where a point of the canvas is at the height of the palm. */
  over(x, y) {
    const { eye, way } = this.stage.ray(x, y), up = this.hand.at[2];
    const far = (up - eye[2]) / (Math.abs(way[2]) > 0.02 ? way[2] : -0.02);
    // A view along the table would lead to its end with a twitch of the hand.
    return far > 0 && far < 4 ? add(eye, scale(way, far)) : undefined;
  }

  listen() {
    const { canvas } = this.stage, drags = new Map();
    const spot = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
      drags.set(event.pointerId, { last: spot(event), looks: event.button !== 0 || event.altKey });
    });
    canvas.addEventListener("pointermove", (event) => {
      const drag = drags.get(event.pointerId);
      if (!drag) return;
      const [x, y] = spot(event), [wasX, wasY] = drag.last;
      drag.last = [x, y];
      if (drag.looks || drags.size > 1) {
        const { camera } = this.stage;
        camera.yaw -= (x - wasX) * 0.006;
        camera.pitch = clamp(camera.pitch + (y - wasY) * 0.006, 0.08, 1.5);
      } else if (event.shiftKey) {
        this.move([0, 0, (wasY - y) * this.stage.camera.away * 0.72 / Math.max(1, canvas.clientHeight)]);
      } else if (this.hand.at) {
        const [from, to] = [this.over(wasX, wasY), this.over(x, y)];
        if (from && to) this.move(sub(to, from));
      }
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, (event) => drags.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const notches = clamp(event.deltaY / (event.deltaMode ? 3 : 100), -3, 3), { camera } = this.stage;
      if (event.ctrlKey || event.altKey) camera.away = clamp(camera.away * Math.exp(notches * 0.15), 0.2, 4);
      else this.move([0, 0, -notches * NOTCH]);
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.stage.begin());
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select, textarea, summary")) return;
      if (["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "PageUp", "PageDown"].includes(event.key)) event.preventDefault();
      this.held.add(event.key.length === 1 ? event.key.toLowerCase() : event.key);
    });
    addEventListener("keyup", (event) => {
      this.held.delete(event.key.length === 1 ? event.key.toLowerCase() : event.key);
      if (event.key === "Shift") this.held.clear();
    });
    addEventListener("blur", () => this.held.clear());
  }

  /** Applies the held keys for a time in seconds; `pad` adds the input of a gamepad. */
  advance(seconds, pad) {
    if (!this.hand.at) return;
    const held = (...keys) => keys.some((key) => this.held.has(key)) ? 1 : 0;
    const slow = held("Shift") ? 0.3 : 1, { right } = this.stage.axes(), away = cross([0, 0, 1], right);
    const over = [held("ArrowRight", "d") - held("ArrowLeft", "a") + pad.right, held("ArrowUp", "w") - held("ArrowDown", "s") + pad.away];
    const up = held("PageUp", "r") - held("PageDown", "f") + pad.up;
    const way = add(add(scale(right, over[0] * SPEED.over), scale(away, over[1] * SPEED.over)), [0, 0, up * SPEED.up]);
    if (length(way) > 0) this.move(scale(way, seconds * slow));
    const about = (positive, negative, axis, more = 0) => {
      const by = held(positive) - held(negative) + more;
      if (by) this.turn(axis, by * SPEED.turn * seconds * slow);
    };
    about("q", "e", [0, 0, 1], -pad.turn);
    about("t", "g", turn(this.hand.q, [1, 0, 0]));
    about("y", "h", turn(this.hand.q, [0, 1, 0]));
    this.hand.presses = held("p") > 0 || pad.presses;
  }

  /** Sends the target of every hand. A hand of a headset sends its fingertips itself. */
  send() {
    if (this.isTracked) return;
    for (const { side, at, q, closes, presses } of this.hands) {
      if (at) send({ type: "palm", hand: side, epoch: this.epoch, palm: [...at, ...q], closes, squeeze: this.squeeze, presses });
    }
  }
}
