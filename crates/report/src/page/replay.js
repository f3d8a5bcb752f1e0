// The demonstration in three dimensions, on a plain canvas: faces and balls go through a depth buffer, arrows and names are drawn over it.

/** A picture with a depth for each of its points; a larger `near` is nearer. */
class Picture {
  constructor(context) {
    this.context = context;
    this.width = 0;
    this.height = 0;
  }

  clear(width, height, color) {
    if (width !== this.width || height !== this.height) {
      this.width = width;
      this.height = height;
      this.image = this.context.createImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
      this.depth = new Float32Array(width * height);
    }
    this.pixels.fill(color);
    this.depth.fill(0);
  }

  show() {
    this.context.putImageData(this.image, 0, 0);
  }

  /** A convex face of corners [x, y, near], of one color. */
  face(corners, color) {
    const { width, height, pixels, depth } = this;
    // Over a plane, `near` is linear on the picture.
    const [a, b] = corners;
    let c, area = 0;
    for (let at = 2; at < corners.length; at++) {
      const size = (b[0] - a[0]) * (corners[at][1] - a[1]) - (corners[at][0] - a[0]) * (b[1] - a[1]);
      if (Math.abs(size) > Math.abs(area)) { area = size; c = corners[at]; }
    }
    if (Math.abs(area) < 1e-3) return;
    const across = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area;
    const down = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area;
    let top = Infinity, bottom = -Infinity;
    for (const corner of corners) { top = Math.min(top, corner[1]); bottom = Math.max(bottom, corner[1]); }
    const last = Math.min(height - 1, Math.ceil(bottom - 0.5) - 1);
    for (let y = Math.max(0, Math.ceil(top - 0.5)); y <= last; y++) {
      let left = Infinity, right = -Infinity;
      for (let at = 0; at < corners.length; at++) {
        const from = corners[at], to = corners[(at + 1) % corners.length];
        if ((from[1] <= y + 0.5) !== (to[1] <= y + 0.5)) {
          const x = from[0] + (y + 0.5 - from[1]) / (to[1] - from[1]) * (to[0] - from[0]);
          left = Math.min(left, x);
          right = Math.max(right, x);
        }
      }
      const start = Math.max(0, Math.ceil(left - 0.5)), end = Math.min(width - 1, Math.ceil(right - 0.5) - 1);
      let near = a[2] + (start + 0.5 - a[0]) * across + (y + 0.5 - a[1]) * down;
      for (let at = y * width + start; at <= y * width + end; at++, near += across) {
        if (near > depth[at]) { depth[at] = near; pixels[at] = color; }
      }
    }
  }

  /** A line, a little nearer than it is, so that edges stand out from their faces. */
  line(from, to, color, thick) {
    const { width, height, pixels, depth } = this;
    const steps = Math.min(4000, Math.ceil(Math.max(Math.abs(to[0] - from[0]), Math.abs(to[1] - from[1]), 1)));
    for (let at = 0; at <= steps; at++) {
      const share = at / steps;
      const x = Math.floor(from[0] + share * (to[0] - from[0]) - thick / 2 + 0.5);
      const y = Math.floor(from[1] + share * (to[1] - from[1]) - thick / 2 + 0.5);
      const near = (from[2] + share * (to[2] - from[2])) * 1.004;
      for (let row = Math.max(0, y); row < Math.min(height, y + thick); row++) {
        for (let column = Math.max(0, x); column < Math.min(width, x + thick); column++) {
          const place = row * width + column;
          if (near >= depth[place]) { depth[place] = near; pixels[place] = color; }
        }
      }
    }
  }

  /** A ball about a point [x, y, near], with its radius on the picture and in space; `shade` makes a color of how much light falls on it. */
  ball([x, y, near], radius, size, light, shade) {
    const { width, height, pixels, depth } = this;
    if (radius > 4000) return;
    for (let row = Math.max(0, Math.floor(y - radius)); row <= Math.min(height - 1, Math.ceil(y + radius)); row++) {
      for (let column = Math.max(0, Math.floor(x - radius)); column <= Math.min(width - 1, Math.ceil(x + radius)); column++) {
        const right = (column + 0.5 - x) / radius, down = (row + 0.5 - y) / radius;
        const out = 1 - right * right - down * down;
        if (out < 0) continue;
        const front = Math.sqrt(out);
        const here = 1 / (1 / near - size * front), place = row * width + column;
        if (here > depth[place]) {
          depth[place] = here;
          pixels[place] = shade(right * light[0] + down * light[1] + front * light[2]);
        }
      }
    }
  }
}

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const scale = (a, by) => [a[0] * by, a[1] * by, a[2] * by];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.sqrt(dot(a, a));

