// What lies over the voxels: trajectories, robots, keep-outs, the grid; each as one shape.

import { rgba, robotColor, theme } from "./palette.js";
import { meters, roundDown } from "./format.js";
import { Shape } from "./shapes.js";
import { add, rotate, scale } from "./vector.js";

/** A gap of a trajectory: the robot was carried, or its scans were undone. */
const GAP_M = 25;

export function paths(robots, arrivals) {
  const shape = new Shape();
  const last = new Map();
  for (const { robot, position } of robots.steps) {
    const before = last.get(robot);
    if (before && Math.hypot(...before.map((value, axis) => value - position[axis])) < GAP_M) {
      shape.line(before, position, rgba(robotColor(arrivals.placeOf(robot))));
    }
    last.set(robot, position);
  }
  return shape;
}

const REFUSED_SHOWN = 30;

/** The last scans of robots that were refused, the newest of them, where their guesses put them; with lines to the poses that are as likely. */
export function refusedScans(events, size) {
  const shape = new Shape();
  const color = rgba(theme().refused);
  // Only what was refused has points.
  const refused = Array.from(events.last.values()).filter(({ guess, sample }) => guess && sample?.length > 0);
  for (const { guess, sample, answer } of refused.slice(-REFUSED_SHOWN)) {
    shape.marker(guess.translation_m, 1.5 * size, color);
    for (const { map_from_sensor: rival } of answer?.rivals ?? []) {
      shape.line(guess.translation_m, rival.translation_m, color);
      shape.marker(rival.translation_m, 1.5 * size, color);
    }
    for (const point of sample) shape.marker(add(guess.translation_m, rotate(guess.rotation_xyzw, point)), size / 2, color);
  }
  return shape;
}

export function robotMarkers(robots, arrivals, size) {
  const shape = new Shape();
  for (const [robot, { position, rotation }] of robots.seen) {
    const color = rgba(robotColor(arrivals.placeOf(robot)));
    shape.marker(position, size, color);
    // The sensor's own axes: where it faces depends on the sensor.
    [[1, 0, 0], [0, 1, 0], [0, 0, 1]].forEach((axis, i) => {
      shape.line(position, add(position, scale(rotate(rotation, axis), 3 * size)), AXES[i]);
    });
  }
  return shape;
}

const AXES = [rgba("#d9423a"), rgba("#3a9d4a"), rgba("#3a6fd9")];

export function keepOutShapes(keepOuts) {
  const shape = new Shape();
  const [edge, face] = [rgba(theme().keepOut), rgba(theme().keepOut, 0.16)];
  for (const keepOut of keepOuts) addRegion(shape, keepOut, edge, face);
  return shape;
}

/** Adds a box, sphere, oriented box or prism as JSON has it. */
export function addRegion(shape, { box, sphere, oriented_box: oriented, prism }, edge, face) {
  if (box) shape.box((at) => at.map((value, axis) => (value > 0 ? box.max_m : box.min_m)[axis]), edge, face);
  if (sphere) shape.sphere(sphere.center_m, sphere.radius_m, edge, face);
  if (prism) shape.prism(prism.corners_m, [prism.z_from_m, prism.z_to_m], edge, face);
  if (oriented) {
    const { translation_m, rotation_xyzw } = oriented.map_from_box;
    const half = scale(oriented.size_m, 0.5);
    shape.box((at) => add(translation_m, rotate(rotation_xyzw, at.map((value, axis) => value * half[axis]))), edge, face);
  }
}

/** The middle of the top of a region, where its name stands. */
export function topOf({ box, sphere, oriented_box: oriented, prism }) {
  if (box) return [(box.min_m[0] + box.max_m[0]) / 2, (box.min_m[1] + box.max_m[1]) / 2, box.max_m[2]];
  if (sphere) return add(sphere.center_m, [0, 0, sphere.radius_m]);
  if (oriented) return oriented.map_from_box.translation_m;
  const middle = [0, 1].map((axis) => prism.corners_m.reduce((sum, corner) => sum + corner[axis], 0) / prism.corners_m.length);
  return [...middle, prism.z_to_m];
}

/** Lines on the floor of the map, and its axes. */
export function grid(bounds) {
  const shape = new Shape();
  const color = rgba(theme().grid);
  const size = Math.max(...[0, 1].map((axis) => bounds.max[axis] - bounds.min[axis]), 1);
  const step = roundDown(size / 8);
  const from = bounds.min.map((value) => (Math.floor(value / step) - 1) * step);
  const to = bounds.max.map((value) => (Math.ceil(value / step) + 1) * step);
  const floor = bounds.min[2];
  for (let x = from[0]; x <= to[0] + step / 2; x += step) shape.line([x, from[1], floor], [x, to[1], floor], color);
  for (let y = from[1]; y <= to[1] + step / 2; y += step) shape.line([from[0], y, floor], [to[0], y, floor], color);
  [[1, 0, 0], [0, 1, 0], [0, 0, 1]].forEach((axis, i) => shape.line([0, 0, 0], scale(axis, step), AXES[i]));
  return { shape, step };
}

/** How long a line at the lower edge is: meters as text, and pixels. */
export function scaleBar(camera, pixelsHigh) {
  const pixels = camera.pixelsPerMeter(camera.distance, pixelsHigh);
  const long = roundDown(160 / pixels);
  return { text: meters(long), pixels: long * pixels };
}
