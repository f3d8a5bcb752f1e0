// The lanes, pointer, wheel and keys; signals, explanations and replay keep step with the time cursor.

const byId = (id) => document.getElementById(id);
const work = byId("work"), lanes = byId("lanes"), lanesSvg = lanes.querySelector("svg"), signals = byId("signals"), why = byId("why");

/** Text for an element or an attribute. */
const escaped = (text) => String(text).replace(/[&<>"']/g, (letter) => `&#${letter.charCodeAt(0)};`);
const seconds = (time) => `${time.toFixed(3)} s`;
const paints = new Map();

/** A color of the style sheet, light or dark. */
function paint(name) {
  if (!paints.has(name)) paints.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return paints.get(name);
}

const INK = "#16191f";
const GUTTER = 104, RIGHT = 10, AXIS = 22, BAR = 20, GAP = 3;
const CURVES = 7;

const state = { from: 0, to: 1, cursor: 0, selected: undefined, playing: false };
let total = 1, shortest = 1;

/**
 * What a page around this one adds: `lanes` draw below those of a track, from a track, a function from time to place, and a height to `{ svg, labels, height }`;
 * `moved` are called with each new time, `drawn` after each drawing.
 */
const added = { lanes: [], moved: [], drawn: [] };

// ---- time and place

// Measured once for each drawing: a measurement between two changes of the page makes the browser lay it out again.
const widths = new Map();
const measure = () => [lanes, signals].forEach((element) => widths.set(element, Math.max(20, element.clientWidth - GUTTER - RIGHT)));
const plotWidth = (element) => widths.get(element);
const xOf = (time, width) => (time - state.from) / (state.to - state.from) * width;

function show(from, to) {
  const span = Math.min(total, Math.max(shortest, to - from));
  const middle = (from + to) / 2;
  state.from = Math.min(data.end - span, Math.max(data.start, middle - span / 2));
  state.to = state.from + span;
  draw();
}

function zoom(by, about = state.cursor >= state.from && state.cursor <= state.to ? state.cursor : (state.from + state.to) / 2) {
  const span = Math.min(total, Math.max(shortest, (state.to - state.from) * by));
  const share = (about - state.from) / (state.to - state.from);
  show(about - share * span, about + (1 - share) * span);
}

const move = (by) => show(state.from + by, state.to + by);

function setTime(time, follow = true) {
  state.cursor = Math.min(data.end, Math.max(data.start, time));
  if (follow && (state.cursor < state.from || state.cursor > state.to)) {
    const span = state.to - state.from;
    // During play the cursor enters at the left; a searched time is in the middle.
    show(state.cursor - span * (state.playing ? 0.05 : 0.5), state.cursor + span * (state.playing ? 0.95 : 0.5));
  }
  drawCursor();
}

/** Times for a scale: a step of 1, 2 or 5 times a power of ten. */
function ticks(from, to, most) {
  const least = (to - from) / most, power = 10 ** Math.floor(Math.log10(least));
  const by = [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= least) || 10 * power;
  const list = [];
  for (let at = Math.ceil(from / by - 1e-9); at * by <= to + by * 1e-9; at++) list.push(at * by);
  return { list, digits: Math.max(0, -Math.floor(Math.log10(by) + 1e-9)) };
}

const ruler = document.createElement("canvas").getContext("2d");

/** How wide a text of the plots is. */
function widthOf(text) {
  ruler.font = `11px ${paint("--font")}`;
  return ruler.measureText(text).width;
}

/** As many letters of a name as there is room for; none where a single letter would mean nothing. */
function fitting(name, room) {
  if (room < 4) return "";
  let most = name.length;
  while (most > 0 && widthOf(name.slice(0, most)) > room) most--;
  return most > 1 || most === name.length ? name.slice(0, most) : "";
}

// ---- lanes

const LANES = ["raw", "relabeled", "tasks", "composites"];
/** Of a lane in which more bars than this are seen, those that are narrower than `NARROW` are drawn as one, px. */
const CROWDED = 200, NARROW = 3;

function drawLanes() {
  const width = plotWidth(lanes), scaleTicks = ticks(state.from, state.to, Math.max(3, width / 90));
  const x = (time) => xOf(time, width);
  let labels = "", inside = "", y = AXIS;
  const seen = (start, end) => end > state.from && start < state.to;
  const local = (start, end) => end - start < 0.95 * total;
  if (data.issues.some(([start, end]) => local(start, end))) {
    labels += `<text class="name" x="${GUTTER - 8}" y="${y + 8}">issues</text>`;
    for (const [start, end, kind, channel, message] of data.issues) {
      // Issues of the whole recording are in the table below.
      if (!seen(start, Math.max(end, start + step)) || !local(start, end)) continue;
      inside += `<rect class="issue" x="${x(start)}" y="${y + 2}" width="${Math.max(3, x(end) - x(start))}" height="6"><title>${escaped(`${kind} ${channel}: ${message}`)}</title></rect>`;
    }
    y += 12;
  }
  const rows = [];
  data.tracks.forEach((track, number) => {
    y += 4;
    const own = track.lanes ?? LANES;
    for (const lane of own) {
      const items = track[lane] ?? [];
      if (!items.length && (lane === "tasks" || lane === "composites")) continue;
      const label = lane === own[0] ? `<tspan class="who">${escaped(track.who)}</tspan> ${track.lanes ? "" : lane}` : lane === "composites" ? "composite" : lane;
      labels += `<text class="name" x="${GUTTER - 8}" y="${y + 14}">${label}</text>`;
      const isTask = lane === "tasks" || lane === "composites", span = (item) => isTask ? [item.start, item.end, item.color] : [item[1], item[2], data.colors[item[0]]];
      const crowd = crowded(items.map(span), (at) => is(isTask ? "task" : "segment", number, lane, at), y);
      inside += crowd.svg;
      items.forEach((item, at) => { if (!crowd.has(at)) inside += lane === "tasks" ? task(item, number, at, y) : lane === "composites" ? composite(item, number, y) : segment(track, lane, item, number, at, y); });
      rows.push({ y, number, lane, isCrowded: crowd.svg !== "" });
      y += BAR + GAP;
    }
    for (const lane of added.lanes) {
      const one = lane(number, x, y, width);
      labels += one.labels;
      inside += one.svg;
      y += one.height;
    }
  });

  // Where there are too many bars to hit one of them, those of a color are one path, and a place is a time only.
  function crowded(spans, isPicked, top) {
    if (spans.filter(([start, end]) => seen(start, end)).length <= CROWDED) return { svg: "", has: () => false };
    const paths = new Map(), ends = new Map(), drawn = new Set();
    spans.forEach(([start, end, color], at) => {
      const left = Math.max(0, x(start)), right = Math.min(width, x(end));
      if (!seen(start, end) || right - left >= NARROW || isPicked(at)) return;
      drawn.add(at);
      // A bar within half a pixel of the previous one cannot be distinguished from it.
      if (right < (ends.get(color) ?? -1) + 0.5) return;
      ends.set(color, right);
      const wide = Math.max(0.5, right - left).toFixed(1);
      paths.set(color, `${paths.get(color) ?? ""}M${left.toFixed(1)} ${top}h${wide}v${BAR}h-${wide}z`);
    });
    const svg = [...paths].map(([color, path]) => `<path class="crowd" d="${path}" fill="${color}"/>`).join("");
    return { svg, has: (at) => drawn.has(at) };
  }

  function bar(start, end, top, color, name, pick, classes, title, extra = "") {
    const left = x(start), right = Math.max(left + 1, x(end));
    const shownLeft = Math.max(0, left), letters = fitting(name, Math.min(width, right) - shownLeft - 6);
    const text = letters ? `<text x="${shownLeft + 4}" y="${top + 14}" fill="${INK}">${escaped(letters)}</text>` : "";
    return `<g class="bar${classes}" data-pick="${pick}"><title>${escaped(title)}</title><rect x="${left}" y="${top}" width="${right - left}" height="${BAR}" fill="${color}"/>${extra}${text}</g>`;
  }

  function segment(track, lane, [name, start, end, was, by, subject, sure], number, at, top) {
    if (!seen(start, end)) return "";
    const changed = by !== null;
    const gone = lane === "raw" && track.gone[at];
    const title = `${name}${subject ? ` ${subject}` : ""}\n${seconds(start)} – ${seconds(end)}${changed ? `\nwas ${was.join(", ")}\nby ${by.join("; ")}` : ""}${sure ? `\n${certainty(sure)}` : ""}`;
    const picked = is("segment", number, lane, at) ? " picked" : "";
    const mark = changed ? `<rect class="made" x="${x(start)}" y="${top + BAR - 3}" width="${Math.max(1, x(end) - x(start))}" height="3"/>` : "";
    return bar(start, end, top, data.colors[name], name, `segment ${number} ${lane} ${at}`, `${gone ? " gone" : ""}${picked}`, title, mark);
  }

  function task(one, number, at, top) {
    if (!seen(one.start, one.end)) return "";
    const title = `${one.task}${one.subject ? ` ${one.subject}` : ""}\n${seconds(one.start)} – ${seconds(one.end)}${one.remarks ? `\n${one.remarks}` : ""}${one.stability === null || one.stability === undefined ? "" : `\nstability ${shareText(one.stability)}`}`;
    const name = `${one.open[0] ? "… " : ""}${one.task}${one.open[1] ? " …" : ""}`;
    return bar(one.start, one.end, top, one.color, name, `task ${number} tasks ${at}`, is("task", number, "tasks", at) ? " picked" : "", title);
  }

  // A task that is made of tasks: its first one is picked.
  function composite(one, number, top) {
    if (!seen(one.start, one.end)) return "";
    const name = `${one.open[0] ? "… " : ""}${one.task}${one.open[1] ? " …" : ""}`;
    const title = `${one.task}\n${seconds(one.start)} – ${seconds(one.end)}\n${one.remarks}`;
    return bar(one.start, one.end, top, one.color, name, `task ${number} tasks ${one.first}`, "", title);
  }

  // Boundaries lie over the bars, as wide as fits between them, so that each can be hit.
  for (const { y: top, number, lane, isCrowded } of rows) {
    if (lane === "tasks" || lane === "composites") continue;
    const items = data.tracks[number][lane];
    items.forEach(([name, start, , , , , sure], at) => {
      if (at === 0 && start <= data.start + 1e-9 || start < state.from || start > state.to) return;
      const before = items[at - 1], from = before && Math.abs(before[2] - start) < 1e-6 ? before[0] : "nothing";
      const left = before ? x(start) - x(before[1]) : 20, right = x(items[at][2]) - x(start);
      if (isCrowded && Math.max(left, right) < NARROW && !is("cut", number, lane, at)) return;
      const half = Math.max(1.5, Math.min(6, Math.min(left, right) / 2));
      const title = `${from} → ${name} at ${seconds(start)}${sure ? `\n${certainty(sure)}` : ""}`;
      // The range of the boundary with varied params, as a bar with ends.
      if (sure && sure[2] - sure[1] > 1e-9) {
        const [left, right] = [x(sure[1]), x(sure[2])], middle = top + BAR - 4;
        inside += `<path class="varies" d="M${left} ${middle}H${right}M${left} ${middle - 2}v4M${right} ${middle - 2}v4"/>`;
      }
      inside += `<g class="limit${is("cut", number, lane, at) ? " picked" : ""}" role="button" tabindex="0" aria-label="${escaped(`${data.tracks[number].who} ${lane}: ${title}`)}" data-pick="cut ${number} ${lane} ${at}"><title>${escaped(title)}</title><rect x="${x(start) - half}" y="${top - 1}" width="${2 * half}" height="${BAR + 2}"/><path d="M${x(start)} ${top - 1}v${BAR + 2}"${half < 2 ? ` class="dense"` : ""}/></g>`;
    });
  }
  const selected = state.selected && startOf(state.selected);
  const mark = selected === undefined ? "" : `<path class="chosen" d="M${x(selected)} ${AXIS - 4}V${y}"/>`;
  const lines = scaleTicks.list.map((time) => `M${x(time)} ${AXIS - 4}V${y}`).join("");
  // A number at an end of the axis stays between the unit and the edge.
  const times = scaleTicks.list.map((time) => {
    const number = time.toFixed(scaleTicks.digits), half = widthOf(number) / 2;
    const at = Math.min(GUTTER + width + RIGHT - half, Math.max(GUTTER + half, GUTTER + x(time)));
    return `<text class="tick" x="${at}" y="13">${number}</text>`;
  }).join("");
  const focused = document.activeElement && document.activeElement.dataset && document.activeElement.dataset.pick;
  lanesSvg.setAttribute("width", width + GUTTER + RIGHT);
  lanesSvg.setAttribute("height", y + 2);
  lanesSvg.innerHTML = `${times}<text class="name" x="${GUTTER - 8}" y="13">time, s</text>${labels}<svg x="${GUTTER}" y="0" width="${width}" height="${y + 2}"><path class="grid" d="${lines}"/>${inside}${mark}</svg>`;
  if (focused) lanesSvg.querySelector(`[data-pick="${focused}"]`)?.focus({ preventScroll: true });
}

/** A confidence or a stability: no variation shows that a result is certain. */
const shareText = (share) => share >= 0.995 ? "> 99 %" : `${Math.round(share * 100)} %`;
const certainty = ([share, earliest, latest]) => `confidence ${shareText(share)}, starts ${earliest.toFixed(3)} – ${seconds(latest)}`;

const is = (kind, number, lane, at) => {
  const one = state.selected;
  return one !== undefined && one.kind === kind && one.number === number && one.lane === lane && one.at === at;
};

function startOf({ number, lane, at }) {
  const item = data.tracks[number][lane][at];
  return lane === "tasks" ? item.start : item[1];
}

// ---- the selection

function select(selected, time = selected && startOf(selected)) {
  state.selected = selected;
  explain();
  why.scrollTop = 0;
  if (time !== undefined) setTime(time);
  draw();
}

let marks = [];

/** The boundary after the cursor (1) or before it (-1); of several at one time each in its turn. */
function stepTo(direction) {
  const one = state.selected;
  let at = one ? marks.findIndex((mark) => mark.number === one.number && mark.at === one.at && mark.lane === one.lane && Math.abs(mark.time - state.cursor) < 1e-6) : -1;
  if (at >= 0) at += direction;
  else if (direction > 0) at = marks.findIndex((mark) => mark.time > state.cursor + 1e-9);
  else at = marks.findLastIndex((mark) => mark.time < state.cursor - 1e-9);
  if (marks[at]) select({ kind: "cut", number: marks[at].number, lane: marks[at].lane, at: marks[at].at });
}

// ---- drawing

let replay;

function drawCursor() {
  if (replay) replay.show(state.cursor);
  for (const container of [lanes, signals]) {
    const line = container.querySelector(".cursor"), x = xOf(state.cursor, plotWidth(container));
    line.hidden = x < -1 || x > plotWidth(container) + 1;
    line.style.transform = `translateX(${GUTTER + x}px)`;
  }
  byId("clock").textContent = seconds(state.cursor);
  panels.forEach(readOut);
  added.moved.forEach((moved) => moved(state.cursor));
}

let asked = false;

/** Draws everything before the next picture of the screen. */
function draw() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    if (!data) return;
    measure();
    drawLanes();
    panels.forEach(drawPanel);
    byId("range").textContent = `${state.from.toFixed(3)} – ${seconds(state.to)}`;
    drawCursor();
    added.drawn.forEach((drawn) => drawn());
  });
}

