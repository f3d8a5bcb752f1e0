// Curves as `thin.rs` writes them: text in, broken lines over time out.

const data = JSON.parse(document.getElementById("data").textContent);
const step = data.rate > 0 ? 1 / data.rate : 0;

function numbersOf(text) {
  const bytes = atob(text);
  const numbers = [];
  for (let at = 0; at < bytes.length;) {
    let number = 0, weight = 1, byte;
    do {
      byte = bytes.charCodeAt(at++);
      number += (byte & 0x7f) * weight;
      weight *= 128;
    } while (byte & 0x80);
    numbers.push(number);
  }
  return numbers;
}

/** The last place of an ascending list, at which `start(item) <= value`; -1 when there is none. */
function lastNotAfter(list, value, start = (item) => item) {
  let low = 0, high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (start(list[middle]) <= value) low = middle + 1; else high = middle;
  }
  return low - 1;
}

/** When a frame starts, s. */
function timeOf(frame) {
  const at = Math.max(0, lastNotAfter(data.stretches, frame, (stretch) => stretch[0]));
  const stretch = data.stretches[at] || [0, 0, data.start];
  return stretch[2] + (frame - stretch[0]) * step;
}

const lines = new WeakMap();

/** The gap-free pieces of a curve, each with times and values, and the least and greatest value. */
function lineOf(curve) {
  let line = lines.get(curve);
  if (line) return line;
  const pieces = [];
  if (curve.k === undefined) {
    for (const [start, end] of data.stretches) pieces.push({ t: [timeOf(start), timeOf(end - 1)], v: [curve.v, curve.v] });
  } else {
    const numbers = numbersOf(curve.k);
    let frame = 0, level = 0;
    for (let at = 0; at < numbers.length;) {
      const count = numbers[at++];
      const piece = { t: new Float64Array(count), v: new Float64Array(count) };
      for (let knot = 0; knot < count; knot++) {
        frame += numbers[at++];
        const change = numbers[at++];
        level += change % 2 ? -(change + 1) / 2 : change / 2;
        piece.t[knot] = timeOf(frame);
        piece.v[knot] = curve.a + level * curve.s;
      }
      pieces.push(piece);
    }
  }
  let least = Infinity, greatest = -Infinity;
  for (const { v } of pieces) for (const value of v) { least = Math.min(least, value); greatest = Math.max(greatest, value); }
  line = { pieces, least, greatest };
  lines.set(curve, line);
  return line;
}

/** The value of a curve at a time; not a number in a gap. */
function valueAt(curve, time) {
  if (curve.k === undefined) return curve.v;
  const { pieces } = lineOf(curve);
  const piece = pieces[lastNotAfter(pieces, time, (one) => one.t[0])];
  if (!piece) return NaN;
  const at = lastNotAfter(piece.t, time), last = piece.t.length - 1;
  if (at < last) {
    const share = (time - piece.t[at]) / (piece.t[at + 1] - piece.t[at]);
    return piece.v[at] + share * (piece.v[at + 1] - piece.v[at]);
  }
  return time < piece.t[last] + 1.5 * step ? piece.v[last] : NaN;
}

const truths = new Map();

/** The intervals in which something is so, as pairs of times; none reaches over a gap. */
function spansOf(text) {
  let spans = truths.get(text);
  if (spans) return spans;
  const frames = data.stretches.length ? data.stretches[data.stretches.length - 1][1] : 0;
  spans = [];
  let frame = 0, from = -1;
  const close = (to) => {
    for (const [start, end] of data.stretches) {
      const begin = Math.max(start, from), stop = Math.min(end, to);
      if (begin < stop) spans.push([timeOf(begin), timeOf(stop - 1) + step]);
    }
    from = -1;
  };
  for (const change of numbersOf(text)) {
    frame += change;
    if (from < 0) from = frame; else close(frame);
  }
  if (from >= 0) close(frames);
  truths.set(text, spans);
  return spans;
}

function isSo(text, time) {
  const spans = spansOf(text);
  const span = spans[lastNotAfter(spans, time, (one) => one[0])];
  return span !== undefined && time < span[1];
}

/** The segment of a lane at a time; at the end of the recording the last one. */
function segmentAt(lane, time) {
  const segment = lane[lastNotAfter(lane, time + 1e-9, (one) => one[1])];
  return segment !== undefined && (time < segment[2] || time >= data.end) ? segment : undefined;
}
