// The list of recordings: the results of each, filters, and the open one.

import { escaped } from "./bench.js";

/** More rows than these make a page slow; filters find the others. */
const MOST = 400;

const byId = (id) => document.getElementById(id);
const place = byId("recordings");
const filters = { text: byId("filter-text"), task: byId("filter-task"), outcome: byId("filter-outcome"), issue: byId("filter-issue"), sort: byId("sort") };

let list = { recordings: [], waiting: 0 };
let opened;
let choose = () => {};
const takers = [];

/** Calls `taken` after each answer of the server. */
export const onTake = (taken) => takers.push(taken);

/** The number of recordings with a label of a primitive that the rules do not have. */
export const withLabel = (name) => list.recordings.filter((one) => one.new?.includes(name)).length;

/** Calls `open` with the number of a recording that was chosen. */
export function listen(open) {
  choose = open;
  place.addEventListener("click", (event) => {
    const row = event.target.closest("[data-at]");
    if (row) choose(Number(row.dataset.at));
  });
  for (const filter of Object.values(filters)) filter.addEventListener("input", draw);
  place.addEventListener("keydown", (event) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key], rows = [...place.querySelectorAll("[data-at]")];
    if (!by || event.ctrlKey || event.altKey || event.metaKey) return;
    rows[rows.indexOf(document.activeElement) + by]?.focus();
    event.preventDefault();
  });
  filters.text.addEventListener("keydown", (event) => {
    if (event.key !== "ArrowDown" && event.key !== "Enter") return;
    place.querySelector("[data-at]")?.focus();
    event.preventDefault();
  });
}

/** Takes the answer of the server. */
export function take(next) {
  list = next;
  fill(filters.task, "any task", list.recordings.flatMap((one) => (one.tasks || []).map(([, task]) => task.split(" ")[0])));
  fill(filters.issue, "any issues", list.recordings.flatMap((one) => one.issues || []), [["!", "with an issue"], ["-", "without issues"]]);
  offerOrder();
  draw();
  takers.forEach((taken) => taken());
}

const isNumber = (value) => typeof value === "number";

/** Recordings that are analyzed before one of them is chosen. */
const ENOUGH = 20;
/** What draws attention to a recording, the most urgent first; the last ones hold for any that is analyzed, and for any. */
const NEEDS_ATTENTION = [
  (one) => one.outcome === "failure",
  (one) => isNumber(one.score?.f1) && one.score.f1 < 1 || one.against?.frames > 0,
  (one) => one.issue_count > 0,
  (one) => one.tasks,
  () => true,
];

/** The first recording that needs attention: a failure, else a disagreement, else an issue. `undefined` until enough recordings are analyzed. */
export function firstToOpen() {
  const { recordings, waiting } = list, analyzed = recordings.length - waiting;
  if (recordings.length > 1 && waiting && analyzed < ENOUGH) return undefined;
  return NEEDS_ATTENTION.map((needs) => recordings.findIndex(needs)).find((at) => at >= 0);
}

export const nameOf = (at) => list.recordings[at]?.name;
export const rowOf = (at) => list.recordings[at];

/** Marks the recording that is open. */
export function mark(at) {
  const isInList = place.contains(document.activeElement);
  opened = at;
  draw();
  const row = place.querySelector("[aria-current]");
  row?.scrollIntoView({ block: "nearest" });
  if (isInList) row?.focus({ preventScroll: true });
}

/** Takes the focus to the recording that is open, else to the first one. */
export function goTo() {
  (place.querySelector("[aria-current]") || place.querySelector("[data-at]"))?.focus();
}

export const goToFilter = () => filters.text.focus();

/** The recording `by` places after the one that is open, among those that are shown. */
export function beside(by) {
  const shown = matching(), at = shown.indexOf(opened);
  return at < 0 ? shown[by > 0 ? 0 : shown.length - 1] : shown[at + by];
}

/** The order by differences is offered where there are other rules. */
function offerOrder() {
  const option = filters.sort.querySelector("[value=against]");
  option.hidden = option.disabled = !list.recordings.some((one) => one.against);
}

function fill(select, first, names, more = []) {
  const value = select.value, all = [...new Set(names)].sort();
  select.innerHTML = [["", first], ...more, ...all.map((name) => [name, name])].map(([key, name]) => `<option value="${escaped(key)}">${escaped(name)}</option>`).join("");
  select.value = [...select.options].some((option) => option.value === value) ? value : "";
}

