// Long tables of a page: a part of the rows at a time, and a text that is looked for.

/** Maximum number of rows that a table shows at a time, of those that contain the searched text. */
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
