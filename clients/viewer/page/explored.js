// What is known of space, where it is asked for: frontiers, and the map from above as free, occupied or unknown.

import { pathOf, send } from "./api.js";
import { count } from "./format.js";
import { rgba, theme } from "./palette.js";
import { Shape } from "./shapes.js";

/** Voxels of a box of frontiers, and cells of a grid, that a server answers for within the time of a question. */
const FRONTIER_CELLS_MAX = 400_000;
const GRID_CELLS_MAX = 40_000;
const TOO_LATE = 504;

/** The finest level at which a box has at most so many cells. */
function levelFor(forest, sides, cellsMax, from) {
  for (let level = from; level < forest.top; level++) {
    if (sides.reduce((cells, side) => cells * Math.ceil(side / forest.side(level)), 1) <= cellsMax) return level;
  }
  return forest.top;
}

/** The answer at this level, or where that takes the server too long, at a coarser one. */
async function askCoarser(forest, level, ask) {
  try {
    return { level, answer: await ask(level) };
  } catch (error) {
    if (error.status !== TOO_LATE || level === forest.top) throw error;
    return askCoarser(forest, level + 1, ask);
  }
}

/** Frontiers in the bounds: a shape, and what there is to say. */
export async function frontiers(session, bounds) {
  const sides = bounds.max.map((value, axis) => value - bounds.min[axis]);
  const box = { min_m: bounds.min, max_m: bounds.max };
  const finest = levelFor(session.forest, sides, FRONTIER_CELLS_MAX, 0);
  const ask = (level) => send("POST", pathOf(session.name, "frontiers"), { box, level });
  const { answer, level } = await askCoarser(session.forest, finest, ask);
  const shape = new Shape();
  const [edge, face] = [rgba(theme().accent), rgba(theme().accent, 0.2)];
  for (const { min_m, max_m, view } of answer.frontiers) {
    shape.box((at) => at.map((value, axis) => (value > 0 ? max_m : min_m)[axis]), edge, face);
    if (view) shape.line(view.map_from_view.translation_m, view.target_m, edge);
  }
  const more = answer.frontiers_total > answer.frontiers.length ? `, the largest ${answer.frontiers.length} shown` : "";
  return { shape, text: `${count(answer.frontiers_total)} frontiers at level ${level}${more}; lines lead from where they are seen.` };
}

/** The map from above between two heights: cells that are free, and those of which nothing is known. */
export async function freeSpace(session, bounds, [low, high]) {
  const sides = [0, 1].map((axis) => bounds.max[axis] - bounds.min[axis]);
  const finest = levelFor(session.forest, sides, GRID_CELLS_MAX, Math.min(1, session.forest.top));
  const area = { min_m: bounds.min.slice(0, 2), max_m: bounds.max.slice(0, 2) };
  const ask = (level) => send("POST", pathOf(session.name, "grid"), { area, min_z_m: low, max_z_m: high, band_from: "map", level, tell_unknown: true });
  const { answer } = await askCoarser(session.forest, finest, ask);
  const { cell_m, origin_m, size, occupied, free } = answer;
  const shape = new Shape();
  const colors = { free: rgba(theme().free, 0.5), unknown: rgba(theme().unknown, 0.35) };
  const kind = (i) => (occupied[i] ? "occupied" : free[i] ? "free" : "unknown");
  // Cells of a kind in a row make one rectangle.
  for (let y = 0; y < size[1]; y++) {
    for (let x = 0; x < size[0]; ) {
      const of = kind(y * size[0] + x);
      const from = x;
      while (x < size[0] && kind(y * size[0] + x) === of) x++;
      if (of === "occupied") continue;
      const [x0, x1] = [from, x].map((cell) => origin_m[0] + cell * cell_m);
      const [y0, y1] = [y, y + 1].map((cell) => origin_m[1] + cell * cell_m);
      shape.quad([x0, y0, low], [x1, y0, low], [x1, y1, low], [x0, y1, low], colors[of]);
    }
  }
  return { shape, text: `From ${low.toFixed(2)} to ${high.toFixed(2)} m: green is free, gray is unknown.` };
}
