// The open recording: its data from the server, drawn by the scripts of the report.

import { escaped, load, nameOf, panels, seconds, setTime, show, state, view } from "./bench.js";
import { get, tell } from "./server.js";

const byId = (id) => document.getElementById(id);

/** The open recording: its number, the answer of the server, and the number of pending answers. */
export const current = { at: undefined, answer: undefined, awaited: 0 };

const listeners = [];

/** Calls `opened` with the answer of the server for each opened recording, and whether it was open before. */
export const onOpen = (opened) => listeners.push(opened);

/** Opens a recording; if it is open already, the displayed time stays. */
export async function open(at, to = {}) {
  const again = current.at === at && current.answer;
  current.at = at;
  byId("main").setAttribute("aria-busy", "true");
  current.awaited++;
  let answer;
  try {
    answer = await get(`api/recording/${at}`);
  } catch (error) {
    if (current.at === at) tell(error.message);
    return;
  } finally {
    current.awaited--;
    if (current.at === at) byId("main").removeAttribute("aria-busy");
  }
  // Another one may have been requested in the meantime.
  if (current.at !== at) return;
  tell(answer.failed ? `The rules do not run here: ${answer.failed}` : "");
  const { from, to: until, cursor } = state;
  const titles = view.data ? panels.map((panel) => nameOf(view.data.signals[panel.number])) : [];
  current.answer = answer;
  const { data } = answer;
  byId("title").textContent = answer.name;
  byId("facts").textContent = `${seconds(data.end - data.start)} at ${Number(data.rate.toPrecision(4))} Hz; rules ${answer.rules.join(", ")}`;
  const issues = byId("issues"), count = data.issues.length;
  issues.hidden = !count;
  issues.querySelector("summary").textContent = `${count} issue${count === 1 ? "" : "s"} of the recording`;
  issues.querySelector("ul").innerHTML = data.issues.map(([start, end, kind, channel, message]) => `<li>${escaped(`${kind} ${channel}: ${message}`)} <span class="quiet">${start.toFixed(3)} – ${seconds(end)}</span></li>`).join("");
  document.title = `${answer.name} – teachtree studio`;
  load(data, titles);
  listeners.forEach((opened) => opened(answer, Boolean(again)));
  if (again) {
    show(from, until);
    setTime(cursor, false);
  } else {
    show(data.start, data.end);
    setTime(to.time ?? data.start);
  }
}
