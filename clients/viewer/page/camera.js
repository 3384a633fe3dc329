// Where the map is looked at from: round a target, or straight from above without perspective.

import { add, clamp, cross, multiply, normalize, orthographic, perspective, scale, subtract, viewOf } from "./vector.js";

const FIELD_OF_VIEW = 0.85;
const PITCH_MAX = 1.55;
const DISTANCE_MIN = 0.05;
const DISTANCE_MAX = 200_000;

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
    if (this.isTop) return multiply(orthographic(this.height(), this.aspect, this.distance - this.reach, far), view);
    return multiply(perspective(FIELD_OF_VIEW, this.aspect, clamp(this.distance / 200, 0.01, 5), far), view);
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
  ray([x, y]) {
    const { right, up, forward } = this.axes();
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

  /** Comes nearer or goes farther; what is at `place`, -1 to 1 in the picture, stays there. */
  zoom(by, place = [0, 0]) {
    const before = this.distance;
    this.distance = clamp(before * by, DISTANCE_MIN, DISTANCE_MAX);
    const gone = (before - this.distance) * Math.tan(FIELD_OF_VIEW / 2);
    const { right, up } = this.axes();
    this.target = add(this.target, add(scale(right, place[0] * gone * this.aspect), scale(up, place[1] * gone)));
  }

  /** Looks at a box so that it fills the picture, or this share of its width. */
  frame({ min, max }, share = 1) {
    this.target = scale(add(min, max), 0.5);
    const size = Math.max(1, Math.hypot(...subtract(max, min)));
    this.distance = clamp((size * 0.85) / Math.min(1, this.aspect * share), DISTANCE_MIN, DISTANCE_MAX);
  }
}
