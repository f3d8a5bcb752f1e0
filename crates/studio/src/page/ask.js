// Asking at the time cursor: why a track has its label, and why not another one.

import { seconds, state, view } from "./bench.js";
import { current, onOpen } from "./recording.js";
import { get } from "./server.js";

const byId = (id) => document.getElementById(id);
const track = byId("ask-track"), other = byId("ask-other"), answer = byId("ask-answer");

byId("ask").addEventListener("submit", async (event) => {
  event.preventDefault();
  const time = state.cursor, query = new URLSearchParams({ t: String(time), track: track.value, why_not: other.value });
  try {
    answer.textContent = (await get(`api/recording/${current.at}/explain?${query}`)).text;
  } catch (error) {
    answer.textContent = error.message;
  }
  answer.hidden = false;
  byId("ask-time").textContent = seconds(time);
});

onOpen(({ names }, again) => {
  if (again) return;
  track.replaceChildren(...view.data.tracks.map(({ who }) => new Option(who)));
  other.replaceChildren(new Option("…", ""), ...names.primitive.map((name) => new Option(name)));
  answer.hidden = true;
  byId("ask-time").textContent = "";
});
