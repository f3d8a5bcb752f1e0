// The signals below the lanes: which are shown, their curves with thresholds, and their values at the cursor.

const panels = [];

function hueOf(at) {
  return paint(`--curve${at % CURVES}`);
}

const isConstant = (entry) => entry.curves ? entry.curves.every(([, curve]) => curve.k === undefined) : entry.truths.every(([, truth]) => truth === "");
const nameOf = (entry) => `${entry.side ? `${entry.side} ` : ""}${entry.title}`;

/** The initial signals: for each hand the quantities with thresholds, and the contacts; with two hands the forces of both. */
function usual() {
  const chosen = [];
  const add = (entry) => { if (entry !== undefined && !chosen.includes(entry)) chosen.push(entry); };
  const varied = data.signals.filter((entry) => !isConstant(entry));
  const sides = [...new Set(data.tracks.map((track) => track.who))].filter((who) => who !== "both");
  if (sides.length > 1) varied.filter((entry) => entry.group === 0 && entry.side === "").slice(0, 2).forEach(add);
  for (const side of sides) {
    const own = varied.filter((entry) => entry.side === side);
    const crossed = (entry) => (entry.shades || []).some(([, truth]) => truth !== "");
    own.filter((entry) => entry.group === 1 && entry.curves && entry.curves.length === 1 && entry.unit && crossed(entry)).slice(0, sides.length > 1 ? 2 : 4).forEach(add);
    if (sides.length === 1) add(own.find((entry) => entry.group === 0 && entry.curves.length > 1));
  }
  // The signals of a robot have no thresholds.
  if (!data.signals.some((entry) => entry.shades) || !chosen.length) {
    const shown = sides.length > 1 ? sides.map((side) => varied.filter((entry) => entry.side === side).slice(0, 2)).flat() : varied.slice(0, 3);
    (shown.length ? shown : varied.slice(0, 3)).forEach(add);
  }
  return chosen.map((entry) => data.signals.indexOf(entry));
}

function options(chosen) {
  let list = "";
  data.groups.forEach((group, number) => {
    for (const side of ["left", "right", ""]) {
      const own = data.signals.map((entry, at) => [entry, at]).filter(([entry]) => entry.group === number && entry.side === side);
      if (!own.length) continue;
      list += `<optgroup label="${escaped(`${group}${side ? `, ${side}` : ""}`)}">`;
      for (const [entry, at] of own) {
        const whole = data.tracks.length > 1 ? nameOf(entry) : entry.title;
        const name = whole.length > 90 ? `${whole.slice(0, 88)}…` : whole;
        list += `<option value="${at}"${at === chosen ? " selected" : ""}>${escaped(name)}${isConstant(entry) ? " (constant)" : ""}</option>`;
      }
      list += "</optgroup>";
    }
  });
  return list;
}

function addPanel(number) {
  const element = document.createElement("div");
  element.className = "panel";
  element.innerHTML = `<header><span class="unit"></span><select aria-label="signal">${options(number)}</select><span class="values"></span><button type="button" class="scale" hidden></button><button type="button" class="remove" aria-label="remove">×</button></header><canvas></canvas><p class="detail" hidden></p>`;
  const panel = { element, number, canvas: element.querySelector("canvas"), values: element.querySelector(".values") };
  element.querySelector("select").addEventListener("change", (event) => { panel.number = Number(event.target.value); drawPanel(panel); readOut(panel); });
  element.querySelector(".scale").addEventListener("click", () => {
    const entry = data.signals[panel.number];
    entry.whole = !entry.whole;
    entry.range = undefined;
    panels.filter((one) => one.number === panel.number).forEach((one) => { drawPanel(one); readOut(one); });
  });
  element.querySelector(".remove").addEventListener("click", () => { panels.splice(panels.indexOf(panel), 1); element.remove(); });
  byId("panels").append(element);
  panels.push(panel);
  return panel;
}

/** The curves of an entry; of many, those that vary. */
function drawn(entry) {
  const varied = entry.curves.filter(([, curve]) => curve.k !== undefined);
  return varied.length && entry.curves.length > 3 ? varied : entry.curves;
}

