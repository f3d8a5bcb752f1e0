// The page begins here: the list is asked for again and again while it fills, and keys lead through it.

import * as list from "./list.js";
import { current, open } from "./recording.js";
import { get, tell } from "./server.js";

let revision = 0, gone = false;

async function refresh() {
  try {
    const next = await get(`api/list?since=${revision}`);
    if (gone) tell();
    gone = false;
    if (next.recordings) {
      revision = next.revision;
      list.take(next);
    }
    return next.waiting ? 400 : 1500;
  } catch (error) {
    gone = gone || Boolean(error.gone);
    tell(error.message);
    return 3000;
  }
}

async function choose(at) {
  if (at === undefined) return;
  list.mark(at);
  history.replaceState(null, "", `#${encodeURIComponent(list.nameOf(at))}`);
  await open(at);
}

list.listen(choose);

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("input, select, textarea")) return;
  const by = { j: 1, k: -1 }[event.key];
  if (!by) return;
  event.preventDefault();
  choose(list.beside(by));
});

async function follow() {
  const wait = await refresh();
  setTimeout(follow, document.hidden ? 4 * wait : wait);
}

await follow();
const asked = decodeURIComponent(location.hash.slice(1));
for (let at = 0; list.nameOf(at) !== undefined; at++) if (asked && list.nameOf(at) === asked) choose(at);
if (current.at === undefined && list.nameOf(1) === undefined) choose(0);
