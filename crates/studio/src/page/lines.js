// Labels as lists: lines of a label file over the results of the rules. This file neither draws nor sends requests.

const NEAR = 1e-6;

/**
 * What holds on a track: `{ label, start, end, line }` in order of time; `line` is that of the label file, `undefined` where the rules say it. Where a track
 * has lines of tasks, they are all of its tasks.
 */
export function effective(track, lines, kind) {
  const own = lines.filter((line) => line.track === track.who && line.kind === kind).map((line) => ({ label: line.label, start: line.start_s, end: line.end_s, line }));
  const found = kind === "task" ? track.tasks.map((task) => ({ label: task.task, start: task.start, end: task.end }))
    : track.relabeled.map(([label, start, end]) => ({ label, start, end }));
  if (kind === "task" && own.length) return own.sort(byStart);
  return [...found.flatMap((one) => outside(one, own)), ...own].sort(byStart);
}

const byStart = (a, b) => a.start - b.start;

/** The parts of a span that no other one covers. */
function outside(span, others) {
  const parts = [];
  let from = span.start;
  for (const other of others.filter((one) => one.end > span.start + NEAR && one.start < span.end - NEAR).sort(byStart)) {
    if (other.start > from + NEAR) parts.push({ ...span, start: from, end: other.start });
    from = Math.max(from, other.end);
  }
  if (span.end > from + NEAR) parts.push({ ...span, start: from });
  return parts;
}

/** Lines with others in the place of those of a track and kind from one time to another. */
export function replaced(lines, track, kind, from, to, pieces, sign) {
  const before = kind === "task" ? listed(lines, track) : lines;
  const kept = before.flatMap((line) => {
    if (line.track !== track.who || line.kind !== kind) return [line];
    return outside({ start: line.start_s, end: line.end_s }, [{ start: from, end: to }]).map(({ start, end }) => ({ ...line, start_s: start, end_s: end }));
  });
  const set = pieces.filter((piece) => piece.end > piece.start + NEAR)
    .map((piece) => ({ track: track.who, kind, label: piece.label, start_s: piece.start, end_s: piece.end, pinned: true, ...sign }));
  return [...kept, ...set];
}

/**
 * Lines after a change of primitives, in which tasks follow: a task that began or ended at a boundary that moved begins or ends at its new place. Where a track
 * has no lines of tasks, all of its tasks become lines; they are none again where no primitive is labeled any more.
 */
export function followed(before, after, track) {
  const of = (kind) => after.filter((line) => line.track === track.who && line.kind === kind), tasks = of("task").sort((a, b) => a.start_s - b.start_s);
  const areOfRules = tasks.length === track.tasks.length && tasks.every((line, at) => !line.pinned && line.label === track.tasks[at].task);
  if (!of("primitive").length && areOfRules) return after.filter((line) => !tasks.includes(line));
  const near = (a, b) => Math.abs(a - b) < 2 * NEAR;
  const times = (lines) => {
    const all = effective(track, lines, "primitive").flatMap(({ start, end }) => [start, end]).sort((a, b) => a - b);
    return all.filter((time, at) => at === 0 || !near(time, all[at - 1]));
  };
  const [was, is] = [times(before), times(after)];
  const missing = (some, others) => some.filter((time) => !others.some((other) => near(time, other)));
  const [gone, come] = [missing(was, is), missing(is, was)];
  // Several boundaries cannot be assigned to each other.
  if (gone.length !== 1 || come.length !== 1) return after;
  const to = (time) => near(time, gone[0]) ? come[0] : time;
  const ends = effective(track, after, "task").flatMap(({ start, end }) => [start, end]);
  if (!ends.some((time) => near(time, gone[0]))) return after;
  return listed(after, track).map((line) => line.track === track.who && line.kind === "task" ? { ...line, start_s: to(line.start_s), end_s: to(line.end_s) } : line);
}

/** Lines with all tasks of a track: those that the rules found and those that a person set. */
function listed(lines, track) {
  if (lines.some((line) => line.track === track.who && line.kind === "task")) return lines;
  return [...lines, ...track.tasks.map((task) => ({ track: track.who, kind: "task", label: task.task, start_s: task.start, end_s: task.end, pinned: false, by: "", at: "" }))];
}

/** Lines with an edge of a span at another time: the start of the span at `at`, or with `last` its end. An adjacent neighbor moves with it. */
export function moved(lines, track, kind, { at, last }, time, sign, step) {
  const spans = effective(track, lines, kind), span = spans[at];
  const beside = spans[last ? at + 1 : at - 1], meets = beside && Math.abs(last ? beside.start - span.end : beside.end - span.start) < NEAR;
  const low = last ? span.start + step : meets ? beside.start + step : beside ? beside.end : -Infinity;
  const high = last ? meets ? beside.end - step : beside ? beside.start : Infinity : span.end - step;
  const to = Math.min(high, Math.max(low, time));
  const pieces = [last ? { ...span, end: to } : { ...span, start: to }];
  if (meets) pieces.push(last ? { ...beside, start: to } : { ...beside, end: to });
  // Time that a span gives up would fall back to the rules: of both hands it is said that they do nothing together.
  else if (track.who === "both" && kind === "primitive") {
    if (last && to < span.end) pieces.push({ label: "separate", start: to, end: span.end });
    if (!last && to > span.start) pieces.push({ label: "separate", start: span.start, end: to });
  }
  const all = [span, ...(meets ? [beside] : []), ...pieces];
  return replaced(lines, track, kind, Math.min(...all.map((one) => one.start)), Math.max(...all.map((one) => one.end)), pieces, sign);
}
