// Which tiles are drawn: fine ones near by, coarse ones far away, and none that the picture does not show.

import { length } from "./vector.js";

/** How far apart the eye and a box are. */
function distanceTo(eye, { min, max }) {
  return length(eye.map((value, axis) => Math.max(min[axis] - value, 0, value - max[axis])));
}

/** True where a box lies beyond one of the sides of what the matrix shows. */
function isOutside(matrix, origin, { min, max }) {
  for (let side = 0; side < 6; side++) {
    const axis = side >> 1;
    const sign = side & 1 ? -1 : 1;
    let sum = matrix[15] + sign * matrix[12 + axis];
    for (let i = 0; i < 3; i++) {
      const weight = matrix[i * 4 + 3] + sign * matrix[i * 4 + axis];
      sum += weight * ((weight > 0 ? max[i] : min[i]) - origin[i]);
    }
    if (sum < 0) return true;
  }
  return false;
}

const isApart = (a, b) => [0, 1, 2].some((axis) => a.max[axis] <= b.min[axis] || a.min[axis] >= b.max[axis]);

/** Tiles by how large their cells look, the largest first. */
class Heap {
  #items = [];

  get size() {
    return this.#items.length;
  }

  push(item) {
    const items = this.#items;
    let at = items.push(item) - 1;
    for (let parent = (at - 1) >> 1; at > 0 && items[parent].pixels < item.pixels; parent = (at - 1) >> 1) {
      items[at] = items[parent];
      at = parent;
    }
    items[at] = item;
  }

  pop() {
    const items = this.#items;
    const largest = items[0];
    const last = items.pop();
    if (items.length === 0) return largest;
    let at = 0;
    for (;;) {
      let child = 2 * at + 1;
      if (child >= items.length) break;
      if (child + 1 < items.length && items[child + 1].pixels > items[child].pixels) child += 1;
      if (items[child].pixels <= last.pixels) break;
      items[at] = items[child];
      at = child;
    }
    items[at] = last;
    return largest;
  }
}

/**
 * The tiles to draw and those to fetch, the most wanted first. `aim` has the camera, the matrix with its origin, the height
 * of the picture in pixels, how many of these a cell may take up, the finest level, the cut, and the most voxels.
 */
export function choose(forest, { camera, matrix, origin, pixelsHigh, pixelsMax, finest, cut, voxelsMax }) {
  const eye = camera.eye();
  const now = performance.now();
  const shown = [];
  const wanted = [];
  const heap = new Heap();
  let voxels = 0;
  const consider = (tile) => {
    const box = forest.boxOf(tile);
    if (isApart(box, cut) || isOutside(matrix, origin, box)) return;
    const distance = Math.max(distanceTo(eye, box), forest.side(tile.level) / 4);
    heap.push({ tile, pixels: forest.side(tile.level) * camera.pixelsPerMeter(distance, pixelsHigh) });
    voxels += tile.words.length;
  };
  for (const root of forest.roots) consider(root);
  while (heap.size > 0) {
    const { tile, pixels } = heap.pop();
    tile.drawnAt = now;
    const isFine = tile.level <= finest || pixels <= pixelsMax;
    const children = isFine ? [] : forest.childrenOf(tile);
    if (children.length === 0 || voxels > voxelsMax) {
      shown.push(tile);
      continue;
    }
    const level = tile.level - 1;
    const isSeen = (index) => {
      const box = forest.boxOf({ level, index });
      return !isApart(box, cut) && !isOutside(matrix, origin, box);
    };
    const missing = children.filter((index) => !forest.at(level, index)?.isDrawable && isSeen(index));
    if (missing.length > 0) {
      for (const index of missing) if (!forest.at(level, index)) wanted.push({ level, index, pixels });
      shown.push(tile);
      continue;
    }
    voxels -= tile.words.length;
    for (const index of children) {
      const child = forest.at(level, index);
      if (child) consider(child);
    }
  }
  return { shown, wanted };
}
