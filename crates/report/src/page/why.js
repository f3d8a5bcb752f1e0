// What is said of a boundary, a segment or a task: explanations as `changes.rs` writes them, as HTML.

const chip = (name) => `<span class="chip" style="background:${data.colors[name] || "#c8cdd4"}">${escaped(name)}</span>`;
const verdict = (holds) => holds ? `<span class="yes">yes</span>` : `<span class="no">no</span>`;

/** What was measured: value, threshold and margin, or words. */
function factHtml(fact) {
  if (fact.length === 3) return `<b>${escaped(fact[0])}</b> <span class="quiet">${escaped(fact[1])}${fact[2] ? `, ${escaped(fact[2])}` : ""}</span>`;
  return fact.length ? `<span class="quiet">${escaped(fact[0])}</span>` : "";
}

function reasonHtml(number, depth = 0) {
  const [holds, condition, slot, fact, below] = data.reasons[number];
  const name = `${data.texts[slot] ? `${escaped(data.texts[slot])}: ` : ""}<code>${escaped(data.texts[condition])}</code>`;
  const head = `${verdict(holds)} ${name} ${factHtml(fact)}`;
  if (!below.length) return `<li>${head}</li>`;
  return `<li><details${depth < 2 ? " open" : ""}><summary>${head}</summary><ul>${below.map((one) => reasonHtml(one, depth + 1)).join("")}</ul></details></li>`;
}

function pathHtml(path, decided) {
  const steps = path.map(([depth, taken, choice, place, reason]) => {
    const fact = reason === null ? "" : factHtml(data.reasons[reason][3]);
    const below = reason === null ? [] : data.reasons[reason][4];
    const head = `${verdict(taken)} <code>${escaped(data.texts[choice])}</code> ${fact} <small class="quiet">${escaped(data.texts[place])}</small>`;
    const deciding = decided && decided.place === data.texts[place];
    const inside = below.length ? `<details${deciding ? " open" : ""}><summary>${head}</summary><ul>${below.map((one) => reasonHtml(one)).join("")}</ul></details>` : `<div class="plain">${head}</div>`;
    return `<li style="margin-left:${depth * 14}px"${deciding ? ` class="deciding"` : ""}>${inside}</li>`;
  });
  return `<ol class="path">${steps.join("")}</ol>`;
}

function changedRows([condition, slot, before, after, below], depth = 0, name = "") {
  const own = `${name}${slot ? `${escaped(slot)}: ` : ""}<code>${escaped(data.texts[condition])}</code>`;
  const plain = !before[1].length && !after[1].length;
  // A name is on one line with its definition.
  if (plain && /^[\w.[\]]+$/.test(data.texts[condition]) && below.length === 1 && !below[0][1] && below[0][2][0] === before[0]) return changedRows(below[0], depth, `${own} = `);
  const cell = ([holds, fact]) => `<td>${verdict(holds)} ${factHtml(fact)}</td>`;
  const row = `<tr${below.length ? "" : ` class="tipped"`}><td style="padding-left:${depth * 9 + 6}px">${own}</td>${cell(before)}${cell(after)}</tr>`;
  return row + below.map((one) => changedRows(one, depth + 1)).join("");
}

function changeHtml(change, who) {
  const { before, after, decided } = change;
  let html = "";
  if (decided) {
    html += `<p>By the tree <code>${escaped(after.tree)}</code>: <code>${escaped(decided.choice)}</code> ${decided.taken ? "is taken now" : "is no longer taken"}. <small class="quiet">${escaped(decided.place)}</small></p>`;
    if (decided.changed.length) {
      html += `<h4>What changed</h4><div class="scroll" tabindex="0" role="region" aria-label="What changed"><table class="changed"><tr><th>condition</th><th>at ${seconds(before.time)}</th><th>at ${seconds(after.time)}</th></tr>${decided.changed.map((one) => changedRows(one)).join("")}</table></div>`;
    }
  } else if (before) {
    html += `<p>The tree of ${who === "both" ? "both hands" : `the ${escaped(who)} hand`} takes the same way on both sides.</p>`;
  } else {
    html += `<p>The recording begins here, or continues after a gap.</p>`;
  }
  html += `<h4>The way through the tree ${escaped(after.tree)} at ${seconds(after.time)}, to ${escaped(after.leaf)}</h4>${pathHtml(after.path, decided)}`;
  if (after.latches.length) html += `<p class="quiet">Latches: ${after.latches.map(escaped).join("; ")}</p>`;
  for (const [word, became] of [["settled", after.settled], ["relabeled", after.relabeled]]) {
    if (!became) continue;
    html += `<p>${word}: ${chip(became.primitive)}${became.was.length ? ` was ${became.was.map(chip).join(" ")}` : ""}</p><ul>${became.by.map(([what, place]) => `<li><code>${escaped(what)}</code> <small class="quiet">${escaped(place)}</small></li>`).join("")}</ul>`;
  }
  return html;
}