function rangeOf(entry) {
  if (entry.range) return entry.range;
  let least = Infinity, greatest = -Infinity;
  for (const [, curve] of entry.curves) { const line = lineOf(curve); least = Math.min(least, line.least); greatest = Math.max(greatest, line.greatest); }
  entry.extremes = [least, greatest];
  if (entry.scale && !entry.whole) [least, greatest] = entry.scale;
  for (const [value] of entry.thresholds || []) { least = Math.min(least, value); greatest = Math.max(greatest, value); }
  if (!(least <= greatest)) [least, greatest] = [0, 1];
  // Zero belongs to the picture unless it is far away.
  if (least > 0 && least < 0.7 * greatest) least = 0;
  if (greatest < 0 && greatest > 0.7 * least) greatest = 0;
  const room = (greatest - least || Math.abs(greatest) || 1) * 0.06;
  return entry.range = [least - (least < 0 ? room : 0), greatest + room];
}

/** A number of an entry, with the digits that its scale resolves. */
function numeral(entry, value) {
  if (!Number.isFinite(value)) return "–";
  const [least, greatest] = rangeOf(entry);
  // A line is within a two-thousandth of the range.
  const digits = Math.min(6, Math.max(0, Math.floor(3 - Math.log10(Math.max(1e-9, greatest - least)) + 1e-9)));
  return value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1");
}

/** The same in few digits. */
const brief = (entry, value) => `${Number(value.toPrecision(4))}${entry.unit ? ` ${entry.unit}` : ""}`;

/** The values of an entry beyond its scale, shown on the button that takes it into the scale and out of it again. */
function tellScale(panel, entry) {
  const button = panel.element.querySelector(".scale");
  button.hidden = !entry.scale;
  if (!entry.scale) return;
  const [least, greatest] = entry.extremes;
  const beyond = [greatest > entry.scale[1] && greatest, least < entry.scale[0] && least].filter((value) => value !== false);
  const numbers = beyond.map((value) => brief(entry, value)).join(" and ");
  const [mark, ways] = greatest > entry.scale[1] ? ["▲", "up to"] : ["▼", "down to"];
  button.textContent = entry.whole ? "usual scale" : `${mark} ${ways} ${numbers}`;
  button.title = entry.whole ? "Leave a few frames out of the scale again" : "A few frames lie beyond this scale; show them whole";
}

/** Where the curves are in each column of a plot, one above the other: their highest and lowest points, by curve. */
function heights(entry, x, y, width) {
  return drawn(entry).map(([, curve]) => {
    const columns = { top: new Float32Array(width + 1).fill(Infinity), bottom: new Float32Array(width + 1).fill(-Infinity) };
    const take = (at, height) => {
      if (at < 0 || at > width) return;
      columns.top[at] = Math.min(columns.top[at], height);
      columns.bottom[at] = Math.max(columns.bottom[at], height);
    };
    for (const { t, v, low, high } of lineOf(curve).pieces) {
      const first = Math.max(0, lastNotAfter(t, state.from)), last = Math.min(t.length - 1, lastNotAfter(t, state.to) + 1);
      for (let at = first; at < last; at++) {
        const [a, b, from, to] = [x(t[at]), x(t[at + 1]), y(v[at]), y(v[at + 1])];
        for (let column = Math.max(0, Math.floor(a)); column <= Math.min(width, Math.ceil(b)); column++) {
          const share = (near) => Math.min(1, Math.max(0, b > a ? (near - a) / (b - a) : 0));
          take(column, from + share(column) * (to - from));
          take(column, from + share(column + 1) * (to - from));
          if (!Number.isNaN(low[at])) [low[at], high[at]].forEach((value) => take(column, y(value)));
        }
        take(Math.round(b), from);
        take(Math.round(b), to);
      }
    }
    return columns;
  });
}

