// Correcting: lanes of labels below those of the rules, changed by pointer and keyboard, undone, and saved beside the recording.

import { added, draw, escaped, fitting, GUTTER, lanes, plotWidth, seconds, setTime, state, view } from "./bench.js";
import { effective, followed, moved, replaced } from "./lines.js";
import { current, onOpen } from "./recording.js";
import { get, post, put, say as sayAt } from "./server.js";

const BAR = 20, GAP = 3, INK = "#16191f", AUTO = "#9aa4b2";
/** Moves by keys that are no further apart are undone together, ms. */
const PAUSE = 1500;
const byId = (id) => document.getElementById(id);
const place = byId("labeling"), name = byId("label-name"), who = byId("label-by"), status = byId("label-status"), conflict = byId("conflict");

/** The displayed lines, the version of their file, and their earlier states. */
const labels = { lines: [], version: "", undo: [], redo: [], shown: undefined, selected: undefined, saving: undefined, unsaved: false, theirs: undefined, unreadable: undefined, nudged: undefined };

const tracks = () => view.data.tracks;
const sign = () => ({ by: who.value.trim(), at: new Date().toISOString().slice(0, 19) + "Z" });
const spansOf = (number, kind) => effective(tracks()[number], labels.shown || labels.lines, kind);

// ---- drawing

const nameOf = { primitive: "labels", task: "label tasks" };

function colorOf(number, kind, label) {
  if (kind === "primitive") return current.answer?.colors[label] || AUTO;
  return tracks()[number].tasks.find((task) => task.task === label)?.color || AUTO;
}

/** The boundaries of a lane that can be moved, in order of time: two labels that meet have one. */
function edgesOf(number, kind) {
  const spans = spansOf(number, kind), { start, end } = view.data;
  const all = spans.flatMap((span, at) => {
    const meetsNext = spans[at + 1] && Math.abs(spans[at + 1].start - span.end) < 1e-6;
    const first = { number, kind, at, last: false, time: span.start, span };
    return meetsNext ? [first] : [first, { ...first, last: true, time: span.end }];
  });
  return kind === "task" ? all : all.filter(({ time }) => time > start + 1e-9 && time < end - 1e-9);
}

function lane(kind) {
  return (number, x, top, width) => {
    const track = tracks()[number], spans = spansOf(number, kind);
    if (kind === "task" && (track.who === "both" || !spans.length)) return { svg: "", labels: "", height: 0 };
    const found = effective(track, [], kind);
    let bars = "";
    spans.forEach((span, at) => {
      if (span.end <= state.from || span.start >= state.to) return;
      const left = x(span.start), right = Math.max(left + 1, x(span.end)), shownLeft = Math.max(0, left);
      const letters = fitting(span.label, Math.min(width, right) - shownLeft - 6);
      const said = span.line?.pinned ? `pinned${span.line.by ? ` by ${span.line.by}` : ""}${span.line.at ? `, ${span.line.at}` : ""}` : span.line ? "in the label file" : "as the rules say";
      const title = `${span.label}\n${seconds(span.start)} – ${seconds(span.end)}\n${said}`;
      const classes = `bar own${span.line ? span.line.pinned ? " pinned" : "" : " auto"}${isSelected(number, kind, at) ? " picked" : ""}`;
      // What the rules say otherwise is underlined.
      const others = span.line ? found.filter((one) => one.label !== span.label && one.start < span.end && one.end > span.start) : [];
      const differs = others.map((one) => {
        const from = x(Math.max(one.start, span.start)), to = x(Math.min(one.end, span.end));
        return to - from < 0.5 ? "" : `<rect class="differs" x="${from}" y="${top + BAR - 3}" width="${to - from}" height="3"/>`;
      }).join("");
      bars += `<g class="${classes}" data-own data-label="${number} ${kind} ${at}" role="button" tabindex="0" aria-label="${escaped(`${track.who} ${nameOf[kind]}: ${title}`)}"><title>${escaped(title)}</title><rect x="${left}" y="${top}" width="${right - left}" height="${BAR}" fill="${colorOf(number, kind, span.label)}"/>${differs}${letters ? `<text x="${shownLeft + 4}" y="${top + 14}"${span.line ? ` fill="${INK}"` : ""}>${escaped(letters)}</text>` : ""}</g>`;
    });
    const edges = edgesOf(number, kind).filter(({ time }) => time >= state.from && time <= state.to).map(({ at, last, time, span }) => {
      const wide = Math.max(1, x(span.end) - x(span.start));
      const half = Math.max(2, Math.min(6, wide / 2)), text = `${last ? "end" : "start"} of ${span.label}, ${seconds(time)}`;
      return `<g class="limit own" data-own data-edge="${number} ${kind} ${at} ${last ? 1 : 0}" role="slider" tabindex="0" aria-label="${escaped(`${track.who} ${nameOf[kind]}: ${last ? "end" : "start"} of ${span.label}`)}" aria-valuenow="${time.toFixed(3)}" aria-valuemin="${view.data.start.toFixed(3)}" aria-valuemax="${view.data.end.toFixed(3)}" aria-valuetext="${seconds(time)}"><title>${escaped(text)}</title><rect x="${x(time) - half}" y="${top - 1}" width="${2 * half}" height="${BAR + 2}"/><path d="M${x(time)} ${top - 1}v${BAR + 2}"/></g>`;
    });
    return { svg: bars + edges.join(""), labels: `<text class="name" x="${GUTTER - 8}" y="${top + 14}">${nameOf[kind]}</text>`, height: BAR + GAP };
  };
}
added.lanes.push(lane("primitive"), lane("task"));

