// Whether any voxel is in the picture, and what to say where none is.

import { button, byId, element } from "./dom.js";
import { SIDE } from "./tile.js";

/** True where the picture that a matrix makes has a voxel of these tiles in it, hidden by others or not. */
export function isAnySeen(forest, tiles, { matrix: m, origin, cut }) {
  for (const tile of tiles) {
    const side = forest.side(tile.level);
    const base = tile.index.map((i) => i * SIDE * side);
    // Half a cube, by how it grows in the picture.
    const half = [0, 1, 2].map((row) => (side / 2) * (Math.abs(m[row]) + Math.abs(m[4 + row]) + Math.abs(m[8 + row])));
    for (const word of tile.words) {
      const center = [word & 63, (word >> 6) & 63, (word >> 12) & 63].map((cell, axis) => base[axis] + (cell + 0.5) * side);
      if (center.some((value, axis) => value < cut.min[axis] || value > cut.max[axis])) continue;
      const at = center.map((value, axis) => value - origin[axis]);
      const w = m[3] * at[0] + m[7] * at[1] + m[11] * at[2] + m[15];
      const isIn = half.every((room, row) => Math.abs(m[row] * at[0] + m[4 + row] * at[1] + m[8 + row] * at[2] + m[12 + row]) <= w + room);
      if (w > 0 && isIn) return true;
    }
  }
  return false;
}

/** Says why the picture is empty: `seen` is what the scene sees of its map. `actions` has `uncut` and `all`. */
export function sayUnseen(seen, { uncut, all }) {
  const host = byId("unseen");
  if (host.dataset.seen === seen) return;
  host.dataset.seen = seen;
  host.hidden = seen === "voxels";
  if (host.hidden) return;
  const [text, ...buttons] =
    seen === "cut"
      ? ["What lies here is cut off.", button("No cut", uncut), button("Show the whole map", all)]
      : ["No voxel of the map is in the picture from here.", button("Show the whole map", all)];
  host.replaceChildren(element("span", {}, text), ...buttons);
}