/** The place for a name at a level: above or below its line, as far right as no curve and no other name is in its way; else where the least is. */
function placeOf(size, level, { curves, levels, taken, width, height }) {
  const tall = 11;
  let best, fewest = Infinity;
  for (const base of [level - 3, level + tall - 1]) {
    if (base < tall || base > height - 2) continue;
    for (let end = width - 4; end > size + 4; end -= 4) {
      const [left, top] = [end - size - 2, base - tall];
      if (taken.some((one) => one.left < end + 6 && one.end > left - 6 && one.top < base && one.base > top)) continue;
      // The line of another threshold through a name is as bad as a curve through half of it.
      let hits = levels.filter((one) => one > top && one < base).length * size / 2;
      for (const columns of curves) for (let at = Math.max(0, Math.floor(left)); at <= Math.min(width, end + 2); at++) if (columns.top[at] < base + 2 && columns.bottom[at] > top - 1) hits++;
      if (hits < fewest) [best, fewest] = [{ left, end, top, base, hits }, hits];
      if (!hits) return best;
    }
  }
  return best || { left: width - 4 - size, end: width - 4, top: Math.max(0, level - 3 - tall), base: Math.max(tall, level - 3), hits: 1 };
}

/** Marks values beyond the scale by triangles at the edge, and the farthest one with its value. */
function markBeyond(context, entry, x, { width, height, taken }) {
  const [least, greatest] = rangeOf(entry);
  context.fillStyle = paint("--warn");
  context.strokeStyle = paint("--paper");
  context.lineWidth = 3;
  for (const [sign, limit] of [[1, greatest], [-1, -least]]) {
    const marks = new Map();
    let farthest;
    for (const [, curve] of drawn(entry)) for (const { t, v, low, high } of lineOf(curve).pieces) for (let at = 0; at < t.length; at++) {
      const band = sign > 0 ? high[at] : low[at], value = Number.isNaN(band) ? v[at] : band;
      const time = Number.isNaN(band) ? t[at] : (t[at] + t[at + 1]) / 2;
      if (!(sign * value > limit) || time < state.from || time > state.to) continue;
      marks.set(Math.round(x(time) / 8), x(time));
      if (!farthest || sign * value > sign * farthest.value) farthest = { at: x(time), value };
    }
    if (!farthest) continue;
    const edge = sign > 0 ? 4 : height - 1;
    for (const at of [...marks.values(), farthest.at]) {
      context.beginPath();
      context.moveTo(at, edge);
      context.lineTo(at - 4, edge + sign * 7);
      context.lineTo(at + 4, edge + sign * 7);
      context.fill();
    }
    const text = brief(entry, farthest.value), size = context.measureText(text).width;
    const left = farthest.at + 7 + size < width ? farthest.at + 7 : farthest.at - 7 - size, base = edge + (sign > 0 ? 9 : -1);
    context.textAlign = "left";
    context.strokeText(text, left, base);
    context.fillText(text, left, base);
    taken.push({ left, end: left + size, top: base - 11, base });
  }
}

