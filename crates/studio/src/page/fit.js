// Fitting params to the labels of all recordings: it runs in the background, can be stopped, and its values are taken or not.

import { escaped } from "./bench.js";
import { current } from "./recording.js";
import { get, post } from "./server.js";
import { takeValues } from "./tune.js";

const byId = (id) => document.getElementById(id);
const place = byId("fit"), status = byId("fit-state"), part = byId("fit-part"), text = byId("fit-text"), diff = byId("fit-diff");
let outcome;

function draw({ running, part: share, outcome: next }) {
  place.hidden = !running && !next;
  byId("begin-fit").disabled = running;
  part.hidden = byId("stop-fit").hidden = !running;
  part.value = share;
  outcome = running ? undefined : next;
  byId("close-fit").hidden = running;
  byId("take-fit").hidden = !outcome || !Object.keys(outcome.values ?? {}).length;
  text.hidden = !outcome?.text;
  diff.hidden = !outcome?.diff;
  text.textContent = outcome?.text ?? "";
  diff.innerHTML = (outcome?.diff ?? "").split("\n").map((line) => line[0] === "+" || line[0] === "-" ? `<span class="${line[0] === "+" ? "new" : "old"}">${escaped(line)}</span>` : escaped(line)).join("\n");
  status.textContent = running ? `${Math.round(share * 100)} %` : outcome?.error ?? "";
}

async function follow() {
  try {
    const answer = await get("api/fit");
    draw(answer);
    if (answer.running) setTimeout(follow, 300);
  } catch (error) {
    status.textContent = error.message;
    setTimeout(follow, 3000);
  }
}

byId("begin-fit").addEventListener("click", async () => {
  place.hidden = false;
  place.scrollIntoView({ block: "nearest" });
  draw(await post(`api/recording/${current.at}/fit`, {}).catch((error) => ({ running: false, part: 0, outcome: { error: error.message } })));
  follow();
});
byId("stop-fit").addEventListener("click", () => post("api/fit/stop", {}).catch(() => {}));
byId("close-fit").addEventListener("click", () => { place.hidden = true; });
byId("take-fit").addEventListener("click", async () => {
  await takeValues(outcome.values);
  status.textContent = "taken; Write to files keeps them";
});
// A fit continues while the page is reloaded.
follow();
