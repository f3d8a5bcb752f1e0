// Vectors, quaternions w x y z and matrices by columns, in the reference frame: z up, meters.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, by) => [a[0] * by, a[1] * by, a[2] * by];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const unit = (a) => scale(a, 1 / (length(a) || 1));
export const mix = (a, b, share) => a.map((one, at) => one + (b[at] - one) * share);
export const clamp = (value, least, most) => Math.min(most, Math.max(least, value));

export const about = (axis, angle) => [Math.cos(angle / 2), ...scale(unit(axis), Math.sin(angle / 2))];
export const times = ([a, b, c, d], [w, x, y, z]) =>
  [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w];
export const turn = ([w, x, y, z], v) => {
  const t = scale(cross([x, y, z], v), 2);
  return add(add(v, scale(t, w)), cross([x, y, z], t));
};
export const back = ([w, x, y, z]) => [w, -x, -y, -z];

/** The matrix of a position and a rotation, with a size along each axis. */
export function placed(at, quaternion, size = [1, 1, 1]) {
  const [x, y, z] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis, which) => scale(turn(quaternion, axis), size[which]));
  return new Float32Array([...x, 0, ...y, 0, ...z, 0, ...at, 1]);
}

/** The matrix that maps a shape of length 1 along z to the line from one point to another. */
export function between(from, to, radius) {
  const way = sub(to, from), far = length(way) || 1e-6, along = scale(way, 1 / far);
  const side = unit(cross(Math.abs(along[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], along));
  const other = cross(along, side), middle = scale(add(from, to), 0.5);
  return new Float32Array([...scale(side, radius), 0, ...scale(other, radius), 0, ...scale(along, far), 0, ...middle, 1]);
}

export function product(a, b) {
  const of = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let at = 0; at < 4; at++) sum += a[at * 4 + row] * b[column * 4 + at];
      of[column * 4 + row] = sum;
    }
  }
  return of;
}

/** What a camera sees: `tall` is the tangent of half its height. */
export function lens(tall, wide, near, far) {
  return new Float32Array([1 / (tall * wide), 0, 0, 0, 0, 1 / tall, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0, 2 * near * far / (near - far), 0]);
}

/** The frame of a camera at `eye` with these directions to the right, up and backwards. */
export function view(eye, right, up, behind) {
  return new Float32Array([right[0], up[0], behind[0], 0, right[1], up[1], behind[1], 0, right[2], up[2], behind[2], 0, -dot(right, eye), -dot(up, eye), -dot(behind, eye), 1]);
}