const isSelected = (number, kind, at) => {
  const one = labels.selected;
  return one && one.number === number && one.kind === kind && one.at === at;
};

// The whole drawing is replaced, and the focus restored.
let focused;
lanes.addEventListener("focusin", (event) => { focused = selectorOf(event.target); });
function selectorOf(element) {
  const one = element.closest?.("[data-own]");
  return one && (one.dataset.edge !== undefined ? `[data-edge="${one.dataset.edge}"]` : `[data-label="${one.dataset.label}"]`);
}
added.drawn.push(() => {
  if (focused && document.activeElement === document.body) lanes.querySelector(focused)?.focus({ preventScroll: true });
});

/** Takes the focus to a part of the lanes, which may be drawn in a moment only. */
function focusOn(selector) {
  const element = lanes.querySelector(selector);
  if (element) return element.focus({ preventScroll: true });
  document.activeElement.blur();
  focused = selector;
  draw();
}

/** Takes the focus to the boundary nearest to the time cursor; from a boundary to the one `by` places after it in its lane. */
function goToBoundary(by) {
  const from = edgeOf(document.activeElement);
  const { number, kind } = from || labels.selected || { number: 0, kind: "primitive" };
  const edges = edgesOf(number, kind), at = from ? edges.findIndex((edge) => edge.at === from.at && edge.last === from.last) : -1;
  const apart = (edge) => Math.abs(edge.time - state.cursor);
  const next = at >= 0 ? edges[at + by] : edges.reduce((best, edge) => best && apart(best) <= apart(edge) ? best : edge, undefined);
  if (!next) return;
  setTime(next.time);
  focusOn(`[data-edge="${number} ${kind} ${next.at} ${next.last ? 1 : 0}"]`);
}

/** Takes the focus to the label at the time cursor. */
function goToLabel() {
  const one = meant();
  if (!one) return;
  select(one.number, one.kind, one.at);
  focusOn(`[data-label="${one.number} ${one.kind} ${one.at}"]`);
}

// ---- which label is meant

// Letters choose in the list as they are typed, which Enter takes; by pointer a choice is taken at once.
let isTyped = false;

/** The label that is selected, else that of the first hand at the time cursor. */
function meant() {
  const chosen = labels.selected || { number: 0, kind: "primitive" };
  const { number, kind } = chosen, spans = spansOf(number, kind), time = state.cursor;
  const at = chosen.at !== undefined && spans[chosen.at] ? chosen.at : spans.findIndex((span) => span.start <= time + 1e-9 && time < span.end);
  return at < 0 ? undefined : { number, kind, at, span: spans[at], spans, track: tracks()[number] };
}

function select(number, kind, at) {
  if (isTyped) take();
  labels.selected = at === undefined ? undefined : { number, kind, at };
  bar();
  draw();
}

