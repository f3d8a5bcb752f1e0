// The scene in three dimensions by WebGL 2: boxes, cylinders and balls, their shadows straight below them, and arrows.

import { add, back, between, clamp, cross, dot, length, lens, placed, product, scale, sub, times, turn, unit, view } from "./space.js";

const VERTEX = `#version 300 es
uniform mat4 eye, model; uniform float flat_at;
in vec3 point, normal; out vec3 facing, place;
void main() {
  vec4 at = model * vec4(point, 1.0);
  if (flat_at > -1e3) at.z = flat_at;
  place = at.xyz;
  facing = mat3(model) * normal;
  gl_Position = eye * at;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 color, room; uniform float shaded;
in vec3 facing, place; out vec4 pixel;
void main() {
  if (shaded < -0.5 && (place.x < room.x || place.y < room.y || place.x > room.z || place.y > room.w)) discard;
  float light = 1.0;
  if (shaded > 0.5) {
    vec3 n = normalize(facing);
    light = 0.56 + 0.34 * max(0.0, dot(n, normalize(vec3(-0.35, -0.5, 0.8)))) + 0.14 * max(0.0, dot(n, normalize(vec3(0.7, -0.3, 0.2))));
  }
  pixel = vec4(color.rgb * light * color.a, color.a);
}`;

/** Points and normals of shapes of size 1: a box, a cylinder along z, a ball, a cone along z. */
function shapes() {
  const box = [], cylinder = [], ball = [], cone = [];
  for (const axis of [0, 1, 2]) {
    for (const sign of [-1, 1]) {
      const corner = (a, b) => {
        const point = [0, 0, 0], normal = [0, 0, 0];
        point[axis] = sign / 2;
        point[(axis + 1) % 3] = a / 2;
        point[(axis + 2) % 3] = b / 2;
        normal[axis] = sign;
        return [...point, ...normal];
      };
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) box.push(...corner(a, b));
    }
  }
  const count = 32, rim = (at) => [Math.cos(2 * Math.PI * at / count), Math.sin(2 * Math.PI * at / count)];
  for (let at = 0; at < count; at++) {
    const [a, b] = [rim(at), rim(at + 1)];
    const side = ([x, y], z) => [x, y, z, x, y, 0];
    cylinder.push(...side(a, -0.5), ...side(b, -0.5), ...side(b, 0.5), ...side(a, -0.5), ...side(b, 0.5), ...side(a, 0.5));
    for (const z of [-0.5, 0.5]) for (const [x, y] of [[0, 0], a, b]) cylinder.push(x, y, z, 0, 0, 2 * z);
    for (const [x, y, z] of [[...a, -0.5], [...b, -0.5], [0, 0, 0.5]]) cone.push(x, y, z, z > 0 ? (a[0] + b[0]) / 2 : x, z > 0 ? (a[1] + b[1]) / 2 : y, 0.5);
    for (const [x, y] of [[0, 0], a, b]) cone.push(x, y, -0.5, 0, 0, -1);
  }
  const on = (at, high) => {
    const tall = Math.PI * high / 16, [x, y] = rim(at), point = [x * Math.sin(tall), y * Math.sin(tall), Math.cos(tall)];
    return [...point, ...point];
  };
  for (let high = 0; high < 16; high++) {
    for (let at = 0; at < count; at++) ball.push(...on(at, high), ...on(at + 1, high), ...on(at + 1, high + 1), ...on(at, high), ...on(at + 1, high + 1), ...on(at, high + 1));
  }
  const edges = [];
  for (const axis of [0, 1, 2]) {
    for (const [a, b] of [[-1, -1], [-1, 1], [1, -1], [1, 1]]) {
      for (const end of [-0.5, 0.5]) {
        const point = [0, 0, 0];
        point[axis] = end;
        point[(axis + 1) % 3] = a / 2;
        point[(axis + 2) % 3] = b / 2;
        edges.push(...point, 0, 0, 1);
      }
    }
  }
  const ring = [];
  for (let at = 0; at < count; at++) ring.push(...rim(at), 0, 0, 0, 1, ...rim(at + 1), 0, 0, 0, 1);
  return { box, cylinder, ball, cone, edges, ring };
}

