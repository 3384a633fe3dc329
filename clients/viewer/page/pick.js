// The first voxel that a ray meets, among those that are drawn.

import { SIDE } from "./tile.js";

/** Where a ray enters and leaves a box: distances along it; none where it passes by. */
export function span({ origin, direction }, { min, max }) {
  let [from, to] = [0, Infinity];
  for (let axis = 0; axis < 3; axis++) {
    const inverse = 1 / direction[axis];
    const [a, b] = [(min[axis] - origin[axis]) * inverse, (max[axis] - origin[axis]) * inverse];
    // 0 * infinity: the ray runs along a face of the box.
    if (Number.isNaN(a) || Number.isNaN(b)) continue;
    from = Math.max(from, Math.min(a, b));
    to = Math.min(to, Math.max(a, b));
  }
  return from <= to ? [from, to] : undefined;
}

/** `{ level, index, center, point, distance, normal }` of the voxel that is hit first; none where the ray hits nothing. */
export function pick(forest, tiles, ray, cut) {
  let hit;
  const spans = tiles.map((tile) => ({ tile, within: span(ray, forest.boxOf(tile)) })).filter(({ within }) => within);
  spans.sort((a, b) => a.within[0] - b.within[0]);
  for (const { tile, within } of spans) {
    if (hit && within[0] > hit.distance) break;
    const found = walk(forest, tile, ray, within, cut);
    if (found && (!hit || found.distance < hit.distance)) hit = found;
  }
  return hit;
}

/** From cell to cell along the ray through one tile. */
function walk(forest, tile, { origin, direction }, [from, to], cut) {
  const side = forest.side(tile.level);
  const base = tile.index.map((i) => i * SIDE);
  const start = origin.map((value, axis) => (value + direction[axis] * from) / side - base[axis]);
  const cell = start.map((value) => Math.min(Math.max(Math.floor(value), 0), SIDE - 1));
  const step = direction.map(Math.sign);
  const length = direction.map((value) => Math.abs(side / value));
  const next = start.map((value, axis) => from + (step[axis] > 0 ? cell[axis] + 1 - value : value - cell[axis]) * length[axis]);
  let distance = from;
  let crossed = next.indexOf(Math.min(...next));
  while (distance <= to) {
    if (tile.has(...cell)) {
      const index = cell.map((value, axis) => base[axis] + value);
      const center = index.map((i) => (i + 0.5) * side);
      if (center.every((value, axis) => value >= cut.min[axis] && value <= cut.max[axis])) {
        const normal = [0, 0, 0];
        normal[crossed] = -step[crossed];
        const point = origin.map((value, axis) => value + direction[axis] * distance);
        return { level: tile.level, index, center, point, distance, normal };
      }
    }
    crossed = next.indexOf(Math.min(...next));
    distance = next[crossed];
    next[crossed] += length[crossed];
    cell[crossed] += step[crossed];
    if (cell[crossed] < 0 || cell[crossed] >= SIDE) return undefined;
  }
  return undefined;
}