// ---- pointer, wheel and keys

for (const container of [lanes, signals]) {
  const timeAt = (event) => state.from + (event.clientX - container.getBoundingClientRect().left - GUTTER) / plotWidth(container) * (state.to - state.from);
  const onPlot = (event) => event.clientX - container.getBoundingClientRect().left >= GUTTER && !event.target.closest("header, label, [data-own]");
  let held;
  container.addEventListener("pointerdown", (event) => {
    if (event.button === 0 && onPlot(event)) held = { x: event.clientX, from: state.from, to: state.to, moved: false, id: event.pointerId };
  });
  container.addEventListener("pointermove", (event) => {
    const hair = container.querySelector(".hair");
    hair.hidden = !onPlot(event);
    hair.style.transform = `translateX(${event.clientX - container.getBoundingClientRect().left}px)`;
    if (!held) return;
    const by = event.clientX - held.x;
    if (!held.moved && Math.abs(by) > 4) {
      held.moved = true;
      container.setPointerCapture(held.id);
    }
    if (held.moved) {
      const way = by / plotWidth(container) * (held.to - held.from);
      show(held.from - way, held.to - way);
    }
  });
  container.addEventListener("pointerleave", () => { container.querySelector(".hair").hidden = true; });
  for (const name of ["pointerup", "pointercancel"]) container.addEventListener(name, (event) => {
    const was = held;
    held = undefined;
    if (!was || was.moved || name === "pointercancel") return;
    const pick = event.target.closest("[data-pick]");
    if (pick) {
      const [kind, number, lane, at] = pick.dataset.pick.split(" ");
      const selected = { kind, number: Number(number), lane, at: Number(at) };
      select(selected, kind === "cut" ? undefined : timeAt(event));
    } else {
      setTime(timeAt(event));
    }
  });
  container.addEventListener("dblclick", (event) => { if (onPlot(event) && !event.target.closest(".limit")) show(data.start, data.end); });
  container.addEventListener("wheel", (event) => {
    if (!onPlot(event)) return;
    const lines_ = event.deltaMode ? 16 : 1, sideways = event.shiftKey ? event.deltaY || event.deltaX : event.deltaX;
    if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
      event.preventDefault();
      move(sideways * lines_ / plotWidth(container) * (state.to - state.from));
    } else if (container === lanes || event.ctrlKey || event.metaKey) {
      event.preventDefault();
      zoom(Math.exp(event.deltaY * lines_ * 0.002), timeAt(event));
    }
  }, { passive: false });
}