/** The rows of the rotation of a quaternion w x y z. */
function rotationOf([w, x, y, z]) {
  const size = Math.hypot(w, x, y, z) || 1;
  [w, x, y, z] = [w / size, x / size, y / size, z / size];
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}
const turned = (rotation, v) => [dot(rotation[0], v), dot(rotation[1], v), dot(rotation[2], v)];

/** A part as faces in the frame of its body; each has corners and says which of its edges are drawn. */
function facesOf(part) {
  const turn = rotationOf(part.turned);
  const place = (point) => add(turned(turn, point), part.at);
  const [x, y, z] = part.size.map((size) => size / 2);
  if (part.shape === "box") {
    const corner = (at) => place([at & 1 ? x : -x, at & 2 ? y : -y, at & 4 ? z : -z]);
    const sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    return sides.map((side) => ({ corners: side.map(corner), edges: [0, 1, 2, 3] }));
  }
  if (part.shape === "cylinder") {
    const [radius, height] = [part.size[0], part.size[1] / 2], count = 28, faces = [];
    const rim = (at, up) => place([radius * Math.cos(2 * Math.PI * at / count), radius * Math.sin(2 * Math.PI * at / count), up]);
    const top = [], bottom = [];
    for (let at = 0; at < count; at++) {
      faces.push({ corners: [rim(at, -height), rim(at + 1, -height), rim(at + 1, height), rim(at, height)], edges: [0, 2] });
      top.push(rim(at, height));
      bottom.unshift(rim(at, -height));
    }
    return [...faces, { corners: top, edges: [] }, { corners: bottom, edges: [] }];
  }
  if (part.shape === "mesh") {
    const corner = (at) => place([0, 1, 2].map((axis) => part.points[3 * at + axis] / 1e4)), faces = [];
    for (let at = 0; at < part.faces.length; at += 3) faces.push({ corners: part.faces.slice(at, at + 3).map(corner), edges: [] });
    return faces;
  }
  return [];
}

/** How far a body reaches in a direction of its own frame. */
function reachOf(body, direction) {
  const of = (part) => {
    const way = turned(rotationOf([part.turned[0], -part.turned[1], -part.turned[2], -part.turned[3]]), direction);
    const [a, b] = part.size;
    const own = part.shape === "box" || part.shape === "mesh" ? (Math.abs(way[0]) * a + Math.abs(way[1]) * b + Math.abs(way[2]) * part.size[2]) / 2
      : part.shape === "cylinder" ? Math.hypot(way[0], way[1]) * a + Math.abs(way[2]) * b / 2 : a;
    return dot(part.at, direction) + own;
  };
  return body.parts.length ? Math.max(...body.parts.map(of)) : body.radius;
}

/** Objects differ in hue and lightness; fixed bodies are gray. */
const OBJECT_COLORS = [[86, 180, 233], [230, 159, 0], [0, 158, 115], [204, 121, 167], [240, 228, 66], [213, 94, 0]];
const ROBOT_COLOR = [142, 155, 176];
const packed = ([r, g, b]) => (255 << 24 | b << 16 | g << 8 | r) >>> 0;
const numbersIn = (color) => [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16));
/** Seconds of the way that a hand leaves behind. */
const TRAIL = 2;
/** How far the links of a hand are from its fingertips, m. */
const HAND = 0.15;

