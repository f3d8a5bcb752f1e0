// Two rule sets side by side: lanes of the other rules below those of the rules, with marks at differences, and steps from one difference to the next.

import { added, escaped, fitting, GUTTER, seconds, setTime, state, view } from "./bench.js";
import { rowOf } from "./list.js";
import { current, onOpen } from "./recording.js";

const BAR = 20, GAP = 3, INK = "#16191f", NOTHING = "nothing";
const byId = (id) => document.getElementById(id);
const place = byId("against"), words = byId("against-words");

const other = () => current.answer?.against;
const theirs = (who) => other()?.tracks?.find((track) => track.who === who);

/** The intervals in which two lists of segments have two labels: `{ start, end, one, other }`. */
export function differences(one, two) {
  const cuts = [...new Set([...one, ...two].flatMap(([, start, end]) => [start, end]))].sort((a, b) => a - b), found = [];
  const places = [0, 0];
  const label = (list, number, time) => {
    while (places[number] < list.length && list[places[number]][2] <= time) places[number]++;
    const segment = list[places[number]];
    return segment && segment[1] <= time ? segment[0] : NOTHING;
  };
  for (let at = 0; at + 1 < cuts.length; at++) {
    const ours = label(one, 0, cuts[at]), others = label(two, 1, cuts[at]);
    if (ours === others) continue;
    const last = found[found.length - 1];
    if (last && last.end === cuts[at] && last.one === ours && last.other === others) last.end = cuts[at + 1];
    else found.push({ start: cuts[at], end: cuts[at + 1], one: ours, other: others });
  }
  return found;
}

function lane(number, x, top, width) {
  const track = view.data.tracks[number], own = theirs(track.who);
  if (!own) return { svg: "", labels: "", height: 0 };
  let svg = "", y = top;
  const bar = (label, start, end, color, title) => {
    if (end <= state.from || start >= state.to) return;
    const left = x(start), right = Math.max(left + 1, x(end)), shownLeft = Math.max(0, left);
    const letters = fitting(label, Math.min(width, right) - shownLeft - 6);
    svg += `<g class="bar other"><title>${escaped(title)}</title><rect x="${left}" y="${y}" width="${right - left}" height="${BAR}" fill="${color}"/>${letters ? `<text x="${shownLeft + 4}" y="${y + 14}" fill="${INK}">${escaped(letters)}</text>` : ""}</g>`;
  };
  const name = (text) => `<text class="name" x="${GUTTER - 8}" y="${y + 14}">${text}</text>`;
  let labels = name("other rules");
  for (const [label, start, end] of own.relabeled) bar(label, start, end, other().colors[label], `${label}, by ${other().rules}\n${seconds(start)} – ${seconds(end)}`);
  for (const one of differences(track.relabeled, own.relabeled)) {
    if (one.end <= state.from || one.start >= state.to) continue;
    const left = x(one.start);
    svg += `<rect class="differs" x="${left}" y="${y + BAR - 3}" width="${Math.max(1, x(one.end) - left)}" height="3"><title>${escaped(`${one.one} here, ${one.other} there`)}</title></rect>`;
  }
  y += BAR + GAP;
  if (own.tasks.length) {
    labels += name("other tasks");
    for (const task of own.tasks) bar(task.task, task.start, task.end, task.color, `${task.task}, by ${other().rules}\n${seconds(task.start)} – ${seconds(task.end)}`);
    y += BAR + GAP;
  }
  return { svg, labels, height: y - top };
}
added.lanes.push(lane);

/** The starts of all differences, in order of time. */
function starts() {
  const of = (track) => {
    const own = theirs(track.who);
    return own ? differences(track.relabeled, own.relabeled).map((one) => one.start) : [];
  };
  return [...new Set(view.data.tracks.flatMap(of))].sort((a, b) => a - b);
}

function step(by) {
  const all = starts(), time = state.cursor;
  const next = by > 0 ? all.find((start) => start > time + 1e-6) : all.findLast((start) => start < time - 1e-6);
  if (next !== undefined) setTime(next);
}
byId("next-difference").addEventListener("click", () => step(1));
byId("previous-difference").addEventListener("click", () => step(-1));
document.addEventListener("keydown", (event) => {
  if (!other()?.tracks || event.ctrlKey || event.altKey || event.metaKey || event.target.closest("input, textarea, select")) return;
  const by = { d: 1, D: -1 }[event.key];
  if (!by) return;
  event.preventDefault();
  step(by);
});

const percent = (share) => `${(share * 100).toFixed(1)} %`;

/** What the list knows of the differences of the recording that is open. */
export function tellDifferences() {
  const against = other(), row = rowOf(current.at);
  place.hidden = !against;
  if (!against) return;
  const failed = against.error || row?.against?.error;
  byId("next-difference").disabled = byId("previous-difference").disabled = Boolean(failed);
  if (failed) {
    words.textContent = `The other rules do not run here: ${failed}`;
    return;
  }
  const counts = row?.against;
  if (!counts) return;
  const name = against.rules;
  const parts = [counts.frames ? `${counts.frames} of ${counts.of_frames} frames and ${counts.segments} of ${counts.of_segments} segments differ from ${name}` : `no difference to ${name}`];
  if (counts.own !== null && counts.accuracy !== null) {
    const by = Math.round((counts.own - counts.accuracy) * 1000);
    parts.push(`the rules agree with the labels in ${percent(counts.own)} of the time, ${name} in ${percent(counts.accuracy)}${by ? `: ${by > 0 ? "the rules" : name} better` : ""}`);
  }
  for (const [primitive, time] of Object.entries(counts.unknown ?? {})) parts.push(`no label names ${primitive}: ${time.toFixed(1)} s with it are not compared`);
  words.textContent = parts.join("; ");
}

onOpen(tellDifferences);
