// The ceiling: where a roof hides most of a map from above, it is left out until somebody wants it. And how high the
// map is without stray voxels, which the coarsest level does not tell.

import { readBlocks } from "./api.js";
import { eachVoxel } from "./blocks.js";
import { byId } from "./dom.js";

/** Share of the map's height above which is the ceiling. */
const CEILING_FROM = 0.8;
/** A roof hides the map where it covers more than this share of it. */
const HIDDEN_MIN = 0.5;
/** A map is looked at in its finest voxels of which it has at most so many, if it is at least so many of them high. */
const CELLS_MAX = 150_000;
const CELLS_HIGH_MIN = 8;
/** Share of the voxels at the top and at the bottom that may be stray ones. */
const STRAY = 0.01;
/** A column of which more than this share is occupied is a wall. */
const WALL_MIN = 0.5;
/** A map that grows is looked at again after this long, and then each time after twice as long. */
const AGAIN_MS = 2_000;
const AGAIN_MS_MAX = 20_000;

export class Ceiling {
  /** The lowest and the highest that most voxels reach, meters; none until that is known. */
  range;
  #cuts;
  #session;
  #bounds;
  #isLooking = false;
  #nextAt = 0;
  #waits = AGAIN_MS;
  #timer;
  #revision;
  #told;

  /** `told` has `pressed()`: somebody has taken the ceiling off or put it back; `measured()`: the range is another. */
  constructor(cuts, told) {
    this.#cuts = cuts;
    this.#told = told;
    byId("ceiling").addEventListener("click", () => this.turn());
  }

  open(session, bounds) {
    this.#session = session;
    this.#revision = this.range = undefined;
    [this.#nextAt, this.#waits] = [0, AGAIN_MS];
    this.follow(bounds);
  }

  /** Looks at a map that has grown, for as long as nobody has cut it. */
  async follow(bounds) {
    const session = this.#session;
    this.#bounds = bounds;
    this.say();
    const isSame = this.#revision === session?.revision;
    if (!session || !bounds || isSame || this.#isLooking) return;
    const wait = this.#nextAt - performance.now();
    if (wait > 0) {
      this.#timer ??= setTimeout(() => ((this.#timer = undefined), this.follow(this.#bounds)), wait);
      return;
    }
    this.#isLooking = true;
    this.#revision = session.revision;
    try {
      const { range, ceiling } = await heightsOf(session);
      if (session !== this.#session) return;
      this.range = range;
      if (!this.#cuts.isByHand) this.#cuts.setTop(ceiling);
      this.#told.measured();
    } catch {
      // The whole map is shown then. That the server cannot be reached, the watch says.
    } finally {
      this.#isLooking = false;
      this.#nextAt = performance.now() + this.#waits;
      this.#waits = Math.min(2 * this.#waits, AGAIN_MS_MAX);
      this.say();
    }
  }

  /** Takes the ceiling off, or puts it back. */
  turn() {
    if (!this.#bounds) return;
    const { min, max } = this.#bounds;
    this.#cuts.isByHand = true;
    this.#cuts.setTop(Number.isFinite(this.#cuts.cut.max[2]) ? Infinity : min[2] + CEILING_FROM * (max[2] - min[2]));
    this.say();
    this.#told.pressed();
  }

  /** Says on the page what is left out. */
  say() {
    const top = this.#cuts.cut.max[2];
    byId("ceiling").setAttribute("aria-pressed", Number.isFinite(top));
    const others = [...this.#cuts.cut.min, ...this.#cuts.cut.max.slice(0, 2)].some(Number.isFinite);
    const words = Number.isFinite(top) ? `without ${this.#cuts.isByHand ? "what is" : "the roof,"} above ${top.toFixed(1)} m` : "";
    byId("cut-said").textContent = others ? "only a part of the map, see Cut" : words;
  }
}

/** How high a map reaches, and the height above which a roof hides most of it, if one does. */
async function heightsOf({ name, info, forest }) {
  // A map that grows may have more by now, and is then looked at more coarsely when it is opened again.
  const level = info.levels.findIndex(({ voxels }) => voxels <= CELLS_MAX);
  if (level < 0) return {};
  const side = forest.side(level);
  const { bytes } = await readBlocks(name, level, side);
  const columns = new Map();
  const heights = new Map();
  eachVoxel(bytes, (x, y, z) => {
    heights.set(z, (heights.get(z) ?? 0) + 1);
    const key = x * 2 ** 22 + y;
    const column = columns.get(key);
    if (!column) return columns.set(key, { low: z, top: z, count: 1 });
    column.low = Math.min(column.low, z);
    column.top = Math.max(column.top, z);
    column.count += 1;
  });
  if (heights.size === 0) return {};
  const [floor, roof] = endsOf(heights);
  const range = [floor * side, (roof + 1) * side];
  if (roof + 1 - floor < CELLS_HIGH_MIN) return { range };
  const from = floor + CEILING_FROM * (roof + 1 - floor);
  let [hidden, open] = [0, 0];
  for (const { low, top, count } of columns.values()) {
    if (low >= from || count > WALL_MIN * (roof + 1 - floor)) continue;
    if (top + 1 > from) hidden += 1;
    else open += 1;
  }
  return { range, ceiling: hidden > HIDDEN_MIN * (hidden + open) ? from * side : undefined };
}

/** The lowest and the highest cell, without stray ones. */
function endsOf(counts) {
  const sorted = Array.from(counts).sort(([a], [b]) => a - b);
  const total = sorted.reduce((sum, [, number]) => sum + number, 0);
  const end = (from) => {
    let left = STRAY * total;
    return from.find(([, number]) => (left -= number) < 0)[0];
  };
  return [end(sorted), end(sorted.toReversed())];
}