lanes.addEventListener("keydown", (event) => {
  const pick = event.target.closest && event.target.closest("[data-pick]");
  if (pick && (event.key === "Enter" || event.key === " ")) {
    const [kind, number, lane, at] = pick.dataset.pick.split(" ");
    select({ kind, number: Number(number), lane, at: Number(at) });
    event.preventDefault();
    event.stopPropagation();
  }
});

why.addEventListener("click", (event) => { if (event.target.closest(".close")) select(undefined); });

const keys = {
  ArrowLeft: (fine) => setTime(state.cursor - (fine ? step : (state.to - state.from) / 100)),
  ArrowRight: (fine) => setTime(state.cursor + (fine ? step : (state.to - state.from) / 100)),
  PageUp: () => move((state.from - state.to) / 2),
  PageDown: () => move((state.to - state.from) / 2),
  "+": () => zoom(0.5),
  "=": () => zoom(0.5),
  "-": () => zoom(2),
  0: () => show(data.start, data.end),
  n: () => stepTo(1),
  p: () => stepTo(-1),
  " ": () => play(!state.playing),
  Escape: () => select(undefined),
};
document.addEventListener("keydown", (event) => {
  const key = keys[event.key];
  if (!key || event.ctrlKey || event.altKey || event.metaKey || event.target.closest("select, input, textarea") || event.key === " " && event.target.closest("button, summary")) return;
  event.preventDefault();
  key(event.shiftKey);
});
byId("closer").addEventListener("click", () => zoom(0.5));
byId("farther").addEventListener("click", () => zoom(2));
byId("whole").addEventListener("click", () => show(data.start, data.end));
byId("next").addEventListener("click", () => stepTo(1));
byId("previous").addEventListener("click", () => stepTo(-1));
byId("more").querySelector("select").addEventListener("change", (event) => {
  if (event.target.value === "") return;
  const panel = addPanel(Number(event.target.value));
  event.target.value = "";
  drawPanel(panel);
  readOut(panel);
});

