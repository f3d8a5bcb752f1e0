// Tuning: params as numbers, sliders and lines in the plots; each change runs over the open recording at once.

import { draw, drawPanel, escaped, panels, readOut, showTracks, signals, view } from "./bench.js";
import { current, onOpen, open } from "./recording.js";
import { post, say, tell } from "./server.js";

const STEPS = 400;
const byId = (id) => document.getElementById(id);
const place = byId("params"), filter = byId("filter-params"), state = byId("tune-state");

let params = [];
/** The values that differ from the files, by name. */
const values = {};
let asking = false, again = false, later, typing;
/** Why the values that are shown are not those that run. */
let wrong;
/** A field in which a person types is read after such a pause, ms. */
const PAUSE = 500;

const valueOf = (param) => values[param.name] ?? param.value;
const isGeometric = ({ low, high }) => low > 0 && high >= 4 * low;
const shareOf = (param, value) => isGeometric(param) ? Math.log(value / param.low) / Math.log(param.high / param.low) : (value - param.low) / (param.high - param.low);
const atShare = (param, share) => rounded(param, isGeometric(param) ? param.low * (param.high / param.low) ** share : param.low + share * (param.high - param.low));
const rounded = ({ low, high }, value) => Math.min(high, Math.max(low, Number(value.toPrecision(3))));

function rows() {
  const wanted = filter.value.trim().toLowerCase();
  place.innerHTML = params.filter((param) => param.name.toLowerCase().includes(wanted)).map((param) => {
    const { name, unit, low, high, place: where } = param, value = valueOf(param), text = `${name}${unit ? `, ${unit}` : ""}`;
    return `<li data-param="${escaped(name)}"${name in values ? ` class="changed"` : ""}><label title="${escaped(where)}">${escaped(name)} <span class="quiet">${escaped(unit)}</span></label>
<input type="number" step="any" min="${low}" max="${high}" value="${value}" aria-label="${escaped(text)}"><button type="button" class="reset" aria-label="${escaped(`${name} as in the file`)}" title="as in the file: ${param.value}"${name in values ? "" : " hidden"}>↺</button>
<input type="range" min="0" max="${STEPS}" value="${Math.round(shareOf(param, value) * STEPS)}" aria-label="${escaped(text)}" aria-valuetext="${escaped(`${value} ${unit}`)}"></li>`;
  }).join("");
  offer();
}

/** Values that run can be written. */
function offer() {
  const changed = Object.keys(values).length > 0;
  byId("write-params").disabled = !changed || Boolean(wrong) || typing !== undefined;
  byId("reset-params").disabled = !changed && !wrong;
}

/** Shows the reason why the values do not run; empty if they do. */
function judge(text, param) {
  wrong = text;
  say(state, text, Boolean(text));
  place.querySelectorAll("[aria-invalid]").forEach((field) => field.removeAttribute("aria-invalid"));
  if (param) place.querySelector(`[data-param="${CSS.escape(param.name)}"] input[type=number]`)?.setAttribute("aria-invalid", "true");
  offer();
}

/** Updates one row to its value without taking the focus from the moved control. */
function update(param, from) {
  const row = place.querySelector(`[data-param="${CSS.escape(param.name)}"]`), value = valueOf(param);
  if (row) {
    const [number, range] = row.querySelectorAll("input");
    if (from !== number) number.value = value;
    if (from !== range) range.value = Math.round(shareOf(param, value) * STEPS);
    range.setAttribute("aria-valuetext", `${value} ${param.unit}`);
    row.classList.toggle("changed", param.name in values);
    row.querySelector(".reset").hidden = !(param.name in values);
  }
  offer();
}

function set(param, value, from) {
  clearTimeout(typing);
  typing = undefined;
  if (!Number.isFinite(value) || value < param.low || value > param.high) return judge(`${param.name}: expected ${param.low} to ${param.high}${param.unit ? ` ${param.unit}` : ""}`, param);
  if (value === param.value) delete values[param.name]; else values[param.name] = value;
  update(param, from);
  lines(param);
  run();
}

/** Moves the lines of a param in the plots. */
function lines(param) {
  const shown = (scale) => valueOf(param) * param.si * scale;
  view.data.signals.forEach((entry, number) => {
    const own = (entry.thresholds || []).filter((threshold) => threshold[2] === param.name);
    if (!own.length) return;
    for (const threshold of own) {
      threshold[0] = shown(threshold[3]);
      threshold[1] = `${param.name} ${Number(valueOf(param).toPrecision(4))} ${param.unit}`;
    }
    entry.range = undefined;
    panels.filter((panel) => panel.number === number).forEach((panel) => { drawPanel(panel); readOut(panel); });
  });
}