/** What the toolbar says and offers. */
function bar() {
  const one = view.data && meant(), kind = one?.kind || "primitive";
  const names = current.answer?.names[kind] || [], typed = isTyped && name.value;
  if (name.dataset.kind !== kind || name.options.length !== names.length + 1) {
    name.innerHTML = `<option value="">label …</option>${names.map((label) => `<option>${escaped(label)}</option>`).join("")}`;
    name.dataset.kind = kind;
  }
  // What is being typed stays when an answer of the server comes.
  name.value = typed || (labels.selected && one && names.includes(one.span.label) ? one.span.label : "");
  byId("label-what").textContent = labels.selected && one ? `${one.track.who} ${kind}, ${one.span.start.toFixed(3)} – ${seconds(one.span.end)}` : "";
  byId("undo").disabled = !labels.undo.length;
  byId("redo").disabled = !labels.redo.length;
  const pinned = labels.lines.filter((line) => line.pinned).length;
  if (labels.unreadable) return say(labels.unreadable, true);
  say(labels.theirs ? "not saved" : labels.saving || labels.unsaved ? "saving …" : `${pinned} pinned label${pinned === 1 ? "" : "s"}${labels.version ? ", saved" : ""}`);
}

// ---- changing

function change(lines) {
  labels.undo.push(labels.lines);
  labels.redo = [];
  labels.nudged = undefined;
  set(lines);
}

/** A boundary moved by a key. Moves of one boundary that follow each other soon are one step of undo. */
function nudge(edge, lines) {
  const boundary = JSON.stringify(edge), now = performance.now(), last = labels.nudged;
  if (last?.boundary === boundary && last.lines === labels.lines && now - last.at < PAUSE) set(lines);
  else change(lines);
  labels.nudged = { boundary, lines, at: now };
}

function set(lines) {
  labels.lines = lines;
  labels.shown = undefined;
  labels.unsaved = true;
  bar();
  draw();
  save();
}

function step(from, to) {
  const lines = labels[from].pop();
  if (!lines) return;
  labels[to].push(labels.lines);
  labels.selected = undefined;
  set(lines);
}

const commands = {
  undo: () => step("undo", "redo"),
  redo: () => step("redo", "undo"),
  split() {
    const one = meant(), time = state.cursor;
    if (!one || time <= one.span.start + 1e-6 || time >= one.span.end - 1e-6) return say("Put the time cursor inside a label to split it.");
    const { track, kind, span } = one;
    change(replaced(labels.lines, track, kind, span.start, span.end, [{ ...span, end: time }, { ...span, start: time }], sign()));
    select(one.number, kind, one.at + 1);
  },
  merge() {
    const one = meant(), next = one && one.spans[one.at + 1];
    if (!next) return say("There is no label after this one.");
    const { track, kind, span } = one;
    change(replaced(labels.lines, track, kind, span.start, next.end, [{ ...span, end: next.end }], sign()));
    select(one.number, kind, one.at);
  },
  rename(label) {
    const one = meant();
    if (!one) return;
    const { track, kind, span } = one;
    change(replaced(labels.lines, track, kind, span.start, span.end, [{ ...span, label }], sign()));
    select(one.number, kind, one.at);
  },
  /** A task without a name of the rules: wrong, or unknown. */
  unknown() {
    const time = state.cursor;
    const { number } = labels.selected || { number: 0 };
    const chosen = labels.selected?.kind === "task" ? labels.selected.at : spansOf(number, "task").findIndex((span) => span.start <= time && time < span.end);
    if (chosen < 0) return say("There is no task at the time cursor.");
    labels.selected = { number, kind: "task", at: chosen };
    commands.rename("unknown");
  },
  /** Removes a label: the rules decide again. */
  release() {
    const one = meant();
    if (!one || !one.span.line) return say("This label is the result of the rules.");
    const lines = replaced(labels.lines, one.track, one.kind, one.span.start, one.span.end, [], sign());
    change(one.kind === "primitive" ? followed(labels.lines, lines, one.track) : lines);
    select();
  },
  /** All labels are right as they are. */
  accept() {
    let lines = labels.lines;
    tracks().forEach((track, number) => {
      for (const kind of ["primitive", "task"]) {
        const spans = spansOf(number, kind);
        if (spans.length) lines = replaced(lines, track, kind, spans[0].start, spans[spans.length - 1].end, spans, sign());
      }
    });
    change(lines);
  },
};

function say(text, isWrong = false) {
  sayAt(status, text, isWrong);
}

/** Marks a time of a primitive that the rules do not have yet. */
export function mark(number, label, start, end) {
  labels.fresh = label;
  change(replaced(labels.lines, tracks()[number], "primitive", start, end, [{ label, start, end }], sign()));
}