function drawPanel(panel) {
  const entry = data.signals[panel.number], { canvas } = panel;
  const width = plotWidth(signals), sharp = window.devicePixelRatio || 1;
  const height = entry.truths ? Math.max(18, entry.truths.length * 13 + 6) : 96;
  canvas.style.height = `${height}px`;
  canvas.width = Math.round((width + GUTTER + RIGHT) * sharp);
  canvas.height = Math.round(height * sharp);
  panel.element.querySelector(".unit").textContent = entry.unit || "";
  panel.element.querySelector("select").title = nameOf(entry);
  panel.element.querySelector(".scale").hidden = true;
  const pause = Math.max(0, ...[...(entry.truths || []), ...(entry.shades || []).slice(0, 1)].map(([, truth]) => pauseOf(truth)));
  const lacking = pause ? [`Pauses shorter than ${brief({ unit: "s" }, pause)} are not drawn.`] : [];
  tellDetail(panel, lacking);
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", nameOf(entry));
  const context = canvas.getContext("2d");
  context.scale(sharp, sharp);
  context.font = `11px ${paint("--font")}`;
  context.translate(GUTTER, 0);
  const x = (time) => xOf(time, width);
  const clip = () => { context.save(); context.beginPath(); context.rect(0, 0, width, height); context.clip(); };
  const track = data.tracks.find((one) => one.who === (entry.side || "both")) || data.tracks[0];
  clip();
  context.fillStyle = paint("--shade");
  const [, shaded] = (entry.shades || [])[0] || [];
  if (shaded !== undefined) for (const [from, to] of spansOf(shaded)) if (to > state.from && from < state.to) context.fillRect(x(from), 0, Math.max(1, x(to) - x(from)), height);
  context.strokeStyle = paint("--line");
  context.beginPath();
  for (const time of ticks(state.from, state.to, Math.max(3, width / 90)).list) { context.moveTo(x(time), 0); context.lineTo(x(time), height); }
  context.stroke();
  if (track) {
    context.strokeStyle = paint("--cut");
    context.setLineDash([2, 3]);
    context.beginPath();
    // Lines that are too dense to be distinguished are left out.
    const cuts = track.raw.filter(([, start]) => start >= state.from && start <= state.to);
    if (cuts.length < width / 8) for (const [, start] of cuts) if (start > data.start && start >= state.from && start <= state.to) { context.moveTo(x(start), 0); context.lineTo(x(start), height); }
    context.stroke();
    context.setLineDash([]);
    for (const [name, start, end] of track.relabeled) if (end > state.from && start < state.to) { context.fillStyle = data.colors[name]; context.fillRect(x(start), 0, Math.max(1, x(end) - x(start)), 3); }
  }
  const selected = state.selected && startOf(state.selected);
  if (selected !== undefined) { context.fillStyle = paint("--chosen"); context.fillRect(x(selected) - 0.75, 0, 1.5, height); }
  context.restore();
  panel.y = undefined;
  if (entry.truths) {
    entry.truths.forEach(([name, truth], at) => {
      const y = 6 + at * 13;
      context.fillStyle = paint("--quiet");
      context.textAlign = "right";
      context.fillText(name, -8, y + 9, GUTTER - 12);
      clip();
      context.fillStyle = hueOf(0);
      for (const [from, to] of spansOf(truth)) if (to > state.from && from < state.to) context.fillRect(x(from), y, Math.max(1, x(to) - x(from)), 9);
      context.restore();
    });
    return;
  }
  const [least, greatest] = rangeOf(entry);
  tellScale(panel, entry);
  const y = (value) => height - 5 - (value - least) / (greatest - least) * (height - 13);
  panel.y = y;
  panel.valueAt = (place) => least + (height - 5 - place) / (height - 13) * (greatest - least);
  const levels = ticks(least, greatest, 4);
  let longest = 0;
  context.textAlign = "right";
  for (const value of levels.list) {
    context.strokeStyle = paint(Math.abs(value) < 1e-12 ? "--zero" : "--line");
    context.beginPath();
    context.moveTo(0, y(value));
    context.lineTo(width, y(value));
    context.stroke();
    context.fillStyle = paint("--quiet");
    context.fillText(value.toFixed(levels.digits), -8, y(value) + 4);
  }
  clip();
  drawn(entry).forEach(([, curve], at) => {
    context.strokeStyle = hueOf(at);
    context.setLineDash(at >= CURVES ? [5, 2] : []);
    context.lineWidth = 1.4;
    context.lineJoin = "round";
    const bands = [];
    context.beginPath();
    for (const piece of lineOf(curve).pieces) trace(context, piece, x, y, bands);
    context.stroke();
    context.fillStyle = context.strokeStyle;
    context.globalAlpha = 0.35;
    for (const { left, right, top, bottom, time } of bands) {
      context.fillRect(left, top, right - left, Math.max(1, bottom - top));
      longest = Math.max(longest, time);
    }
    context.globalAlpha = 1;
  });
  context.restore();
  if (longest > 0) tellDetail(panel, [...lacking, `This page holds no more detail here: a band reaches from the least to the greatest value of up to ${brief({ unit: "s" }, longest)}.`]);
  clip();
  context.lineWidth = 1;
  context.strokeStyle = paint("--threshold");
  context.setLineDash([6, 4]);
  for (const [value] of entry.thresholds || []) {
    context.beginPath();
    context.moveTo(0, y(value));
    context.lineTo(width, y(value));
    context.stroke();
  }
  context.setLineDash([]);
  const plot = { curves: entry.thresholds ? heights(entry, x, y, width) : [], levels: (entry.thresholds || []).map(([value]) => y(value)), taken: [], width, height };
  markBeyond(context, entry, x, plot);
  context.textAlign = "right";
  for (const [value, name] of entry.thresholds || []) {
    const place = placeOf(context.measureText(name).width, y(value), plot);
    plot.taken.push(place);
    // Where curves are everywhere, a name has a ground of its own.
    if (place.hits) {
      context.globalAlpha = 0.8;
      context.fillStyle = paint("--paper");
      context.fillRect(place.left, place.top, place.end - place.left + 2, place.base - place.top + 2);
      context.globalAlpha = 1;
    }
    context.strokeStyle = paint("--paper");
    context.fillStyle = paint("--threshold");
    context.lineWidth = 3;
    context.strokeText(name, place.end, place.base);
    context.fillText(name, place.end, place.base);
  }
  context.restore();
}

