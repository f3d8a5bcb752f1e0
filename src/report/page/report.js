// The page of one recording: its data are in the page, and the moment that is looked at is in the address.

/** A table with more rows shows so many at a time, those that hold a text that is looked for. */
const ROWS = 60;
const whole = [];

function eachTable(place) {
  for (const table of place.querySelectorAll("table")) {
    const rows = [...table.rows].slice(1);
    if (rows.length <= ROWS || table.closest("#work") || whole.some((one) => one.table === table)) continue;
    const bar = document.createElement("p");
    bar.className = "quiet filter";
    bar.innerHTML = `<label>rows with <input type="search" size="16"></label> <span role="status"></span> <button type="button">more rows</button>`;
    const [input, count, more] = ["input", "span", "button"].map((name) => bar.querySelector(name));
    const texts = rows.map((row) => row.textContent.toLowerCase());
    let most = ROWS;
    const draw = () => {
      const found = rows.filter((_, at) => texts[at].includes(input.value.toLowerCase()));
      rows.forEach((row) => row.remove());
      table.tBodies[0].append(...found.slice(0, most));
      count.textContent = `${Math.min(most, found.length)} of ${found.length}`;
      more.hidden = found.length <= most;
    };
    input.addEventListener("input", () => { most = ROWS; draw(); });
    more.addEventListener("click", () => { most += 5 * ROWS; draw(); });
    table.closest(".scroll").before(bar);
    whole.push({ table, all: () => { most = rows.length; draw(); } });
    draw();
  }
}

const showAllRows = () => whole.forEach((one) => one.all());

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

// What nobody looks at is not laid out: the drawings come into the page when they are opened or printed, long tables a part at a time.
const drawings = byId("drawings"), folded = document.createDocumentFragment();
const unfold = () => { drawings.append(folded); eachTable(drawings); };
drawings.removeAttribute("open");
folded.append(...[...drawings.childNodes].filter((node) => node.nodeName !== "SUMMARY"));
drawings.addEventListener("toggle", () => { if (drawings.open) unfold(); });
addEventListener("beforeprint", () => { unfold(); showAllRows(); });
eachTable(document);
added.moved.push(() => { if (!state.playing) remember(); });
load(JSON.parse(byId("data").textContent));
addEventListener("hashchange", recall);
recall();
