// The entry point of the page: it polls the list while it fills, and handles keys.

import { tellDifferences } from "./against.js";
import "./ask.js";
import { followRules } from "./editor.js";
import "./fit.js";
import { follow as followLabels } from "./labels.js";
import "./learning.js";
import * as list from "./list.js";
import { current, open } from "./recording.js";
import { get, say, tell } from "./server.js";
import "./tune.js";
import "./video.js";

let revision = 0, gone = false, latest;

async function refresh() {
  try {
    const next = await get(`api/list?since=${revision}`);
    if (gone) tell();
    gone = false;
    if (next.recordings) {
      revision = next.revision;
      list.take(next);
      latest = next;
      agreement(next);
      tellDifferences();
      followRules(next.edit_version);
      followLabels(list.rowOf(current.at)?.label_version);
    }
    return next.waiting ? 400 : 1500;
  } catch (error) {
    gone = gone || Boolean(error.gone);
    tell(error.message);
    return 3000;
  }
}

const percent = (share) => `${(share * 100).toFixed(1)} %`;

/** How well the rules agree with a score's labels, and how well they did before params were turned. */
function words(score, base) {
  const share = (key) => {
    const was = base && base[key] !== null && Math.abs(base[key] - score[key]) > 5e-4 ? ` (was ${percent(base[key])})` : "";
    return `${percent(score[key])}${was}`;
  };
  const segments = score.f1 === null ? "" : `segment F1 ${share("f1")} at 50 % overlap; `;
  const tasks = score.tasks ? `; ${score.tasks_right} of ${score.tasks} tasks correct` : "";
  return `${segments}${share("accuracy")} of ${score.scored_s.toFixed(1)} s correct${tasks}`;
}

/** The line that says how well rules and labels agree: here, and over all recordings with labels. */
function agreement(next) {
  const place = document.getElementById("agreement"), row = list.rowOf(current.at), parts = [];
  if (row?.score && row.score.accuracy !== null) parts.push(`Agreement with labels (this recording): ${words(row.score, row.base)}`);
  if (next.labeled > 1 && next.score.accuracy !== null) {
    const changed = next.better || next.worse ? `; ${next.better} better, ${next.worse} worse` : "";
    parts.push(`${parts.length ? "" : "Agreement with labels "}(${next.labeled} recordings): ${words(next.score, next.base)}${changed}`);
  }
  if (row?.new?.length) parts.push(`labels of ${row.new.join(", ")} are not scored: the rules do not have it`);
  const wrong = row?.score_error;
  say(place, wrong || parts.join(" ") || "No labels to compare with yet", Boolean(wrong));
  place.hidden = current.at === undefined;
}

async function choose(at) {
  // A second answer about a recording that is being opened would replace labels that were changed in the meantime.
  if (at === undefined || at === current.at && current.awaited) return;
  list.mark(at);
  history.replaceState(null, "", `#${encodeURIComponent(list.nameOf(at))}`);
  await open(at);
  if (latest) agreement(latest);
  tellDifferences();
}

list.listen(choose);

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("input, select, textarea")) return;
  const go = { j: () => choose(list.beside(1)), k: () => choose(list.beside(-1)), r: list.goTo, "/": list.goToFilter }[event.key];
  if (!go) return;
  event.preventDefault();
  go();
});

/** Opens the recording that the address names, else the first one that needs attention, until one is open. */
function begin() {
  if (current.at !== undefined) return;
  const asked = decodeURIComponent(location.hash.slice(1));
  for (let at = 0; asked && list.nameOf(at) !== undefined; at++) if (list.nameOf(at) === asked) return choose(at);
  choose(list.firstToOpen());
}

async function follow() {
  const wait = await refresh();
  begin();
  setTimeout(follow, document.hidden ? 4 * wait : wait);
}

await follow();
