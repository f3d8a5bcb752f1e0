// Videos beside the lanes, at the time of the cursor.

import { added, escaped, state, view } from "./bench.js";
import { current, onOpen } from "./recording.js";

/** How far a video that plays may be from the cursor, s: less would make it stutter. */
const APART = 0.12;
const place = document.getElementById("videos");
let videos = [], shown;

onOpen((answer, again) => {
  if (again && shown === JSON.stringify(answer.videos)) return;
  shown = JSON.stringify(answer.videos);
  place.hidden = !answer.videos.length;
  place.innerHTML = answer.videos.map(({ camera }, at) => `<figure><video muted playsinline preload="auto" src="video/${current.at}/${at}" aria-label="${escaped(camera)}"></video><figcaption>${escaped(camera)}</figcaption></figure>`).join("");
  videos = [...place.querySelectorAll("video")].map((element, at) => ({ element, offset: answer.videos[at].offset }));
  for (const { element } of videos) {
    element.addEventListener("error", () => { element.nextElementSibling.textContent += ": this browser cannot play the file"; });
    element.addEventListener("loadedmetadata", () => follow(state.cursor));
  }
});

function follow(time) {
  for (const { element, offset } of videos) {
    if (!(element.readyState >= 1)) continue;
    const at = Math.min(element.duration || 0, Math.max(0, time + offset));
    if (view.playing) {
      element.playbackRate = Number(document.getElementById("speed").value);
      if (element.paused) element.play().catch(() => {});
      if (Math.abs(element.currentTime - at) > APART) element.currentTime = at;
    } else {
      if (!element.paused) element.pause();
      if (Math.abs(element.currentTime - at) > 1e-3) element.currentTime = at;
    }
  }
}
added.moved.push(follow);
