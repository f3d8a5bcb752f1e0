// The first view of the replay: the one from which links of a robot hide the least of objects and fingertips.

/** The view that stays where no other one shows more, rad. */
const FIRST = { yaw: -1.05, pitch: 0.55 };
/** Directions around the scene, and heights, rad; those near to the first view come first. */
const TURNS = 12, PITCHES = [0.55, 0.95];
/** Times at which views are compared. */
const MOMENTS = 9;

/** The views that are compared, the first one at the beginning. */
function views() {
  const turns = [...Array(TURNS).keys()].map((at) => (at % 2 ? -1 : 1) * Math.ceil(at / 2) * 2 * Math.PI / TURNS);
  return PITCHES.flatMap((pitch) => turns.map((turn) => ({ yaw: FIRST.yaw + turn, pitch })));
}

/** At some times: the points that should be seen, and the boxes of the links with their poses. */
function momentsOf(scene, from, to) {
  const at = (curves, time) => curves.map((curve) => valueAt(curve, time));
  const placed = (body, time) => {
    const [x, y, z, ...turn] = at(body.pose, time);
    return { body, at: [x, y, z], rotation: rotationOf(turn.length ? turn : [1, 0, 0, 0]) };
  };
  const isKnown = (point) => point.every(Number.isFinite);
  return [...Array(MOMENTS).keys()].map((number) => {
    const time = from + (to - from) * number / (MOMENTS - 1);
    const bodies = scene.bodies.map((body) => placed(body, time)).filter((one) => isKnown(one.at));
    const tips = scene.hands.flatMap((hand) => hand.fingers.map((finger) => at(finger.position, time))).filter(isKnown);
    const objects = bodies.filter(({ body }) => body.role === "object").map((one) => one.at);
    const links = bodies.filter(({ body }) => body.role === "robot").flatMap(boxesOf);
    return { points: [...objects, ...tips], links };
  });
}

/** The parts of a link as boxes: middle, rows of the rotation, and half of the edges. */
function boxesOf({ body, at, rotation }) {
  const edges = (part) => part.shape === "cylinder" ? [2 * part.size[0], 2 * part.size[0], part.size[1]]
    : part.shape === "ball" ? [0, 1, 2].map(() => 2 * part.size[0]) : part.size;
  return body.parts.map((part) => {
    const own = rotationOf(part.turned), columns = [0, 1, 2].map((axis) => own.map((row) => row[axis]));
    return {
      middle: add(at, turned(rotation, part.at)),
      axes: columns.map((column) => turned(rotation, column)),
      half: edges(part).map((edge) => edge / 2),
    };
  });
}

/** Whether a box lies between an eye and a point outside of the box. */
function isBetween({ middle, axes, half }, eye, point) {
  let enters = 0, leaves = 1, isInside = true;
  for (const axis of [0, 1, 2]) {
    const from = dot(add(eye, scale(middle, -1)), axes[axis]), to = dot(add(point, scale(middle, -1)), axes[axis]), way = to - from;
    if (Math.abs(to) > half[axis]) isInside = false;
    if (Math.abs(way) < 1e-12) {
      if (Math.abs(from) > half[axis]) return false;
      continue;
    }
    const [one, other] = [(-half[axis] - from) / way, (half[axis] - from) / way];
    enters = Math.max(enters, Math.min(one, other));
    leaves = Math.min(leaves, Math.max(one, other));
  }
  return !isInside && enters < leaves;
}

/** Of all moments, the share of points that links hide from an eye. */
function hiddenFrom(eye, moments) {
  let hidden = 0, all = 0;
  for (const { points, links } of moments) {
    all += points.length;
    hidden += points.filter((point) => links.some((link) => isBetween(link, eye, point))).length;
  }
  return all ? hidden / all : 0;
}