class Replay {
  constructor(canvas, caption, scene, tracks) {
    Object.assign(this, { canvas, caption, scene, tracks });
    this.context = canvas.getContext("2d");
    this.picture = new Picture(this.context);
    this.time = 0;
    let objects = 0;
    for (const body of scene.bodies) {
      body.faces = body.parts.flatMap(facesOf);
      body.color = body.role === "object" ? OBJECT_COLORS[objects++ % OBJECT_COLORS.length] : body.role === "robot" ? ROBOT_COLOR : undefined;
    }
    for (const hand of scene.hands) hand.links = this.linksOf(hand);
    this.measure();
    this.begin();
    this.listen();
  }

  /** The links of a robot's hand: those that are near its fingertips at the beginning. */
  linksOf(hand) {
    const at = (curves) => curves.slice(0, 3).map((curve) => valueAt(curve, data.start));
    const tips = hand.fingers.map((finger) => at(finger.position));
    const isNear = (body) => tips.some((tip) => length(add(tip, scale(at(body.pose), -1))) < HAND);
    return this.scene.bodies.filter((body) => body.role === "robot" && isNear(body));
  }

  /** How large the scene is, and how strong the forces are. */
  measure() {
    const box = () => ({ least: [Infinity, Infinity, Infinity], greatest: [-Infinity, -Infinity, -Infinity] });
    const take = ({ least, greatest }, curves, around) => curves.slice(0, 3).forEach((curve, axis) => {
      const line = lineOf(curve);
      if (line.least <= line.greatest) {
        least[axis] = Math.min(least[axis], line.least - around[axis]);
        greatest[axis] = Math.max(greatest[axis], line.greatest + around[axis]);
      }
    });
    const sizeOf = ({ least, greatest }) => length(least.map((low, axis) => greatest[axis] - low || 0));
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const around = (body) => axes.map((axis) => body.role === "object" || !body.parts.length ? body.radius : reachOf(body, axis));
    let all = box();
    for (const body of this.scene.bodies) if (body.role === "object" || body.role === "socket") take(all, body.pose, around(body));
    for (const hand of this.scene.hands) for (const finger of hand.fingers) take(all, finger.position, [0, 0, 0].fill(hand.radius));
    for (const hand of this.scene.hands) for (const link of hand.links) take(all, link.pose, around(link));
    const moving = sizeOf(all);
    // Walls and tables belong to the picture unless they are much larger than the motions.
    for (const body of this.scene.bodies.filter((one) => one.role !== "robot")) {
      const whole = { least: all.least.slice(), greatest: all.greatest.slice() };
      take(whole, body.pose, around(body));
      if (!(sizeOf(whole) > 1.45 * moving)) all = whole;
    }
    const { least, greatest } = all;
    // Hands come from above, so the upper part of the picture is kept for them.
    this.middle = least.map((low, axis) => low + (greatest[axis] - low) * (axis === 2 ? 0.4 : 0.5) || 0);
    this.size = Math.max(0.05, sizeOf(all));
    this.corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => this.middle.map((_, axis) => (corner >> axis & 1 ? greatest : least)[axis])).filter((corner) => corner.every(Number.isFinite));
    const forces = this.scene.hands.flatMap((hand) => [...hand.fingers, ...hand.contacts]).map((one) => one.force).filter(Boolean);
    // A knock is many times as strong as a grip, and lasts for a few frames: it must not make all other arrows short.
    const felt = [];
    for (let at = 0; at <= 300; at++) {
      const time = data.start + (data.end - data.start) * at / 300;
      for (const force of forces) {
        const strength = length(force.map((axis) => valueAt(axis, time)));
        if (strength > 0.02) felt.push(strength);
      }
    }
    felt.sort((a, b) => a - b);
    this.strong = felt.length ? felt[Math.floor(0.95 * (felt.length - 1))] : 0;
    this.perNewton = this.strong > 0 ? 0.2 * this.size / this.strong : 0;
  }

  /** The first view: of those from which links hide the least of hands and objects the one nearest to the usual one. */
  begin() {
    this.moments ??= this.scene.bodies.some((body) => body.role === "robot") ? momentsOf(this.scene, data.start, data.end) : [];
    let best, least = Infinity;
    for (const view of this.moments.length ? views() : [FIRST]) {
      this.fit(view);
      const hidden = this.hidden();
      if (hidden < least) [best, least] = [view, hidden];
    }
    this.fit(best);
  }

  /** The share of hands and objects that links hide in this view. */
  hidden() {
    return hiddenFrom(add(this.about, scale(this.axes().back, this.away)), this.moments);
  }

  /** Looks from a direction, as near as all that belongs to the picture is in it. */
  fit({ yaw, pitch }) {
    const wide = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight) || 1;
    Object.assign(this, { yaw, pitch, away: 1.3 * this.size / Math.min(1, wide), about: this.middle.slice() });
    const { right, up, back } = this.axes();
    for (let turn = 0; turn < 12; turn++) {
      const least = [Infinity, Infinity], greatest = [-Infinity, -Infinity];
      for (const corner of this.corners) {
        const from = add(corner, scale(add(this.about, scale(back, this.away)), -1)), far = Math.max(1e-6, -dot(from, back));
        [dot(from, right) / far, dot(from, up) / far].forEach((at, axis) => {
          least[axis] = Math.min(least[axis], at);
          greatest[axis] = Math.max(greatest[axis], at);
        });
      }
      if (!(least[0] < greatest[0])) return;
      // Half a picture is a third of the distance high; a tenth of it is left for names.
      const over = Math.max((greatest[0] - least[0]) / (0.6 * wide), (greatest[1] - least[1]) / 0.6);
      this.about = add(this.about, add(scale(right, (least[0] + greatest[0]) / 2 * this.away), scale(up, (least[1] + greatest[1]) / 2 * this.away)));
      this.away = Math.max(0.1 * this.size, this.away * over);
    }
  }

  listen() {
    const { canvas } = this;
    const held = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = held.get(event.pointerId);
      if (!last) return;
      const right = event.clientX - last[0], down = event.clientY - last[1];
      held.set(event.pointerId, [event.clientX, event.clientY]);
      if (event.shiftKey || held.size > 1) {
        const way = this.away / Math.max(1, canvas.clientHeight);
        const { right: across, up } = this.axes();
        this.about = add(this.about, add(scale(across, -right * way), scale(up, down * way)));
      } else {
        this.yaw -= right * 0.008;
        this.pitch = Math.min(1.55, Math.max(-0.6, this.pitch + down * 0.008));
      }
      this.draw();
    });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => held.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.away = Math.min(8 * this.size, Math.max(0.1 * this.size, this.away * Math.exp(event.deltaY * (event.deltaMode ? 0.03 : 0.0012))));
      this.draw();
    }, { passive: false });
    canvas.addEventListener("dblclick", () => { this.begin(); this.draw(); });
  }

  /** The directions of the view: right, up, and towards the eye. */
  axes() {
    const { yaw, pitch } = this;
    const back = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    return { right, up: cross(back, right), back };
  }

  show(time) {
    this.time = time;
    this.draw();
  }

  draw() {
    const { canvas, context, picture, scene, time } = this;
    const color = (name) => numbersIn(paint(name));
    const sharp = Math.max(2, Math.min(3, window.devicePixelRatio || 1));
    const width = Math.max(1, Math.round(canvas.clientWidth * sharp)), height = Math.max(1, Math.round(canvas.clientHeight * sharp));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const paper = color("--stage"), ink = color("--ink"), grey = color("--body"), edge = packed(color("--edge"));
    picture.clear(width, height, packed(paper));
    const { right, up, back } = this.axes();
    const eye = add(this.about, scale(back, this.away)), zoom = 1.5 * height, nearest = 0.02 * this.away;
    const seen = (point) => {
      const from = add(point, scale(eye, -1));
      return [dot(from, right), dot(from, up), -dot(from, back)];
    };
    const flat = ([x, y, z]) => [width / 2 + zoom * x / z, height / 2 - zoom * y / z, 1 / z];
    const onPicture = (point) => {
      const at = seen(point);
      return at[2] > nearest ? flat(at) : undefined;
    };
    const light = [-0.35, -0.55, 0.76];
    const lit = (base, much) => packed(base.map((part) => Math.min(255, Math.round(part * (0.58 + 0.42 * Math.max(0, much))))));
    const drawLine = (a, b, of, thick) => {
      let [from, to] = [seen(a), seen(b)];
      if (from[2] < nearest && to[2] < nearest) return;
      const cut = (inside, out) => {
        const share = (nearest - inside[2]) / (out[2] - inside[2]);
        return add(inside, scale(add(out, scale(inside, -1)), share));
      };
      if (from[2] < nearest) from = cut(to, from);
      if (to[2] < nearest) to = cut(from, to);
      picture.line(flat(from), flat(to), of, thick);
    };
    const drawFace = (corners, base) => {
      const eyes = corners.map(seen);
      const kept = [];
      eyes.forEach((from, at) => {
        const to = eyes[(at + 1) % eyes.length];
        if (from[2] >= nearest) kept.push(from);
        if ((from[2] >= nearest) !== (to[2] >= nearest)) {
          const share = (nearest - from[2]) / (to[2] - from[2]);
          kept.push(add(from, scale(add(to, scale(from, -1)), share)));
        }
      });
      if (kept.length < 3) return;
      const normal = cross(add(eyes[1], scale(eyes[0], -1)), add(eyes[2], scale(eyes[0], -1)));
      // To the right, down and towards the eye, on the side that is seen.
      const size = length(normal) || 1;
      let facing = [normal[0] / size, -normal[1] / size, -normal[2] / size];
      if (dot(facing, [eyes[0][0], -eyes[0][1], -eyes[0][2]]) > 0) facing = scale(facing, -1);
      picture.face(kept.map(flat), lit(base, dot(facing, light)));
    };
    const poseAt = (pose) => pose.map((curve) => valueAt(curve, time));
    const names = [];
    const bodies = new Map();
    for (const body of scene.bodies) {
      const [x, y, z, ...turn] = poseAt(body.pose);
      if (![x, y, z, ...turn].every(Number.isFinite)) continue;
      const rotation = rotationOf(turn.length ? turn : [1, 0, 0, 0]);
      const place = (point) => add(turned(rotation, point), [x, y, z]);
      bodies.set(body.name, { body, rotation, at: [x, y, z] });
      const middle = body.parts.length ? place(scale(body.parts.reduce((sum, part) => add(sum, part.at), [0, 0, 0]), 1 / body.parts.length)) : [x, y, z];
      // A wall between the eye and the middle of the scene, or a table above the eye, would hide its contents: only its edges are drawn.
      const before = dot(add(middle, scale(this.middle, -1)), back) > 0;
      const ghost = body.role === "wall" && before || body.role === "support" && this.pitch < 0.02;
      const base = body.color || grey;
      for (const face of body.faces) {
        const corners = face.corners.map(place);
        if (!ghost) drawFace(corners, base);
        for (const at of face.edges) drawLine(corners[at], corners[(at + 1) % corners.length], edge, Math.round(sharp * (body.color ? 0.75 : 0.5)) || 1);
      }
      for (const part of body.parts.filter((one) => one.shape === "ball")) {
        const center = onPicture(place(part.at));
        if (center) picture.ball(center, zoom * part.size[0] * center[2], part.size[0], light, (much) => lit(base, much));
      }
      if (!body.parts.length) this.rings([x, y, z], body.radius, rotation, (a, b) => drawLine(a, b, packed(base), Math.round(sharp)));
      if (body.role === "object") names.push([body.name, [x, y, z], undefined, body.radius * zoom]);
    }
    const overlays = [];
    for (const hand of scene.hands) this.hand(hand, bodies, { picture, zoom, light, lit, onPicture, drawLine, sharp, names, overlays, ink });
    picture.show();
    context.save();
    context.lineCap = "round";
    for (const overlay of overlays) overlay();
    this.write(names, onPicture, sharp);
    this.bar(zoom, sharp);
    context.restore();
  }

  /** A body with only a radius. */
  rings(center, radius, rotation, line) {
    for (const plane of [[0, 1], [1, 2], [0, 2]]) {
      const point = (at) => {
        const on = [0, 0, 0];
        on[plane[0]] = radius * Math.cos(at * Math.PI / 16);
        on[plane[1]] = radius * Math.sin(at * Math.PI / 16);
        return add(turned(rotation, on), center);
      };
      for (let at = 0; at < 32; at++) line(point(at), point(at + 1));
    }
  }

  hand(hand, bodies, { picture, zoom, light, lit, onPicture, drawLine, sharp, names, overlays, ink }) {
    const { time, context } = this;
    const track = this.tracks.find((one) => one.who === hand.side);
    const segment = track && segmentAt(track.relabeled, time);
    const hue = numbersIn(segment ? data.colors[segment[0]] : "#9aa4b2");
    const tips = [];
    for (const finger of hand.fingers) {
      const at = finger.position.map((curve) => valueAt(curve, time));
      if (!at.every(Number.isFinite)) continue;
      tips.push(at);
      const center = onPicture(at);
      if (!center) continue;
      const radius = zoom * hand.radius * center[2];
      picture.ball(center, radius, hand.radius, light, (much) => lit(hue, much));
      const touches = finger.touches !== null && isSo(finger.touches, time);
      overlays.push(() => {
        context.beginPath();
        context.arc(center[0], center[1], radius, 0, 2 * Math.PI);
        context.lineWidth = (touches ? 2.2 : 0.8) * sharp;
        context.strokeStyle = `rgba(${ink},${touches ? 1 : 0.5})`;
        context.stroke();
      });
      const force = finger.force && finger.force.map((curve) => valueAt(curve, time));
      if (force) this.arrow(add(at, scale(this.drawn(force), -1)), at, onPicture, "--force", sharp, overlays);
    }
    const palm = hand.palm && hand.palm.slice(0, 3).map((curve) => valueAt(curve, time));
    const root = palm && palm.every(Number.isFinite) ? palm : undefined;
    const mean = tips.length ? scale(tips.reduce(add, [0, 0, 0]), 1 / tips.length) : undefined;
    if (root) for (const tip of tips) drawLine(root, tip, lit(hue, 0.2), Math.round(1.5 * sharp));
    else if (tips.length > 1) for (const tip of tips) drawLine(mean, tip, lit(hue, 0.2), Math.round(1.5 * sharp));
    // The name of a robot's hand stands above its highest link.
    const links = hand.links.map((link) => bodies.get(link.name)?.at).filter((at) => at && onPicture(at));
    const highest = links.sort((a, b) => onPicture(a)[1] - onPicture(b)[1])[0];
    if (mean) names.push([`${hand.side}${segment ? `: ${segment[0]}` : ""}`, root || highest || mean, hand.side]);
    this.trail(hand, track, onPicture, sharp, overlays);
    const change = hand.target[lastNotAfter(hand.target, frameAt(time), (one) => one[0])];
    const target = change && bodies.get(this.scene.objects[change[1]]);
    for (const contact of target ? hand.contacts : []) {
      const force = contact.force.map((curve) => valueAt(curve, time));
      const normal = contact.normal.map((curve) => valueAt(curve, time));
      if (!force.every(Number.isFinite) || length(force) * this.perNewton < 1e-3 * this.size) continue;
      const out = length(normal) > 0.1 ? scale(normal, 1 / length(normal)) : scale(force, 1 / length(force));
      const { rotation, body, at } = target;
      const inBody = [0, 1, 2].map((axis) => -(rotation[0][axis] * out[0] + rotation[1][axis] * out[1] + rotation[2][axis] * out[2]));
      const touched = add(at, scale(out, -reachOf(body, inBody)));
      this.arrow(touched, add(touched, this.drawn(force)), onPicture, "--contact", sharp, overlays);
    }
  }

  /** The recent path of a hand, in the colors of its primitives. */
  trail(hand, track, onPicture, sharp, overlays) {
    const points = [];
    const led = hand.fingers.slice(0, 2);
    for (let at = 0; at <= 40; at++) {
      const time = this.time - TRAIL * (1 - at / 40);
      const sum = led.map((finger) => finger.position.map((curve) => valueAt(curve, time))).reduce(add, [0, 0, 0]);
      const place = sum.every(Number.isFinite) && time >= data.start ? onPicture(scale(sum, 1 / led.length)) : undefined;
      const segment = track && segmentAt(track.relabeled, time);
      points.push([place, segment ? data.colors[segment[0]] : "#9aa4b2"]);
    }
    overlays.push(() => {
      const { context } = this;
      context.lineWidth = 2 * sharp;
      points.forEach(([place, color], at) => {
        const last = at > 0 && points[at - 1][0];
        if (!last || !place) return;
        context.globalAlpha = at / 40;
        context.strokeStyle = color;
        context.beginPath();
        context.moveTo(last[0], last[1]);
        context.lineTo(place[0], place[1]);
        context.stroke();
      });
      context.globalAlpha = 1;
    });
  }

  /** The length of a force on the stage; beyond a limit all are alike. */
  drawn(force) {
    return scale(force, Math.min(this.perNewton, 0.35 * this.size / length(force) || 0));
  }

  /** How long the arrow of a round number of newtons is at the middle of the picture. */
  bar(zoom, sharp) {
    if (!this.perNewton) return;
    const { context, canvas } = this, perNewton = this.perNewton * zoom / this.away;
    const power = 10 ** Math.floor(Math.log10(70 * sharp / perNewton));
    const newtons = [5, 2, 1].map((factor) => factor * power).find((one) => one * perNewton <= 70 * sharp) || power;
    const y = canvas.height - 12 * sharp, x = 12 * sharp;
    context.strokeStyle = context.fillStyle = paint("--ink");
    context.lineWidth = 2 * sharp;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + newtons * perNewton, y);
    context.stroke();
    context.textAlign = "left";
    context.fillText(`${Number(newtons.toPrecision(1))} N`, x + newtons * perNewton + 6 * sharp, y + 4 * sharp);
  }

  arrow(from, to, onPicture, color, sharp, overlays) {
    if (!(length(add(to, scale(from, -1))) > 0.012 * this.size)) return;
    const [a, b] = [onPicture(from), onPicture(to)];
    if (!a || !b) return;
    overlays.push(() => {
      const { context } = this;
      const way = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1, head = Math.min(7 * sharp, 0.5 * way);
      const [right, down] = [(b[0] - a[0]) / way, (b[1] - a[1]) / way];
      context.strokeStyle = context.fillStyle = paint(color);
      context.lineWidth = 2.2 * sharp;
      context.beginPath();
      context.moveTo(a[0], a[1]);
      context.lineTo(b[0] - right * head * 0.8, b[1] - down * head * 0.8);
      context.stroke();
      context.beginPath();
      context.moveTo(b[0], b[1]);
      context.lineTo(b[0] - right * head - down * head * 0.5, b[1] - down * head + right * head * 0.5);
      context.lineTo(b[0] - right * head + down * head * 0.5, b[1] - down * head - right * head * 0.5);
      context.fill();
    });
  }

  write(names, onPicture, sharp) {
    const { context } = this;
    context.font = `${12 * sharp}px ${paint("--font")}`;
    context.lineJoin = "round";
    for (const [name, point, side, below] of names) {
      const at = onPicture(point);
      if (!at) continue;
      context.lineWidth = 3 * sharp;
      context.strokeStyle = paint("--stage");
      context.fillStyle = paint("--ink");
      // Two hands that meet are named to the left and to the right, an object below itself.
      const apart = side && this.scene.hands.length > 1 ? (side === "left" ? -1 : 1) : 0;
      context.textAlign = apart < 0 ? "right" : apart > 0 ? "left" : "center";
      const wide = context.measureText(name).width, edge = 4 * sharp;
      const wanted = at[0] + 6 * apart * sharp, left = wanted - wide * (1 - apart) / 2;
      // A name at the edge is moved into the picture.
      const x = wanted + Math.max(0, edge - left) + Math.min(0, this.canvas.width - edge - left - wide);
      const y = Math.max(16 * sharp, at[1] + (side ? -14 * sharp : 0.8 * below * at[2] + 12 * sharp));
      context.strokeText(name, x, y);
      context.fillText(name, x, y);
    }
  }
}

/** The frame at a time. */
function frameAt(time) {
  const at = Math.max(0, lastNotAfter(data.stretches, time + step / 2, (stretch) => stretch[2]));
  const stretch = data.stretches[at];
  return stretch ? Math.min(stretch[1] - 1, stretch[0] + Math.floor((time - stretch[2]) / step + 0.5)) : 0;
}