// ---- playing

let last;

function play(on) {
  state.playing = on;
  last = undefined;
  byId("play").textContent = on ? "Pause" : "Play";
  if (on && state.cursor >= data.end - step) setTime(data.start);
  if (on) requestAnimationFrame(tick); else drawCursor();
}

function tick(now) {
  if (!state.playing) return;
  if (last !== undefined) setTime(state.cursor + (now - last) / 1000 * Number(byId("speed").value));
  last = now;
  if (state.cursor >= data.end) play(false); else requestAnimationFrame(tick);
}

byId("play").addEventListener("click", () => play(!state.playing));

// ---- beginning

/** Lanes of other rules in the place of those that are shown. */
function showTracks(tracks, colors) {
  Object.assign(data, { tracks, colors });
  for (const track of tracks) {
    // What relabeling took away is paler.
    const made = track.relabeled.filter((segment) => segment[3]);
    track.gone = track.raw.map(([, start, end]) => made.some((one) => one[1] < end - 1e-9 && one[2] > start + 1e-9));
  }
  const first = (track) => (track.lanes ?? LANES)[0];
  marks = tracks.flatMap((track, number) => track[first(track)].map((segment, at) => ({ kind: "cut", number, lane: first(track), at, time: segment[1] })))
    .filter((mark) => mark.time > data.start + 1e-9).sort((a, b) => a.time - b.time || a.number - b.number);
  if (replay) replay.tracks = tracks;
  state.selected = undefined;
  explain();
  draw();
}

