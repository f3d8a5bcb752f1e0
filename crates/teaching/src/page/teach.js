// Teaching by hand: draws the newest state and sends the targets of the hands, about 60 times a second.

import { offerCamera } from "./camera.js";
import { Stage } from "./draw.js";
import { Hands } from "./hands.js";
import { offerHeadset } from "./headset.js";
import { readPad, rumble } from "./pad.js";
import { Show, Tone } from "./show.js";
import { connect, on, send } from "./socket.js";
import { add, length, mix, scale } from "./space.js";

const find = (id) => document.getElementById(id);
/** How long an arrow is for a newton, m. */
const PER_NEWTON = 0.022;

/** What there is on the page, for tests and the console. */
export const page = {};

async function begin() {
  const scene = await (await fetch("api/scene")).json();
  const stage = new Stage(find("view"), scene), hands = new Hands(stage), show = new Show(stage, hands), tone = new Tone();
  stage.begin();
  hands.listen();
  let state, replay, read = 0;
  const colors = {};
  Object.assign(page, { stage, hands });
  on("state", (message) => { state = page.state = message; });
  on("labels", (message) => {
    for (const track of message.tracks) colors[track.who] = track.label ? [1, 3, 5].map((at) => parseInt(track.label[2].slice(at, at + 2), 16) / 255) : undefined;
    show.labels(message);
  });
  on("takes", (message) => show.recorded(message, watch));
  on("error", ({ message }) => show.trouble(message));
  on("gone", () => show.trouble("The program does not answer. Is `teachtree teach --live` still running?"));
  on("here", () => show.trouble());

  /** Shows the robot's execution. */
  async function watch() {
    const moves = await (await fetch("api/robot")).json();
    replay = { moves, since: performance.now() };
    find("replay").hidden = false;
  }
  const endReplay = () => {
    replay = undefined;
    find("replay").hidden = true;
  };

  const act = {
    record: () => send({ type: state?.recording ? "stop" : "start" }),
    undo: () => send({ type: "undo" }),
    reset: () => send({ type: "reset" }),
    close: () => hands.toggle(),
    next: () => { hands.next(); show.now(); },
  };
  page.act = (name) => act[name]();
  for (const name of Object.keys(act)) {
    find(name).addEventListener("click", () => {
      show.trouble();
      act[name]();
      find("view").focus({ preventScroll: true });
    });
  }
  // Buttons that go on while they are held.
  const held = { up: "r", down: "f", "left-turn": "q", "right-turn": "e" };
  for (const [name, key] of Object.entries(held)) {
    find(name).addEventListener("pointerdown", (event) => { event.target.setPointerCapture(event.pointerId); hands.held.add(key); });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) find(name).addEventListener(end, () => hands.held.delete(key));
  }
  const keys = { " ": "close", Enter: "record", Backspace: "undo", n: "next" };
  addEventListener("keydown", (event) => {
    const name = keys[event.key];
    if (!name || event.repeat || event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select, textarea, summary, a")) return;
    // A button that has the focus is not pressed too.
    if (event.target.matches("button") && event.key !== "Backspace" && event.key !== "n") return;
    event.preventDefault();
    act[name]();
  });
  find("squeeze").addEventListener("input", () => {
    hands.squeeze = Number(find("squeeze").value);
    find("squeeze-value").textContent = `${hands.squeeze.toFixed(1)} N`;
  });
  find("sound").addEventListener("change", () => tone.set(find("sound").checked));
  find("end-replay").addEventListener("click", endReplay);

  /** The state that the robot's recording has at this time, in place of that of the hands. */
  function replayed(now) {
    const { moves, since } = replay, lasts = moves.time[moves.time.length - 1] || 0, time = (now - since) / 1000 % (lasts + 1.5);
    const at = Math.max(0, moves.time.findLastIndex((one) => one <= time)), next = Math.min(at + 1, moves.time.length - 1);
    const share = next > at ? Math.min(1, (time - moves.time[at]) / (moves.time[next] - moves.time[at])) : 0;
    find("replay").querySelector("progress").value = Math.min(1, time / lasts);
    const between = (list) => {
      const [a, b] = [list[at], list[next]];
      // A quaternion and its negative are one rotation.
      const sign = a.length === 7 && a.slice(3).reduce((sum, part, index) => sum + part * b[index + 3], 0) < 0 ? -1 : 1;
      return mix(a, b.map((part, index) => (index > 2 ? sign * part : part)), share);
    };
    const bodies = scene.bodies.map((body) => (moves.bodies[body.name] ? between(moves.bodies[body.name]) : body.pose));
    const of = scene.hands.map(({ side }) => moves.hands.find((hand) => hand.side === side)).map((hand, index) => hand
      ? { palm: between(hand.palm), tips: hand.tips[at].map((tip, finger) => mix(tip, hand.tips[next][finger], share)), forces: hand.forces[at].map((force) => scale(force, -1)) }
      : state.hands[index]);
    return { ...state, bodies, hands: of };
  }

  /** The drawn state, and the targets of the hands. */
  function picture(shown) {
    const arrows = shown.hands.flatMap((hand) => hand.tips.flatMap((tip, finger) => {
      const force = hand.forces[finger];
      // The arrow is the force of the finger on the object: it ends at the fingertip.
      return length(force) > 0.02 ? [[add(tip, scale(force, PER_NEWTON)), tip, stage.paint.force]] : [];
    }));
    return { active: hands.active, arrows, colors, target: replay || hands.isTracked ? undefined : hands.hand.at };
  }

  let last = performance.now();
  function turn(now) {
    const seconds = Math.min(0.1, (now - last) / 1000);
    last = now;
    if (!state) return;
    hands.advance(seconds, readPad((name) => act[name]()));
    const strongest = Math.max(0, ...state.hands.flatMap((hand) => hand.forces.map(length)));
    tone.hear(strongest);
    rumble(strongest);
    if (now - read > 90) {
      read = now;
      show.numbers(state);
    }
  }
  function frame(now) {
    turn(now);
    if (state && !headset.isOn()) {
      const shown = replay ? replayed(now) : state;
      stage.draw(shown, picture(shown));
      show.follow(shown, Boolean(replay));
    }
    requestAnimationFrame(frame);
  }
  // Targets of hands do not wait for pictures.
  setInterval(() => hands.send(), 16);
  const headset = offerHeadset(find("headset"), stage, hands, { turn, state: () => state, picture, act });
  const own = { button: find("camera"), picture: find("camera-picture"), status: find("camera-status") };
  page.camera = offerCamera(own, stage, hands);
  connect();
  requestAnimationFrame(frame);
}

begin().catch((error) => {
  find("trouble").textContent = error.message;
  find("trouble").hidden = false;
});