/** Prints below a plot which detail the page lacks; empty if it contains all drawn samples. */
function tellDetail(panel, sentences) {
  const place = panel.element.querySelector(".detail");
  place.textContent = sentences.join(" ");
  place.hidden = !sentences.length;
}

/**
 * A piece of a line. Of many points in a column of pixels the first, the least, the greatest and the last are drawn, as they would be one by one. A band that
 * is wider than a column is not a line: it is added to `bands`.
 */
function trace(context, { t, v, low, high }, x, y, bands) {
  const first = Math.max(0, lastNotAfter(t, state.from)), last = Math.min(t.length - 1, lastNotAfter(t, state.to) + 1);
  let open, lifted = true;
  const end = () => {
    if (!open) return;
    if (open.count > 1) {
      context.lineTo(open.left, y(open.least));
      context.lineTo(open.left, y(open.greatest));
      context.lineTo(open.right, y(open.last));
    }
    open = undefined;
  };
  const take = (at, value, least, greatest) => {
    const column = Math.floor(at);
    if (open && open.column === column) {
      Object.assign(open, { right: at, last: value, least: Math.min(open.least, least), greatest: Math.max(open.greatest, greatest), count: open.count + 1 });
      return;
    }
    end();
    if (lifted) context.moveTo(at, y(value)); else context.lineTo(at, y(value));
    lifted = false;
    open = { column, left: at, right: at, last: value, least, greatest, count: least < greatest ? 2 : 1 };
  };
  for (let at = first; at <= last; at++) {
    const left = x(t[at]);
    if (Number.isNaN(low[at])) {
      take(left, v[at], v[at], v[at]);
      continue;
    }
    const right = x(t[at + 1]);
    if (right - left <= 1) {
      take(left, v[at], low[at], high[at]);
    } else {
      take(left, v[at], v[at], v[at]);
      end();
      lifted = true;
      bands.push({ left, right, top: y(high[at]), bottom: y(low[at]), time: t[at + 1] - t[at] + step });
    }
  }
  end();
  if (first === last) context.lineTo(x(t[first] + step), y(v[first]));
}

/** The values of a panel at the cursor. */
function readOut(panel) {
  const entry = data.signals[panel.number];
  const rows = entry.truths
    ? entry.truths.map(([name, truth]) => [name, isSo(truth, state.cursor) ? "yes" : "no", 0])
    : drawn(entry).map(([name, curve], at) => {
      const bounds = [...new Set(boundsAt(curve, state.cursor).map((value) => numeral(entry, value)))].join(" … ");
      return [name, `${bounds}${entry.unit ? ` ${entry.unit}` : ""}`, at];
    });
  const shown = rows.map(([name, value, at]) => `<span class="value" style="color:${hueOf(at)}">${escaped(name)} <b>${escaped(value)}</b></span>`);
  const shade = (entry.shades || [])[0];
  if (shade) shown.push(`<span class="value shade">${escaped(shade[0].length > 40 ? "the condition" : shade[0])} <b>${isSo(shade[1], state.cursor) ? "yes" : "no"}</b></span>`);
  panel.values.innerHTML = shown.join(" ");
}
