// The page of one recording: its data are in the page, and the moment that is looked at is in the address.

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

byId("drawings").removeAttribute("open");
added.moved.push(() => { if (!state.playing) remember(); });
load(JSON.parse(byId("data").textContent));
addEventListener("hashchange", recall);
recall();