// ---- saving: one request at a time, the last state wins

async function save() {
  if (labels.saving || labels.theirs) return;
  const at = current.at, lines = labels.lines;
  labels.unsaved = false;
  labels.saving = put(`api/recording/${at}/labels`, { base: labels.version, lines, new: labels.fresh });
  bar();
  try {
    const saved = await labels.saving;
    if (current.at === at) labels.version = saved.version;
  } catch (error) {
    if (current.at === at && error.status === 409) {
      labels.theirs = error.answer;
      labels.unsaved = true;
      conflict.hidden = false;
      conflict.querySelector("button").focus();
    } else {
      labels.saving = undefined;
      bar();
      return say(error.message, true);
    }
  }
  labels.saving = undefined;
  bar();
  if (labels.unsaved && current.at === at) save();
}

function resolve(lines) {
  labels.version = labels.theirs.version;
  labels.theirs = undefined;
  conflict.hidden = true;
  if (lines) {
    labels.undo.push(labels.lines);
    Object.assign(labels, { lines, unsaved: false, selected: undefined });
    bar();
    draw();
  } else {
    save();
  }
}
byId("take-theirs").addEventListener("click", () => resolve(labels.theirs.lines));
byId("keep-mine").addEventListener("click", () => resolve());

/** The list contains the version of the file: labels that another window saved are shown. */
export async function follow(version) {
  if (version === undefined || version === labels.version || labels.saving || labels.unsaved || labels.theirs || labels.shown) return;
  const at = current.at;
  const theirs = await get(`api/recording/${at}/labels`).catch(() => undefined);
  if (!theirs || current.at !== at || labels.saving || labels.unsaved || theirs.version === labels.version) return;
  Object.assign(labels, { lines: theirs.lines, version: theirs.version, undo: [], redo: [], selected: undefined });
  bar();
  say("another window changed the labels: they are shown");
  draw();
}

// ---- pointer

const timeAt = (event) => state.from + (event.clientX - lanes.getBoundingClientRect().left - GUTTER) / plotWidth(lanes) * (state.to - state.from);

/** The frame nearest to a time. */
function onFrame(time) {
  const { start, end } = view.data;
  return view.step ? Math.min(end, Math.max(start, start + Math.round((time - start) / view.step) * view.step)) : time;
}

let held;
const edgeOf = (element) => {
  const edge = element.closest?.("[data-edge]");
  if (!edge) return undefined;
  const [number, kind, at, last] = edge.dataset.edge.split(" ");
  return { number: Number(number), kind, at: Number(at), last: last === "1" };
};
function movedTo(edge, time) {
  const track = tracks()[edge.number], lines = moved(labels.lines, track, edge.kind, edge, time, sign(), view.step || 1e-3);
  return edge.kind === "primitive" ? followed(labels.lines, lines, track) : lines;
}

lanes.addEventListener("pointerdown", (event) => {
  if (event.button !== 0) return;
  const edge = edgeOf(event.target);
  const label = event.target.closest?.("[data-label]");
  if (edge) {
    held = { edge, from: event.clientX, id: event.pointerId };
    event.preventDefault();
    lanes.setPointerCapture(event.pointerId);
  } else if (label) {
    const [number, kind, at] = label.dataset.label.split(" ");
    setTime(timeAt(event));
    select(Number(number), kind, Number(at));
  }
});
lanes.addEventListener("pointermove", (event) => {
  if (!held || Math.abs(event.clientX - held.from) < 2 && !held.moves) return;
  held.moves = true;
  held.time = onFrame(timeAt(event));
  labels.shown = movedTo(held.edge, held.time);
  setTime(held.time, false);
  draw();
});
for (const kind of ["pointerup", "pointercancel"]) lanes.addEventListener(kind, (event) => {
  if (!held) return;
  const { edge, moves, time } = held;
  held = undefined;
  labels.shown = undefined;
  if (kind === "pointercancel" || !moves) {
    if (!moves) setTime(spansOf(edge.number, edge.kind)[edge.at][edge.last ? "end" : "start"]);
    return draw();
  }
  change(movedTo(edge, time));
});

// ---- keys

