// The page of one recording: its data are in the page, and the displayed time is in the address.

let later;

function remember() {
  clearTimeout(later);
  later = setTimeout(() => {
    const number = (time) => String(Number(time.toFixed(3)));
    const address = `#t=${number(state.cursor)}&from=${number(state.from)}&to=${number(state.to)}`;
    try { history.replaceState(null, "", address); } catch { /* some browsers forbid it on files */ }
  }, 400);
}

function recall() {
  const given = new URLSearchParams(location.hash.slice(1));
  const number = (name, other) => given.has(name) && Number.isFinite(Number(given.get(name))) ? Number(given.get(name)) : other;
  show(number("from", data.start), number("to", data.end));
  setTime(number("t", data.start), false);
}

// Hidden content is not laid out: folded drawings are added to the page when they are opened or printed, long tables in parts.
const drawings = byId("drawings");
if (drawings.matches("details")) {
  const folded = document.createDocumentFragment();
  const unfold = () => { drawings.append(folded); eachTable(drawings); };
  let wasOpen = false;
  drawings.removeAttribute("open");
  folded.append(...[...drawings.childNodes].filter((node) => node.nodeName !== "SUMMARY"));
  drawings.addEventListener("toggle", () => { if (drawings.open) unfold(); });
  addEventListener("beforeprint", () => { wasOpen = drawings.open; unfold(); drawings.setAttribute("open", ""); });
  addEventListener("afterprint", () => { if (!wasOpen) drawings.removeAttribute("open"); });
}
eachTable(document);
addEventListener("beforeprint", () => long.forEach((one) => one.draw(true)));
addEventListener("afterprint", () => long.forEach((one) => one.draw()));
added.moved.push(() => { if (!state.playing) remember(); });
load(JSON.parse(byId("data").textContent));
addEventListener("hashchange", recall);
recall();