function matching() {
  const text = filters.text.value.trim().toLowerCase(), task = filters.task.value, issue = filters.issue.value;
  const at = list.recordings.map((_, number) => number).filter((number) => {
    const one = list.recordings[number], tasks = (one.tasks || []).map(([who, name]) => `${who} ${name}`);
    if (text && ![one.name, ...tasks].some((name) => name.toLowerCase().includes(text))) return false;
    if (task && !(one.tasks || []).some(([, name]) => name.split(" ")[0] === task)) return false;
    if (filters.outcome.value && one.outcome !== filters.outcome.value) return false;
    if (issue === "!") return one.issue_count > 0 || one.error;
    if (issue === "-") return !one.issue_count && !one.error;
    return !issue || (one.issues || []).includes(issue);
  });
  const key = { stability: (one) => one.stability, score: (one) => one.score && one.score.accuracy, against: (one) => one.against && -one.against.frames / (one.against.of_frames || 1) }[filters.sort.value];
  if (!key) return at;
  const of = (number) => key(list.recordings[number]) ?? Infinity;
  return at.sort((a, b) => of(a) - of(b) || a - b);
}

const percent = (share) => `${Math.round(share * 100)} %`;
/** A stability: no variation shows that a result is certain. */
const stabilityText = (share) => share >= 0.995 ? "&gt; 99 %" : percent(share);

/** What changed against labels since params were turned, in words. */
function change(one) {
  if (!one.score || !one.base) return "";
  const by = Math.round((one.score.accuracy - one.base.accuracy) * 1000) / 10;
  if (!by) return "";
  return `<span class="${by > 0 ? "yes" : "no"}">${by > 0 ? "▲" : "▼"} ${Math.abs(by)}</span>`;
}

function row(number) {
  const one = list.recordings[number];
  const facts = [];
  if (one.status === "waiting") facts.push("waiting");
  if (one.error) facts.push(`<span class="no">cannot be analyzed</span>`);
  if (one.tasks) {
    const tasks = one.tasks.map(([who, name]) => escaped(list.hands > 1 && who ? `${who}: ${name}` : name));
    facts.push(tasks.length ? tasks.join(", ") : "no task");
  }
  const numbers = [];
  if (one.outcome) numbers.push(`<span class="outcome ${one.outcome}" title="whether the recording is a success">${one.outcome}</span>`);
  if (one.stability !== null && one.stability !== undefined) numbers.push(`<span title="the share of variations of params and log that have the least stable task">stable in ${stabilityText(one.stability)}</span>`);
  if (one.issue_count) numbers.push(`<span title="of the recording; they are listed when it is open">${one.issue_count} issue${one.issue_count > 1 ? "s" : ""}: ${escaped((one.issues || []).join(", "))}</span>`);
  if (one.labels) numbers.push(`<span title="labels that a person set">${one.labels} pinned</span>`);
  if (isNumber(one.score?.f1)) numbers.push(`<span title="agreement with the label file: F1 of the segments at 50 % overlap; ${percent(one.score.accuracy)} of the time has its label">F1 ${percent(one.score.f1)}</span> ${change(one)}`);
  if (one.against?.error) numbers.push(`<span class="no" title="${escaped(one.against.error)}">other rules do not run</span>`);
  else if (one.against) {
    const { frames, segments, own, accuracy } = one.against, by = own !== null && accuracy !== null ? Math.round((own - accuracy) * 1000) / 10 : 0;
    const better = by > 0 ? ", agrees better here" : by < 0 ? ", agrees better there" : "";
    numbers.push(`<span title="frames and segments that differ from the other rules">${frames ? `${frames} frame${frames > 1 ? "s" : ""}, ${segments} segment${segments === 1 ? "" : "s"} differ${better}` : "no difference"}</span>`);
  }
  if (one.score_error) numbers.push(`<span class="no" title="${escaped(one.score_error)}">labels unreadable</span>`);
  const current = number === opened ? ` aria-current="true"` : "";
  return `<li><button type="button" data-at="${number}"${current}${one.error ? ` title="${escaped(one.error)}"` : ""}><b>${escaped(one.name)}</b><span class="found">${facts.join(" ")}</span><span class="numbers quiet">${numbers.join(" · ")}</span></button></li>`;
}

/** The row of the recording that is open, if all of it is in view. */
function seen() {
  const row = place.querySelector("[aria-current]"), [of, all] = [row, place].map((one) => one?.getBoundingClientRect());
  return row && of.top >= all.top - 1 && of.bottom <= all.bottom + 1;
}

function draw() {
  const shown = matching(), focused = document.activeElement?.dataset?.at, wasSeen = seen();
  place.innerHTML = shown.slice(0, MOST).map(row).join("") + (shown.length > MOST ? `<li class="quiet">… ${shown.length - MOST} more; filters find them</li>` : "");
  if (focused !== undefined) place.querySelector(`[data-at="${focused}"]`)?.focus({ preventScroll: true });
  // Rows grow when results arrive.
  if (wasSeen) place.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
  const all = list.recordings.length, done = all - list.waiting;
  const count = shown.length === all ? `${all} recording${all === 1 ? "" : "s"}` : `${shown.length} of ${all} recordings`;
  byId("progress").textContent = list.waiting ? `${count}, ${done} analyzed` : count;
}