lanes.addEventListener("keydown", (event) => {
  const edge = edgeOf(event.target), label = event.target.closest?.("[data-label]");
  const by = { ArrowLeft: -1, ArrowRight: 1, PageDown: -100, PageUp: 100 }[event.key];
  if (edge && by && !event.ctrlKey && !event.metaKey) {
    const span = spansOf(edge.number, edge.kind)[edge.at];
    const time = onFrame((edge.last ? span.end : span.start) + by * (event.shiftKey ? 10 : 1) * (view.step || 1e-3));
    nudge(edge, movedTo(edge, time));
    setTime(time);
  } else if (label && (event.key === "Enter" || event.key === " ")) {
    const [number, kind, at] = label.dataset.label.split(" ");
    setTime(spansOf(Number(number), kind)[at].start, true);
    select(Number(number), kind, Number(at));
    name.focus();
  } else {
    return;
  }
  event.preventDefault();
  event.stopPropagation();
});

const keys = { s: "split", m: "merge", u: "unknown", a: "accept", Delete: "release", Backspace: "release" };
document.addEventListener("keydown", (event) => {
  if (!view.data || event.altKey || event.target.closest("input, textarea, select")) return;
  const command = event.ctrlKey || event.metaKey
    ? { z: event.shiftKey ? "redo" : "undo", Z: "redo", y: "redo" }[event.key]
    : keys[event.key];
  if (event.key === "e" && !event.ctrlKey && !event.metaKey) {
    const one = meant();
    if (one) select(one.number, one.kind, one.at);
    name.focus();
    event.preventDefault();
  }
  const go = !event.ctrlKey && !event.metaKey && { b: () => goToBoundary(1), B: () => goToBoundary(-1), l: goToLabel }[event.key];
  if (!command && !go) return;
  event.preventDefault();
  if (go) go(); else commands[command]();
});

for (const id of ["undo", "redo", "split", "merge", "unknown", "release", "accept"]) byId(id).addEventListener("click", () => commands[id]());
function take() {
  isTyped = false;
  if (name.value) commands.rename(name.value);
}
/** The keys are about the label again. */
function leave() {
  const { number, kind, at } = labels.selected || {};
  const label = lanes.querySelector(`[data-label="${number} ${kind} ${at}"]`);
  if (label) label.focus({ preventScroll: true });
  else name.blur();
}
name.addEventListener("pointerdown", () => { isTyped = false; });
name.addEventListener("change", () => {
  if (isTyped) return;
  take();
  leave();
});
name.addEventListener("blur", () => { if (isTyped) take(); });
name.addEventListener("keydown", (event) => {
  if (event.key === "Enter" || event.key === "Escape") {
    if (event.key === "Escape") {
      isTyped = false;
      bar();
    } else if (isTyped) {
      take();
    }
    leave();
    event.preventDefault();
    event.stopPropagation();
  } else if (event.key !== "Tab" && event.key !== "Shift") {
    isTyped = true;
  }
});

who.value = localStorage.getItem("teachtree.who") || "";
who.addEventListener("change", () => localStorage.setItem("teachtree.who", who.value.trim()));

async function write(form, replace) {
  try {
    say(`${(await post(`api/recording/${current.at}/export/${form}`, { replace })).file} is written`);
  } catch (error) {
    // A file that is there may have been corrected elsewhere.
    if (error.status === 409 && confirm(`${error.message}. Replace it?`)) return write(form, true);
    say(error.message, true);
  }
}
const menu = byId("exports");
const close = () => { menu.open = false; };
for (const form of ["elan", "lerobot"]) byId(`export-${form}`).addEventListener("click", () => { close(); write(form, false); });
document.addEventListener("pointerdown", (event) => { if (!menu.contains(event.target)) close(); });
menu.addEventListener("focusout", (event) => { if (event.relatedTarget && !menu.contains(event.relatedTarget)) close(); });
menu.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || !menu.open) return;
  close();
  menu.querySelector("summary").focus();
  event.stopPropagation();
});

onOpen((answer, again) => {
  place.hidden = false;
  if (!who.value) who.value = answer.who;
  // The rules may have changed; the current edit stays.
  if (again && (labels.saving || labels.unsaved || labels.theirs)) return;
  if (!again) isTyped = false;
  if (!again) Object.assign(labels, { undo: [], redo: [], selected: undefined, theirs: undefined });
  conflict.hidden = !labels.theirs;
  Object.assign(labels, { lines: answer.labels?.lines || [], version: answer.labels?.version || "", shown: undefined, unreadable: answer.label_error });
  name.dataset.kind = "";
  bar();
});