function cutHtml(number, at) {
  const track = data.tracks[number], change = track.changes[at], start = track.raw[at][1];
  if (!change || !change.after.path.length) return `<p>This page does not explain this boundary. <code>teachtree explain LOG --at ${start.toFixed(3)}s --track ${escaped(track.who)}</code> does.</p>`;
  const both = change.both ? `<h4>Both hands</h4>${changeHtml(change.both, "both")}<h4>The ${escaped(track.who)} hand by itself</h4>` : "";
  return both + changeHtml(change, track.who);
}

function segmentHtml([name, start, end, was, by, subject]) {
  const changed = by ? `<p>was ${was.map(chip).join(" ")}</p><ul>${by.map((rule) => `<li><code>${escaped(rule)}</code></li>`).join("")}</ul>` : "";
  return `<p class="quiet">${seconds(start)} – ${seconds(end)}, ${((end - start) * 1000).toFixed(0)} ms${subject ? `, ${escaped(subject)}` : ""}</p>${changed}`;
}

function explain() {
  if (!state.selected) {
    why.innerHTML = data.tracks.some((track) => track.lanes) ? `<p class="quiet">Click a task to see how it was named.</p>` : `<p class="quiet">Click a boundary to see what changed there, a segment to see how it was relabeled, a task to see how it was named.</p>`;
    return;
  }
  const { kind, number, lane, at } = state.selected, track = data.tracks[number], item = track[lane][at];
  const close = `<button type="button" class="close" aria-label="close">×</button>`;
  if (kind === "task") {
    const asks = (asked) => asked.map(([holds, what, found]) => `<li>${verdict(holds)} <code>${escaped(what)}</code> <span class="quiet">${escaped(found)}</span></li>`).join("");
    const rows = (item.tried || []).map(([matches, name, place, asked]) => `<li>${verdict(matches)} <b>${escaped(name)}</b> <small class="quiet">${escaped(place)}</small><ul>${asks(asked)}</ul></li>`);
    why.innerHTML = `${close}<h3>${escaped(item.task)}${item.subject ? ` ${escaped(item.subject)}` : ""} <small class="quiet">${escaped(track.who)}</small></h3><p class="quiet">${seconds(item.start)} – ${seconds(item.end)}${item.remarks ? `; ${escaped(item.remarks)}` : ""}</p>${rows.length ? `<h4>Tasks by priority, and their keys</h4><ul class="tried">${rows.join("")}</ul>` : ""}`;
    return;
  }
  const [name, start] = item;
  const before = track[lane][at - 1], from = before && Math.abs(before[2] - start) < 1e-6 ? chip(before[0]) : `<span class="quiet">nothing</span>`;
  const raw = lane === "raw" ? at : track.raw.findIndex((one) => Math.abs(one[1] - start) < 1e-6);
  const head = kind === "cut" ? `${from} → ${chip(name)} <small class="quiet">${escaped(track.who)} ${lane}, ${seconds(start)}</small>` : `${chip(name)} <small class="quiet">${escaped(track.who)} ${lane}</small>`;
  const own = kind === "segment" || lane === "relabeled" && item[4] ? segmentHtml(item) : "";
  const beginning = track.lanes ? "" : raw >= 0 ? `${kind === "segment" ? `<h4>How it began, at ${seconds(start)}</h4>` : ""}${cutHtml(number, raw)}` : "<p>No tree has a boundary here: relabeling put it here.</p>";
  why.innerHTML = `${close}<h3>${head}</h3>${own}${beginning}`;
}
