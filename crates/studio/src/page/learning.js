// A new primitive: a person marks its times in some recordings, and the studio learns rules for it, in the background.

import { escaped, seconds, state, view } from "./bench.js";
import { mark } from "./labels.js";
import * as list from "./list.js";
import { current, onOpen, open } from "./recording.js";
import { get, post, say } from "./server.js";

/** Recordings with marks that are needed. */
const LEAST = 3;
const byId = (id) => document.getElementById(id);
const name = byId("new-name"), track = byId("new-track"), marks = byId("new-marks"), status = byId("learn-state"), part = byId("learn-part");
const rules = byId("learn-rules"), summary = byId("learn-summary"), questions = byId("learn-questions"), file = byId("learn-file");
let start, outcome;

/** The name of the primitive: `Shake` of `Shake is Translate`. */
const primitive = () => name.value.trim().split(/\s/)[0].replace("(side)", "");

/** Says what is marked, and what is missing. */
function tellMarks() {
  const count = primitive() ? list.withLabel(primitive()) : 0;
  const begun = start === undefined ? "" : `; starts at ${seconds(start)}`;
  const next = count < LEAST ? `mark it in ${LEAST} recordings or more` : "ready to learn";
  say(marks, primitive() ? `${primitive()} is marked in ${count} recording${count === 1 ? "" : "s"}, ${next}${begun}` : "Name the primitive, and mark when it takes place.");
  byId("begin-learn").disabled = count < LEAST;
  byId("new-end").disabled = start === undefined;
}

function draw({ running, part: share, outcome: next }) {
  part.hidden = !running;
  part.value = share;
  name.disabled = running;
  outcome = running ? undefined : next;
  const text = running ? `learning, ${Math.round(share * 100)} %` : outcome?.error ?? "";
  say(status, text, Boolean(outcome?.error));
  byId("learned").hidden = !outcome?.rules;
  if (running) byId("begin-learn").disabled = true;
  if (!outcome?.rules) return;
  rules.textContent = outcome.rules;
  summary.textContent = outcome.summary;
  file.value ||= `${outcome.primitive.replace(/(?<=.)([A-Z])/g, "_$1").toLowerCase()}.rules`;
  questions.innerHTML = outcome.questions.map((one, at) => `<li><button type="button" data-question="${at}">${escaped(one.name)} ${one.track}, ${one.start.toFixed(3)} – ${seconds(one.end)}: ${one.state} <span class="quiet">${Math.round(one.agreement * 100)} % of the other guards agree</span></button></li>`).join("");
  byId("learn-asks").hidden = !outcome.questions.length;
}

async function follow() {
  try {
    const answer = await get("api/learn");
    draw(answer);
    if (answer.running) setTimeout(follow, 300);
    else tellMarks();
  } catch (error) {
    say(status, error.message, true);
    setTimeout(follow, 3000);
  }
}

byId("new-start").addEventListener("click", () => {
  start = state.cursor;
  tellMarks();
});
byId("new-end").addEventListener("click", () => {
  const end = state.cursor;
  if (!primitive()) return say(marks, "Name the primitive first.", true);
  if (end <= start) return say(marks, `The end must be after the start, ${seconds(start)}.`, true);
  mark(Number(track.value), primitive(), start, end);
  start = undefined;
  tellMarks();
});
name.addEventListener("input", tellMarks);
byId("begin-learn").addEventListener("click", async () => {
  file.value = "";
  draw(await post(`api/recording/${current.at}/learn`, { primitive: name.value.trim() }).catch((error) => ({ running: false, part: 0, outcome: { error: error.message } })));
  if (!outcome?.error) follow();
});
byId("save-learned").addEventListener("click", async () => {
  try {
    say(status, `written to ${(await post(`api/recording/${current.at}/learn/save`, { file: file.value.trim() })).file}`);
  } catch (error) {
    say(status, error.message, true);
  }
});
questions.addEventListener("click", (event) => {
  const one = outcome?.questions[event.target.closest("[data-question]")?.dataset.question];
  if (!one) return;
  list.mark(one.at);
  open(one.at, { time: one.start });
});

onOpen((_answer, again) => {
  byId("new-primitive").hidden = false;
  if (again) return;
  start = undefined;
  track.replaceChildren(...view.data.tracks.map(({ who }, number) => new Option(who, number)));
  tellMarks();
});
list.onTake(tellMarks);
follow();