/** Runs the rules with the values of now; while they run, the last values wait. */
async function run() {
  if (asking) { again = true; return; }
  asking = true;
  clearTimeout(later);
  const at = current.at, began = performance.now();
  try {
    const { tracks, colors } = await post(`api/recording/${at}/params`, values);
    if (current.at === at) showTracks(tracks, colors);
    judge();
    say(state, `analyzed in ${Math.round(performance.now() - began)} ms`);
    tell();
  } catch (error) {
    judge(error.message);
  }
  asking = false;
  if (again) { again = false; return run(); }
  if (wrong) return;
  // Explanations and shades follow when the hand rests.
  later = setTimeout(() => { if (current.at === at && !held) open(at); }, 700);
}

place.addEventListener("input", (event) => {
  const param = params.find((one) => one.name === event.target.closest("[data-param]")?.dataset.param);
  if (!param) return;
  if (event.target.type === "range") return set(param, atShare(param, event.target.value / STEPS), event.target);
  // Half a number is another number.
  clearTimeout(typing);
  typing = setTimeout(() => set(param, event.target.valueAsNumber, event.target), PAUSE);
  offer();
});
place.addEventListener("change", (event) => {
  const param = params.find((one) => one.name === event.target.closest("[data-param]")?.dataset.param);
  if (param && typing !== undefined) set(param, event.target.valueAsNumber, event.target);
});
place.addEventListener("click", (event) => {
  if (!event.target.closest(".reset")) return;
  const param = params.find((one) => one.name === event.target.closest("[data-param]").dataset.param);
  set(param, param.value);
});
filter.addEventListener("input", rows);

function reset() {
  clearTimeout(typing);
  typing = undefined;
  const changed = Object.keys(values);
  changed.forEach((name) => delete values[name]);
  // Fields with refused values are drawn again too.
  rows();
  params.filter((param) => changed.includes(param.name)).forEach(lines);
}
byId("reset-params").addEventListener("click", () => { reset(); run(); });
byId("write-params").addEventListener("click", async () => {
  try {
    const { files } = await post(`api/recording/${current.at}/params/save`, {});
    for (const name of Object.keys(values)) delete values[name];
    await open(current.at);
    say(state, `written: ${files.join(", ")}`);
  } catch (error) {
    say(state, error.message, true);
  }
});
byId("reload-rules").addEventListener("click", async () => {
  if (!byId("discard-rules").disabled && !confirm("The changed texts of the rule files are lost. Read the files again?")) return;
  try {
    await post("api/rules", {});
    for (const name of Object.keys(values)) delete values[name];
    await open(current.at);
    judge();
    say(state, "the rule files are read again");
  } catch (error) {
    say(state, error.message, true);
  }
});

// ---- lines in the plots

let held;

/** The threshold with a param that a pointer is on. */
function under(event) {
  const panel = panels.find((one) => one.canvas === event.target);
  if (!panel?.y) return undefined;
  const place = event.clientY - panel.canvas.getBoundingClientRect().top;
  const near = (threshold) => Math.abs(panel.y(threshold[0]) - place);
  const own = (view.data.signals[panel.number].thresholds || []).filter((threshold) => params.some((param) => param.name === threshold[2]));
  const threshold = own.filter((one) => near(one) < 6).sort((a, b) => near(a) - near(b))[0];
  return threshold && { panel, threshold, param: params.find((param) => param.name === threshold[2]) };
}

signals.addEventListener("pointerdown", (event) => {
  const found = event.button === 0 && under(event);
  if (!found) return;
  // The scale stays while a line is moved in it.
  held = { ...found, valueAt: found.panel.valueAt };
  signals.setPointerCapture(event.pointerId);
  event.stopPropagation();
  event.preventDefault();
}, { capture: true });
signals.addEventListener("pointermove", (event) => {
  if (!held) {
    const canvas = event.target.closest?.("canvas");
    if (canvas) canvas.style.cursor = under(event) ? "ns-resize" : "";
    return;
  }
  event.stopPropagation();
  const { panel, threshold, param, valueAt } = held;
  const shown = valueAt(event.clientY - panel.canvas.getBoundingClientRect().top);
  set(param, rounded(param, shown / threshold[3] / param.si));
}, { capture: true });
for (const kind of ["pointerup", "pointercancel"]) signals.addEventListener(kind, (event) => {
  if (!held) return;
  held = undefined;
  event.stopPropagation();
  draw();
  run();
}, { capture: true });

/** Turns several params at once. */
export function takeValues(next) {
  for (const param of params.filter(({ name }) => name in next)) {
    if (next[param.name] === param.value) delete values[param.name]; else values[param.name] = next[param.name];
    update(param);
    lines(param);
  }
  byId("tune").open = true;
  return run();
}

/** The params of rules that were changed in the editor. */
export function takeParams(next) {
  params = next;
  if (!place.contains(document.activeElement)) rows();
  byId("tune").hidden = !params.length;
}

onOpen((answer) => takeParams(answer.params));
