// The texts beside the scene: labels, forces, recordings, results of the robot, and the next step.

import { add, length, scale, sub } from "./space.js";
import { send } from "./socket.js";

const find = (id) => document.getElementById(id);

/** Makes an element with attributes, text and children. */
function made(name, attributes = {}, ...inside) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...inside);
  return element;
}

/** Seconds that a lane shows. */
const SHOWN = 20;

export class Show {
  constructor(stage, hands) {
    this.stage = stage;
    this.hands = hands;
    this.tracks = [];
    this.takes = { takes: [], robot: null };
    this.names = stage.scene.bodies.map((body) => {
      if (body.role !== "object") return undefined;
      const name = made("span", {}, body.name);
      find("names").append(name);
      return name;
    });
    find("scene-name").textContent = stage.scene.name;
    find("next").hidden = stage.scene.hands.length < 2;
    this.meters = stage.scene.hands.map(({ side, fingers }) => fingers.map((finger) => {
      const meter = made("i"), value = made("output", {}, "0.0 N");
      const label = stage.scene.hands.length > 1 ? `${side[0].toUpperCase()} ${finger}` : finger;
      find("forces").append(made("div", { class: "finger" }, label, made("div", { class: "meter" }, meter), value));
      return { meter, value };
    }));
    this.now();
  }

  trouble(text = "") {
    find("trouble").textContent = text;
    find("trouble").hidden = !text;
  }

  /** Names and numbers that follow the scene, at each picture. */
  follow(state, isReplay) {
    this.stage.scene.bodies.forEach((body, index) => {
      const name = this.names[index];
      if (!name) return;
      const at = this.stage.onCanvas((state.bodies[index] || body.pose).slice(0, 3));
      name.hidden = !at;
      if (at) name.style.cssText = `left:${at[0].toFixed(1)}px;top:${(at[1] + 10).toFixed(1)}px`;
    });
    const hand = state.hands[this.hands.active];
    const middle = scale(hand.tips.reduce(add, [0, 0, 0]), 1 / hand.tips.length);
    const at = this.stage.onCanvas(middle), high = middle[2] - this.stage.ground.z;
    find("height").hidden = !at || isReplay;
    if (at) find("height").style.cssText = `left:${(at[0] + 34).toFixed(1)}px;top:${(at[1] - 8).toFixed(1)}px`;
    find("height").textContent = `${Math.round(high * 1000)} mm`;
  }

  /** Numbers that are read, some times a second. */
  numbers(state) {
    state.hands.forEach((hand, index) => hand.forces.forEach((force, finger) => {
      const { meter, value } = this.meters[index][finger], strength = length(force);
      meter.style.width = `${Math.min(100, strength * 20).toFixed(1)}%`;
      value.textContent = `${strength.toFixed(1)} N`;
    }));
    const record = find("record");
    record.setAttribute("aria-pressed", state.recording);
    record.textContent = state.recording ? "■ Stop" : "● Record";
    find("clock").textContent = state.recording ? `${state.recorded.toFixed(1)} s` : "";
    find("close").setAttribute("aria-pressed", this.hands.hand.closes);
    find("close").textContent = this.hands.hand.closes ? "Open hand" : "Close hand";
    const { servo } = state;
    find("servo").textContent = `Physics at 1 kHz: ${(servo.within_1_ms * 100).toFixed(2)} % of ${servo.steps.toLocaleString("en")} steps within 1 ms of their time, 99.9 % within ${(servo.p999_us / 1000).toFixed(2)} ms.`;
    this.coach(state);
    this.lanes(state);
  }

  /** What to do next, for one who has never done it. */
  coach(state) {
    const hand = state.hands[this.hands.active], { scene, ground } = this.stage;
    const middle = scale(hand.tips.reduce(add, [0, 0, 0]), 1 / hand.tips.length);
    const holds = this.tracks.find((track) => track.who === scene.hands[this.hands.active].side)?.label?.[3];
    const touching = hand.forces.filter((force) => length(force) > 0.03).length;
    const objects = scene.bodies.map((body, index) => ({ body, pose: state.bodies[index] || body.pose })).filter(({ body }) => body.role === "object");
    const near = objects.map((one) => ({ ...one, way: sub(one.pose.slice(0, 3), middle) })).sort((a, b) => Math.hypot(a.way[0], a.way[1]) - Math.hypot(b.way[0], b.way[1]))[0];
    const beside = near ? Math.hypot(near.way[0], near.way[1]) : Infinity;
    let text = "";
    if (this.hands.isTracked) text = "";
    else if (!state.recording && !this.takes.takes.length) text = "Press Record (Enter) when you are ready. Until then, try: drag moves the hand.";
    else if (!state.recording) text = "";
    else if (this.hands.hand.closes && touching >= 2 && holds) {
      text = middle[2] - ground.z < 0.06 ? "You hold it: the wheel lifts it. To put it down, lower it until it stands, then open the hand (Space)." : "Bring it to its place by dragging, then lower it with the wheel until it stands.";
    } else if (this.hands.hand.closes && touching === 0) text = "The fingers have found nothing. Open the hand (Space).";
    else if (!this.hands.hand.closes && near && beside > 0.02) text = `Drag the hand over the ${near.body.name.replaceAll("_", " ")}: the blue ring shows what is below the fingertips.`;
    else if (!this.hands.hand.closes && near && middle[2] > near.pose[2] + 0.022) text = "Lower the hand around it with the wheel.";
    else if (!this.hands.hand.closes && near) text = "Close the hand: Space.";
    if (find("coach").textContent !== text) find("coach").textContent = text;
  }

