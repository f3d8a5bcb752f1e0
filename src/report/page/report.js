// The page of one recording: its data are in the page, and the moment that is looked at is in the address.

/** A table with more rows shows so many at a time, of those that have a text that is looked for. */
const ROWS = 60;
const long = [];

function eachTable(place) {
  for (const table of place.querySelectorAll("table")) {
    const rows = [...table.rows].slice(1), frame = table.closest(".scroll");
    if (rows.length <= ROWS || !frame || long.some((one) => one.table === table)) continue;
    const title = frame.getAttribute("aria-label"), bar = document.createElement("p");
    bar.className = "quiet filter";
    bar.innerHTML = `<label>rows with <input type="search" size="16"></label> <span role="status"></span> <button type="button">more rows</button>`;
    const [input, count, more] = ["input", "span", "button"].map((name) => bar.querySelector(name));
    input.ariaLabel = `${title}: rows with`;
    more.ariaLabel = `more rows of ${title}`;
    const texts = rows.map((row) => row.textContent.toLowerCase());
    let most = ROWS;
    const draw = (all = false) => {
      const found = all ? rows : rows.filter((_, at) => texts[at].includes(input.value.toLowerCase()));
      const shown = all ? rows : found.slice(0, most);
      rows.forEach((row) => row.remove());
      table.tBodies[0].append(...shown);
      count.textContent = `${shown.length} of ${found.length} rows${found.length < rows.length ? ` (${rows.length} in all)` : ""}`;
      more.hidden = shown.length === found.length;
    };
    input.addEventListener("input", () => { most = ROWS; draw(); });
    more.addEventListener("click", () => { most += 5 * ROWS; draw(); if (more.hidden) input.focus(); });
    frame.before(bar);
    long.push({ table, draw });
    draw();
  }
}

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

// What nobody looks at is not laid out: drawings that are folded away come into the page when they are opened or printed, long tables a part at a time.
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
