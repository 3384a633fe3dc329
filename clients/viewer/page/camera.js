// Where the map is looked at from: round a target, or straight from above without perspective.

import { add, clamp, cross, dot, multiply, normalize, orthographic, perspective, scale, subtract, viewOf } from "./vector.js";

const FIELD_OF_VIEW = 0.85;
const PITCH_MAX = 1.55;
const DISTANCE_MIN = 0.05;
const DISTANCE_MAX = 200_000;
/** What is looked at as a whole is no nearer than this, and has a margin around it. */
const FRAME_MIN_M = 1;
const FRAME_MARGIN = 1.04;

export class Camera {
  target = [0, 0, 0];
  distance = 20;
  yaw = -2.1;
  pitch = 0.75;
  isTop = false;
  /** How far the map reaches from the target; what is farther is not drawn. */
  reach = 100;
  /** Width by height of the picture. */
  aspect = 1;
  /** Where in the picture the target is drawn, -1 to 1: the middle of what the panels leave. */
  middle = [0, 0];

  /** Right, up and forward in the map. */
  axes() {
    const pitch = this.isTop ? Math.PI / 2 : this.pitch;
    const level = [Math.cos(this.yaw), Math.sin(this.yaw), 0];
    const forward = this.isTop ? [0, 0, -1] : normalize([-level[0] * Math.cos(pitch), -level[1] * Math.cos(pitch), -Math.sin(pitch)]);
    const right = normalize([-level[1], level[0], 0]);
    return { right, up: cross(right, forward), forward };
  }

  eye() {
    return subtract(this.target, scale(this.axes().forward, this.distance));
  }

  /** For shaders: the eye, or without perspective the direction towards it, told apart by the fourth number. */
  towardsEye(origin) {
    return this.isTop ? [0, 0, 1, 0] : [...subtract(this.eye(), origin), 1];
  }

  /** From the map, moved so that `origin` is 0, to clip space. */
  clipFromMap(origin) {
    const view = viewOf(subtract(this.eye(), origin), this.axes());
    const far = this.distance + this.reach;
    const seen = this.isTop
      ? orthographic(this.height(), this.aspect, this.distance - this.reach, far)
      : perspective(FIELD_OF_VIEW, this.aspect, clamp(this.distance / 200, 0.01, 5), far);
    const matrix = multiply(seen, view);
    for (let column = 0; column < 16; column += 4) {
      for (const axis of [0, 1]) matrix[column + axis] += this.middle[axis] * matrix[column + 3];
    }
    return matrix;
  }

  /** Meters that the picture is high at the target. */
  height() {
    return 2 * this.distance * Math.tan(FIELD_OF_VIEW / 2);
  }

  /** Pixels that a meter takes up at a distance, of a picture so many pixels high. */
  pixelsPerMeter(distance, pixelsHigh) {
    const height = this.isTop ? this.height() : 2 * distance * Math.tan(FIELD_OF_VIEW / 2);
    return pixelsHigh / height;
  }

  /** The ray through a point of the picture, -1 to 1 from left to right and from bottom to top. */
  ray(place) {
    const { right, up, forward } = this.axes();
    const [x, y] = this.#fromMiddle(place);
    const half = Math.tan(FIELD_OF_VIEW / 2);
    const aside = add(scale(right, x * half * this.aspect), scale(up, y * half));
    if (!this.isTop) return { origin: this.eye(), direction: normalize(add(forward, aside)) };
    const origin = add(this.target, add(scale(aside, this.distance), scale(forward, -this.reach)));
    return { origin, direction: forward };
  }

  orbit(turn, tilt) {
    this.yaw += turn;
    this.pitch = clamp(this.pitch + tilt, -PITCH_MAX, PITCH_MAX);
  }

  /** Moves the target by parts of the picture's height, to the right and up. */
  pan(x, y) {
    const { right, up } = this.axes();
    this.target = add(this.target, add(scale(right, x * this.height()), scale(up, y * this.height())));
  }

  /** Comes nearer or goes farther; what is at `place`, -1 to 1 in the picture, stays there, as deep as the target. */
  zoom(by, place = this.middle) {
    const { right, up } = this.axes();
    const [x, y] = this.#fromMiddle(place);
    const half = this.distance * Math.tan(FIELD_OF_VIEW / 2);
    this.zoomTo(add(this.target, add(scale(right, x * half * this.aspect), scale(up, y * half))), by);
  }

  /** Comes nearer to a point of the map or goes farther from it; it stays where it is in the picture. */
  zoomTo(point, by) {
    const { forward } = this.axes();
    const eye = this.eye();
    const depth = this.isTop ? this.distance : Math.max(dot(subtract(point, eye), forward), DISTANCE_MIN);
    this.distance = clamp(depth * by, DISTANCE_MIN, DISTANCE_MAX);
    const share = this.distance / depth;
    // From above the height of the target is not seen; it becomes that of the point, for when the camera tilts again.
    if (this.isTop) this.target = [0, 1].map((axis) => point[axis] + (this.target[axis] - point[axis]) * share).concat(point[2]);
    else this.target = add(add(point, scale(subtract(eye, point), share)), scale(forward, this.distance));
  }

  /** Looks at a box so that it fills the part of the picture from `min` to `max`, -1 to 1. */
  frame(box, { min, max }) {
    this.middle = [0, 1].map((axis) => (min[axis] + max[axis]) / 2);
    const room = [0, 1].map((axis) => ((max[axis] - min[axis]) / 2) * Math.tan(FIELD_OF_VIEW / 2));
    const { right, up, forward } = this.axes();
    this.target = scale(add(box.min, box.max), 0.5);
    let distance = FRAME_MIN_M;
    for (let corner = 0; corner < 8; corner++) {
      const at = [0, 1, 2].map((axis) => ((corner >> axis) & 1 ? box.max : box.min)[axis] - this.target[axis]);
      const deep = this.isTop ? 0 : dot(at, forward);
      const aside = Math.abs(dot(at, right)) / (room[0] * this.aspect);
      distance = Math.max(distance, aside - deep, Math.abs(dot(at, up)) / room[1] - deep);
    }
    this.distance = clamp(distance * FRAME_MARGIN, DISTANCE_MIN, DISTANCE_MAX);
  }

  #fromMiddle([x, y]) {
    return [x - this.middle[0], y - this.middle[1]];
  }
}
