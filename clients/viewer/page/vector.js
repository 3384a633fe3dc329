// Vectors of three numbers, quaternions, and 4 x 4 matrices in WebGL's column order.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, by) => [a[0] * by, a[1] * by, a[2] * by];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const normalize = (a) => scale(a, 1 / (length(a) || 1));
export const clamp = (value, least, most) => Math.min(Math.max(value, least), most);

/** The vector turned by a unit quaternion x y z w. */
export function rotate([x, y, z, w], vector) {
  const twice = scale(cross([x, y, z], vector), 2);
  return add(add(vector, scale(twice, w)), cross([x, y, z], twice));
}

/** The product of two matrices: what `b` does, and then `a`. */
export function multiply(a, b) {
  const product = new Float64Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let i = 0; i < 4; i++) sum += a[i * 4 + row] * b[column * 4 + i];
      product[column * 4 + row] = sum;
    }
  }
  return product;
}

/** From the frame of an eye that looks along its -z to clip space. */
export function perspective(fieldOfView, aspect, near, far) {
  const focal = 1 / Math.tan(fieldOfView / 2);
  const depth = 1 / (near - far);
  return [focal / aspect, 0, 0, 0, 0, focal, 0, 0, 0, 0, (near + far) * depth, -1, 0, 0, 2 * near * far * depth, 0];
}

/** The same without perspective: `height` is what the picture is high. */
export function orthographic(height, aspect, near, far) {
  const depth = 1 / (near - far);
  return [2 / (height * aspect), 0, 0, 0, 0, 2 / height, 0, 0, 0, 0, 2 * depth, 0, 0, 0, (near + far) * depth, 1];
}

/** From the map to the frame of an eye with these axes. */
export function viewOf(eye, { right, up, forward }) {
  return [
    right[0], up[0], -forward[0], 0,
    right[1], up[1], -forward[1], 0,
    right[2], up[2], -forward[2], 0,
    -dot(right, eye), -dot(up, eye), dot(forward, eye), 1,
  ];
}