function showReplay() {
  const figure = byId("replay");
  replay = undefined;
  if (data.replay.why) {
    figure.innerHTML = `<p class="quiet">${escaped(data.replay.why)}</p>`;
    return;
  }
  figure.innerHTML = `<canvas role="img" aria-label="Replay of the demonstration"></canvas><figcaption></figcaption>`;
  const caption = figure.querySelector("figcaption");
  replay = new Replay(figure.querySelector("canvas"), caption, data.replay, data.tracks);
  const forces = replay.strong > 0 ? ` Arrows: <span class="force">forces of fingertips</span>, <span class="contact">forces on the held object</span>; the bar is their scale.` : "";
  const { every } = data.replay;
  const coarse = every ? ` <span class="detail">This page holds the poses and forces of every ${every.frames}th frame (${(every.frames * step).toPrecision(2)} s) and interpolates between them: off the log by up to ${(every.m * 1000).toPrecision(2)} mm${every.n > 0 ? ` and ${every.n.toPrecision(2)} N` : ""}.</span>` : "";
  caption.innerHTML = `Hands have the colors of their primitives; a thick ring is a touch.${forces}${coarse}`;
}

/** Shows a recording, with the signals of these titles where it has them, else the usual ones. */
function load(next, titles = []) {
  data = next;
  step = data.rate > 0 ? 1 / data.rate : 0;
  total = Math.max(data.end - data.start, 1e-6);
  shortest = Math.min(total, Math.max(0.02, 10 * step));
  truths.clear();
  work.hidden = false;
  showTracks(data.tracks, data.colors);
  showReplay();
  panels.splice(0).forEach((panel) => panel.element.remove());
  byId("more").hidden = !data.signals.length;
  if (data.signals.length) {
    const known = titles.map((title) => data.signals.findIndex((entry) => nameOf(entry) === title)).filter((at) => at >= 0);
    (known.length ? known : usual()).forEach(addPanel);
    byId("more").querySelector("select").innerHTML = `<option value="">another signal …</option>${options(-1)}`;
  }
  measure();
}

new ResizeObserver(draw).observe(work);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { paints.clear(); draw(); });