/** Objects differ in hue and lightness, as in the report. */
const OBJECTS = ["#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#d55e00"];
/** The tangent of half the height of the view. */
const TALL = 0.36;
const SKIN = { right: [0.87, 0.66, 0.53], left: [0.66, 0.73, 0.87] };
export const rgb = (color) => [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16) / 255);

export class Stage {
  constructor(canvas, scene) {
    this.canvas = canvas;
    this.scene = scene;
    const gl = this.gl = canvas.getContext("webgl2", { antialias: true, stencil: true, xrCompatible: true });
    if (!gl) throw new Error("This browser lacks WebGL 2, with which the scene is drawn.");
    const compiled = (kind, text) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      return shader;
    };
    const program = this.program = gl.createProgram();
    gl.attachShader(program, compiled(gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, FRAGMENT));
    gl.bindAttribLocation(program, 0, "point");
    gl.bindAttribLocation(program, 1, "normal");
    gl.linkProgram(program);
    gl.useProgram(program);
    this.at = Object.fromEntries(["eye", "model", "color", "shaded", "flat_at", "room"].map((name) => [name, gl.getUniformLocation(program, name)]));
    this.shapes = {};
    for (const [name, numbers] of Object.entries(shapes())) {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STATIC_DRAW);
      for (const [at, offset] of [[0, 0], [1, 12]]) {
        gl.enableVertexAttribArray(at);
        gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 24, offset);
      }
      this.shapes[name] = { array, count: numbers.length / 6, lines: name === "edges" || name === "ring" };
    }
    let objects = 0;
    for (const body of scene.bodies) body.color = body.role === "object" ? rgb(OBJECTS[objects++ % OBJECTS.length]) : undefined;
    this.measure();
    this.theme();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.theme());
  }

  theme() {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => rgb(style.getPropertyValue(name).trim());
    this.paint = { stage: of("--stage"), body: of("--body"), edge: of("--edge"), ink: of("--ink"), force: of("--force"), one: of("--one") };
    this.dark = matchMedia("(prefers-color-scheme: dark)").matches;
  }

  /** Where the scene is, and the face on which shadows fall. */
  measure() {
    const reach = (body, part) => {
      const [a, b, c] = part.size, own = part.shape === "box" ? [a / 2, b / 2, c / 2] : part.shape === "cylinder" ? [a, a, b / 2] : [a, a, a];
      const q = times(body.pose.slice(3), part.turned), half = [0, 0, 0];
      own.forEach((size, axis) => {
        const way = turn(q, [0, 1, 2].map((at) => (at === axis ? size : 0)));
        for (const at of [0, 1, 2]) half[at] += Math.abs(way[at]);
      });
      return { at: add(body.pose.slice(0, 3), turn(body.pose.slice(3), part.at)), half };
    };
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    let ground = { area: 0, z: 0, room: [-9, -9, 9, 9] };
    for (const body of this.scene.bodies) {
      for (const part of body.parts) {
        const { at, half } = reach(body, part);
        if (body.role === "object" || body.role === "socket") {
          for (const axis of [0, 1, 2]) {
            low[axis] = Math.min(low[axis], at[axis] - half[axis]);
            high[axis] = Math.max(high[axis], at[axis] + half[axis]);
          }
        }
        if (body.role === "support" && half[0] * half[1] > ground.area) {
          ground = { area: half[0] * half[1], z: at[2] + half[2], room: [at[0] - half[0], at[1] - half[1], at[0] + half[0], at[1] + half[1]] };
        }
      }
    }
    if (!(low[0] < high[0])) for (const axis of [0, 1, 2]) [low[axis], high[axis]] = [-0.2, 0.2];
    this.low = low;
    this.high = high;
    this.ground = ground;
  }

  /** The view of the beginning: from the front and above, where the person would stand. */
  begin() {
    const middle = scale(add(this.low, this.high), 0.5);
    const wide = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight) || 1;
    const size = Math.max(0.34, length(sub(this.high, this.low)));
    this.camera = { yaw: -Math.PI / 2 + 0.32, pitch: 0.6, away: 2.05 * size / Math.min(1, wide * 0.85), about: [middle[0], middle[1], this.ground.z + 0.09] };
  }

  axes() {
    const { yaw, pitch, away, about } = this.camera;
    const behind = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    return { right, up: cross(behind, right), behind, eye: add(about, scale(behind, away)) };
  }

  /** The ray of the view through a point of the canvas. */
  ray(x, y) {
    const { right, up, behind, eye } = this.axes(), { clientWidth, clientHeight } = this.canvas;
    const wide = TALL * clientWidth / Math.max(1, clientHeight);
    const way = add(add(scale(right, (2 * x / clientWidth - 1) * wide), scale(up, (1 - 2 * y / clientHeight) * TALL)), scale(behind, -1));
    return { eye, way: unit(way) };
  }

  /** Where a point is on the canvas; `undefined` behind the eye. */
  onCanvas(point) {
    const { right, up, behind, eye } = this.axes(), { clientWidth, clientHeight } = this.canvas, from = sub(point, eye);
    const deep = -dot(from, behind);
    if (deep < 0.01) return undefined;
    return [clientWidth / 2 + dot(from, right) / deep / TALL * clientHeight / 2, clientHeight / 2 - dot(from, up) / deep / TALL * clientHeight / 2];
  }

  put(shape, model, color, alpha = 1, shaded = 1) {
    const { gl, at } = this, { array, count, lines } = this.shapes[shape];
    gl.bindVertexArray(array);
    gl.uniformMatrix4fv(at.model, false, model);
    gl.uniform4f(at.color, ...color, alpha);
    gl.uniform1f(at.shaded, lines ? 0 : shaded);
    gl.drawArrays(lines ? gl.LINES : gl.TRIANGLES, 0, count);
  }

  /** Draws on the canvas. */
  draw(state, more) {
    const { canvas, gl } = this, sharp = Math.min(2, devicePixelRatio || 1);
    const width = Math.max(1, Math.round(canvas.clientWidth * sharp)), height = Math.max(1, Math.round(canvas.clientHeight * sharp));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const { right, up, behind, eye } = this.axes();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.clear();
    this.paintView(product(lens(TALL, width / height, 0.02, 20), view(eye, right, up, behind)), [0, 0, width, height], state, more, behind);
  }

  clear() {
    const { gl } = this;
    gl.clearColor(...this.paint.stage, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
  }

  /** Draws the view of one eye, by its matrix, into a part of the picture; it looks against `behind`. */
  paintView(matrix, port, state, more, behind) {
    const { gl, at } = this;
    gl.viewport(...port);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(at.eye, false, matrix);
    gl.uniform1f(at.flat_at, -1e6);
    gl.uniform4f(at.room, ...this.ground.room);
    const walls = [];
    this.scene.bodies.forEach((body, index) => {
      if (body.role === "wall") walls.push([body, index]);
      else this.body(body, state.bodies[index] || body.pose, 1);
    });
    this.shadows(state);
    for (const [index, hand] of state.hands.entries()) this.hand(this.scene.hands[index], hand, index === more.active, more);
    for (const arrow of more.arrows) this.arrow(...arrow);
    this.guide(state, more);
    // Walls are glass: what is behind them is seen.
    gl.depthMask(false);
    for (const [body, index] of walls) {
      const pose = state.bodies[index] || body.pose, isBefore = dot(sub(pose.slice(0, 3), scale(add(this.low, this.high), 0.5)), behind) > 0;
      this.body(body, pose, isBefore ? 0.1 : 0.3);
    }
    gl.depthMask(true);
  }

  body(body, pose, alpha) {
    const at = pose.slice(0, 3), q = pose.slice(3);
    for (const part of body.parts) {
      const place = add(at, turn(q, part.at)), turned = times(q, part.turned), [a, b, c] = part.size;
      const [shape, size] = part.shape === "box" ? ["box", [a, b, c]] : part.shape === "cylinder" ? ["cylinder", [a, a, b]] : ["ball", [a, a, a]];
      this.put(shape, placed(place, turned, size), body.color || this.paint.body, alpha);
      if (shape === "box") this.put("edges", placed(place, turned, scale(size, 1.001)), this.paint.edge, 0.8);
    }
  }

  /** Shadows of objects and hands straight below them, each place dark once. */
  shadows(state) {
    const { gl, at } = this;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    gl.uniform1f(at.flat_at, this.ground.z + 0.0006);
    const dark = [0, 0, 0], alpha = this.dark ? 0.42 : 0.26;
    this.scene.bodies.forEach((body, index) => {
      if (body.role !== "object") return;
      const pose = state.bodies[index] || body.pose;
      for (const part of body.parts) {
        const place = add(pose.slice(0, 3), turn(pose.slice(3), part.at)), [a, b, c] = part.size;
        const [shape, size] = part.shape === "box" ? ["box", [a, b, c]] : part.shape === "cylinder" ? ["cylinder", [a, a, b]] : ["ball", [a, a, a]];
        this.put(shape, placed(place, times(pose.slice(3), part.turned), size), dark, alpha, -1);
      }
    });
    state.hands.forEach((hand, index) => {
      const radius = this.scene.hands[index].radius;
      for (const tip of hand.tips) this.put("ball", placed(tip, [1, 0, 0, 0], [radius, radius, radius]), dark, alpha, -1);
      this.put("ball", placed(hand.palm.slice(0, 3), hand.palm.slice(3), [0.036, 0.034, 0.0125]), dark, alpha * 0.7, -1);
    });
    gl.uniform1f(at.flat_at, -1e6);
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
  }

  /** A palm, and fingers with two links each that end in the fingertips. */
  hand(of, hand, isActive, more) {
    const at = hand.palm.slice(0, 3), q = hand.palm.slice(3), skin = more.colors[of.side] || SKIN[of.side];
    const dim = isActive ? 1 : 0.75, base = scale(skin, dim), joint = scale(skin, dim * 0.86);
    this.put("ball", placed(at, q, [0.036, 0.034, 0.0125]), base);
    hand.tips.forEach((tip, index) => {
      const inPalm = turn(back(q), sub(tip, at));
      const knuckle = add(at, turn(q, [clamp(inPalm[0], -0.034, 0.034), clamp(inPalm[1] * 0.45, -0.026, 0.026), -0.003]));
      const far = length(sub(tip, knuckle)), link = Math.max(0.056, far / 2 + 0.002), bend = Math.sqrt(Math.max(0, link * link - far * far / 4));
      const outward = turn(q, [0, Math.sign(inPalm[1]) || 1, 0.35]);
      const way = unit(sub(tip, knuckle)), across = unit(sub(outward, scale(way, dot(outward, way))));
      const middle = add(scale(add(knuckle, tip), 0.5), scale(across, bend));
      this.put("cylinder", between(knuckle, middle, 0.0065), base);
      this.put("cylinder", between(middle, tip, 0.0055), base);
      this.put("ball", placed(middle, [1, 0, 0, 0], [0.0075, 0.0075, 0.0075]), joint);
      const strength = Math.min(1, length(hand.forces[index]) / 3), radius = of.radius;
      const color = strength > 0 ? [0, 1, 2].map((part) => base[part] + (this.paint.force[part] - base[part]) * (0.25 + 0.75 * strength)) : base;
      this.put("ball", placed(tip, [1, 0, 0, 0], [radius, radius, radius]), color);
    });
  }

  /** From the middle of the fingertips of the active hand straight down: where it would go. */
  guide(state, more) {
    const hand = state.hands[more.active];
    if (!hand) return;
    const middle = scale(hand.tips.reduce(add, [0, 0, 0]), 1 / hand.tips.length), ground = this.ground.z + 0.001;
    const foot = [middle[0], middle[1], ground];
    if (middle[2] > ground) this.put("cylinder", between(foot, middle, 0.0007), this.paint.one, 0.8, 0);
    this.put("ring", placed(foot, [1, 0, 0, 0], [0.012, 0.012, 1]), this.paint.one);
    if (more.target && length(sub(more.target, hand.palm.slice(0, 3))) > 0.015) {
      this.put("ring", placed(more.target, [1, 0, 0, 0], [0.03, 0.03, 1]), this.paint.one, 0.9);
    }
  }

  arrow(from, to, color) {
    const far = length(sub(to, from));
    if (far < 0.004) return;
    const head = Math.min(0.014, far / 2), neck = add(to, scale(sub(from, to), head / far));
    this.put("cylinder", between(from, neck, 0.0018), color, 1, 0);
    this.put("cone", between(neck, to, 0.0052), color, 1, 0);
  }
}
