// Curves as `thin.rs` writes them: text in, broken lines over time out.

/** What is shown; `load` of `work.js` puts it here. */
let data, step = 0;

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

/**
 * The gap-free pieces of a curve, each with times and values, and the least and greatest value. Between a point with a number in `low` and the next point
 * lies a band with only its smallest and largest values, `low` and `high`.
 */
function lineOf(curve) {
  let line = lines.get(curve);
  if (line) return line;
  const pieces = [];
  if (curve.k === undefined) {
    for (const [start, end] of data.stretches) pieces.push({ t: [timeOf(start), timeOf(end - 1)], v: [curve.v, curve.v], low: [NaN, NaN], high: [NaN, NaN] });
  } else {
    const numbers = numbersOf(curve.k);
    let frame = 0, level = 0, at = 0;
    const change = () => {
      const number = numbers[at++];
      return number % 2 ? -(number + 1) / 2 : number / 2;
    };
    while (at < numbers.length) {
      const piece = { t: [], v: [], low: [], high: [] };
      const add = (low, high) => {
        piece.t.push(timeOf(frame));
        piece.v.push(curve.a + level * curve.s);
        piece.low.push(low);
        piece.high.push(high);
      };
      for (let left = numbers[at++]; left > 0; left--) {
        const head = numbers[at++];
        frame += Math.floor(head / 2);
        level += change();
        if (head % 2) {
          const frames = numbers[at++], last = level + change();
          const low = Math.min(level, last) - numbers[at++], high = Math.max(level, last) + numbers[at++];
          add(curve.a + low * curve.s, curve.a + high * curve.s);
          frame += frames;
          level = last;
        }
        add(NaN, NaN);
      }
      pieces.push(piece);
    }
  }
  let least = Infinity, greatest = -Infinity;
  for (const piece of pieces) for (const values of [piece.v, piece.low, piece.high]) for (const value of values) {
    if (value < least) least = value;
    if (value > greatest) greatest = value;
  }
  line = { pieces, least, greatest };
  lines.set(curve, line);
  return line;
}

/** The least and the greatest value that a curve may have at a time: the same but in a band; not numbers in a gap. */
function boundsAt(curve, time) {
  if (curve.k === undefined) return [curve.v, curve.v];
  const { pieces } = lineOf(curve);
  const piece = pieces[lastNotAfter(pieces, time + step * 1e-3, (one) => one.t[0])];
  if (!piece) return [NaN, NaN];
  const { t, v, low, high } = piece, at = Math.max(0, lastNotAfter(t, time)), last = t.length - 1;
  if (at < last) {
    const on = [at, at + 1].find((point) => Math.abs(t[point] - time) < step * 1e-3);
    if (on !== undefined) return [v[on], v[on]];
    if (!Number.isNaN(low[at])) return [low[at], high[at]];
    const share = (time - t[at]) / (t[at + 1] - t[at]), value = v[at] + share * (v[at + 1] - v[at]);
    return [value, value];
  }
  return time < t[last] + 1.5 * step ? [v[last], v[last]] : [NaN, NaN];
}

/** The value of a curve without bands at a time; not a number in a gap. */
const valueAt = (curve, time) => boundsAt(curve, time)[0];

const truths = new Map();

/** The intervals in which a condition holds, as pairs of times; an interval ends at a gap. */
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
  for (const change of numbersOf(text.slice(text.indexOf("~") + 1))) {
    frame += change;
    if (from < 0) from = frame; else close(frame);
  }
  if (from >= 0) close(frames);
  truths.set(text, spans);
  return spans;
}

/** How long the pauses are that the intervals leave out, s. */
const pauseOf = (text) => text.includes("~") ? parseInt(text, 10) * step : 0;

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