  /** The labels, as they come. */
  labels({ tracks, trouble }) {
    this.tracks = tracks;
    if (trouble) this.trouble(`There are no labels: ${trouble}`);
    this.now();
    const tasks = tracks.flatMap((track) => track.tasks.map(([name]) => `${track.who} hand: ${name.replaceAll("_", " ")}`));
    find("done").hidden = !tasks.length;
    find("done").textContent = tasks.length ? `✓ ${tasks.join("; ")}` : "";
  }

  now() {
    const rows = this.stage.scene.hands.map(({ side }, index) => {
      const track = this.tracks.find((one) => one.who === side);
      const who = made("span", { class: `who${index === this.hands.active ? " active" : ""}` }, side);
      if (!track?.label) return made("li", {}, who, made("span", { class: "quiet" }, "labels appear while you record"));
      const chip = made("span", { class: "chip" }, track.label[0]);
      chip.style.background = track.label[2];
      return made("li", {}, who, chip);
    });
    find("now").replaceChildren(...rows);
  }

  lanes(state) {
    const end = Math.max(SHOWN, state.recording ? state.recorded : Math.max(0, ...this.tracks.flatMap((track) => track.segments.map((one) => one[2]))));
    const from = end - SHOWN;
    const lanes = this.tracks.filter((track) => track.segments.length || track.label).map((track) => {
      const bars = made("div", { class: "bars" });
      const shown = track.segments.map(([name, start, stop, color]) => [name, start, stop, color]);
      const last = shown.length ? shown[shown.length - 1][2] : 0;
      if (state.recording && track.label) shown.push([track.label[0], last, state.recorded, track.label[2]]);
      for (const [name, start, stop, color] of shown) {
        if (stop <= from) continue;
        const bar = made("i", { title: `${name} ${start.toFixed(2)} – ${stop.toFixed(2)} s` }, name);
        bar.style.cssText = `left:${(Math.max(0, start - from) / SHOWN * 100).toFixed(2)}%;width:${((stop - Math.max(from, start)) / SHOWN * 100).toFixed(2)}%;background:${color}`;
        bars.append(bar);
      }
      return made("div", { class: "lane" }, track.who, bars);
    });
    find("lanes").replaceChildren(...lanes);
  }

  /** Recordings, and the robot's results with them. */
  recorded(message, watch) {
    this.takes = message;
    find("no-takes").hidden = message.takes.length > 0;
    const isBusy = message.robot?.state === "works";
    find("takes").replaceChildren(...message.takes.map((take, at) => {
      const item = made("li", { "data-take": at }, made("b", {}, take.file), ` ${take.seconds.toFixed(1)} s`);
      if (!take.written && !take.trouble) item.append(made("div", { class: "quiet" }, "is being written …"));
      else if (take.trouble) item.append(made("div", { class: "warn" }, take.trouble));
      else if (!take.tasks.length) item.append(made("div", { class: "quiet" }, "no task was found in it"));
      for (const task of take.tasks) item.append(made("div", {}, `✓ ${task}`));
      if (take.written && take.tasks.length) {
        const button = made("button", { "data-robot": at }, "Let the robot do it");
        button.disabled = isBusy;
        button.onclick = () => send({ type: "robot", take: at });
        item.append(button);
      }
      return item;
    }));
    const place = find("robot"), { robot } = message;
    place.hidden = !robot;
    if (!robot) return;
    const file = message.takes[robot.take]?.file ?? "";
    if (robot.state === "works") place.replaceChildren(`The robot tries ${file} …`, made("progress", { max: 1, value: robot.part }));
    else if (robot.state === "failed") place.replaceChildren(made("span", { class: "warn" }, `The robot cannot do ${file}: ${robot.text}`));
    else {
      const button = made("button", { id: "watch" }, "Watch it");
      button.onclick = watch;
      const verdict = made("span", { class: robot.done ? "yes" : "no" }, robot.done ? "✓ The robot did it." : "The robot did not do it as you did.");
      place.replaceChildren(verdict, " ", button, " ", made("a", { href: "robot.html", target: "_blank" }, "pictures and forces"), made("pre", {}, robot.text.trim()));
    }
  }
}

/** A soft tone after the strongest force. */
export class Tone {
  set(isOn) {
    this.isOn = isOn;
    if (!isOn || this.gain) return void this.context?.[isOn ? "resume" : "suspend"]();
    this.context = new AudioContext();
    this.tone = new OscillatorNode(this.context, { type: "triangle", frequency: 160 });
    this.gain = new GainNode(this.context, { gain: 0 });
    this.tone.connect(this.gain).connect(this.context.destination);
    this.tone.start();
  }

  hear(force) {
    if (!this.isOn) return;
    const now = this.context.currentTime;
    this.gain.gain.setTargetAtTime(Math.min(0.12, force * 0.03), now, 0.02);
    this.tone.frequency.setTargetAtTime(150 + 60 * Math.min(5, force), now, 0.02);
  }
}
