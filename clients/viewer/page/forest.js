// The tiles of a map that are here: roots at its coarsest level, each tile over eight of the next finer one.

import { eachBlock, eachVoxel } from "./blocks.js";
import { SIDE, Tile } from "./tile.js";

/** Tiles that are kept; those of the coarsest level among them are never given up. */
export const TILES_MAX = 2_000;
const ROOTS_MAX = 1_000;

const keyOf = (level, [x, y, z]) => `${level}:${x},${y},${z}`;

export class Forest {
  #tiles = new Map();
  #roots = new Set();
  /** The map is spread over more places than are kept: some are not shown. */
  isPartial = false;

  /** @param resolution side of a voxel of level 0, meters */
  constructor(resolution, levels) {
    this.resolution = resolution;
    this.top = levels - 1;
  }

  get roots() {
    return this.#roots;
  }

  get size() {
    return this.#tiles.size;
  }

  tiles() {
    return this.#tiles.values();
  }

  at(level, index) {
    return this.#tiles.get(keyOf(level, index));
  }

  /** The side of a voxel of a level, meters. */
  side(level) {
    return this.resolution * 2 ** level;
  }

  /** The corners of a tile, meters. */
  boxOf({ level, index }) {
    const side = SIDE * this.side(level);
    return { min: index.map((i) => i * side), max: index.map((i) => (i + 1) * side) };
  }

  /** The indices of the children of a tile that are not empty. */
  childrenOf({ index: [x, y, z], octants }) {
    const children = [];
    for (let i = 0; i < 8; i++) {
      if ((octants >> i) & 1) children.push([2 * x + (i & 1), 2 * y + ((i >> 1) & 1), 2 * z + (i >> 2)]);
    }
    return children;
  }

  /** Makes an empty tile, of which nothing more is known to come than changes after `revision`. */
  plant(level, index, revision) {
    const tile = new Tile(level, index, revision);
    this.#tiles.set(keyOf(level, index), tile);
    if (level === this.top) this.#roots.add(tile);
    return tile;
  }

  remove(tile) {
    this.#tiles.delete(keyOf(tile.level, tile.index));
    this.#roots.delete(tile);
  }

  /** Makes the roots that blocks of the coarsest level lie in. */
  plantRoots(bytes, revision) {
    const planted = new Set();
    eachBlock(bytes, (x, y, z, masks) => {
      const index = [x >> 3, y >> 3, z >> 3];
      let root = this.at(this.top, index);
      if (!root && this.#hasRoomAt(this.top)) planted.add((root = this.plant(this.top, index, revision)));
      if (planted.has(root)) root.fillBlock(x, y, z, masks);
    });
  }

  /**
   * The box around the voxels, in meters, as exact as the coarsest level is; with a share, around what is left without so
   * many at each end of each axis: a few stray voxels far away do not count then.
   */
  bounds(stray = 0) {
    const counts = [new Map(), new Map(), new Map()];
    const note = (axis, at, number) => counts[axis].set(at, (counts[axis].get(at) ?? 0) + number);
    let total = 0;
    for (const root of this.#roots) {
      const base = root.index.map((i) => i * SIDE);
      for (let row = 0; row < SIDE * SIDE; row++) {
        let number = 0;
        for (let half = 0; half < 2; half++) {
          for (let left = root.bits[row * 2 + half]; left !== 0; left &= left - 1) {
            note(0, base[0] + half * 32 + trailingZeros(left), 1);
            number += 1;
          }
        }
        if (number === 0) continue;
        note(1, base[1] + (row & 63), number);
        note(2, base[2] + (row >> 6), number);
        total += number;
      }
    }
    if (total === 0) return undefined;
    const side = this.side(this.top);
    const ends = counts.map((numbers) => endsOf(numbers, Math.floor(total * stray)));
    return { min: ends.map(([least]) => least * side), max: ends.map(([, most]) => (most + 1) * side) };
  }

  /** Takes up voxels of level 0 that came and went. What came gets a tag. */
  apply({ revision, added, removed }, tag) {
    eachVoxel(removed, (x, y, z) => {
      for (let level = 0; level <= this.top; level++) this.#removeAt(level, x, y, z, revision);
    });
    eachVoxel(added, (x, y, z) => {
      for (let level = 0; level <= this.top; level++) this.#insertAt(level, x, y, z, revision, tag);
    });
  }

  /** Takes up in one tile what came and went elsewhere in the meantime. */
  applyTo(tile, { revision, added, removed }, tag) {
    const isIn = (i, axis) => i >> (tile.level + 6) === tile.index[axis];
    eachVoxel(removed, (x, y, z) => {
      if (isIn(x, 0) && isIn(y, 1) && isIn(z, 2)) this.#removeAt(tile.level, x, y, z, revision);
    });
    eachVoxel(added, (x, y, z) => {
      if (isIn(x, 0) && isIn(y, 1) && isIn(z, 2)) this.#insertAt(tile.level, x, y, z, revision, tag);
    });
  }

  #removeAt(level, x, y, z, revision) {
    const tile = this.#holding(level, x, y, z);
    if (!tile || revision <= tile.revision) return;
    // A coarse voxel goes with the last of its descendants, which may not be here.
    if (level === 0) tile.remove(x & 63, y & 63, z & 63);
    else tile.isStale = true;
  }

  #insertAt(level, x, y, z, revision, tag) {
    let tile = this.#holding(level, x, y, z);
    const index = [x >> (level + 6), y >> (level + 6), z >> (level + 6)];
    if (!tile && this.#isKnownEmpty(level, index) && this.#hasRoomAt(level)) {
      tile = this.plant(level, index, revision - 1);
      // Nothing is missing from the picture until its first voxels are drawn.
      tile.isDrawable = true;
    }
    if (!tile || revision <= tile.revision) return;
    tile.insert((x >> level) & 63, (y >> level) & 63, (z >> level) & 63, tag);
  }

  #hasRoomAt(level) {
    const hasRoom = level === this.top ? this.#roots.size < ROOTS_MAX : this.#tiles.size < TILES_MAX;
    // What is finer is fetched when it is looked at.
    if (!hasRoom && level === this.top) this.isPartial = true;
    return hasRoom;
  }

  #holding(level, x, y, z) {
    return this.at(level, [x >> (level + 6), y >> (level + 6), z >> (level + 6)]);
  }

  /** True of a tile that is not here, and holds nothing: where its parent, of which others are here, says so. */
  #isKnownEmpty(level, index) {
    if (level === this.top) return true;
    const parent = this.at(level + 1, index.map((i) => i >> 1));
    if (!parent || parent.isStale) return false;
    const octant = (index[0] & 1) | ((index[1] & 1) << 1) | ((index[2] & 1) << 2);
    if ((parent.octants >> octant) & 1) return false;
    return parent.octants === 0 || this.childrenOf(parent).some((child) => this.at(level, child));
  }
}

const trailingZeros = (word) => 31 - Math.clz32(word & -word);

/** The least and the largest of numbers that are there so many times each, without so many at each end. */
function endsOf(numbers, without) {
  const end = (sorted) => {
    let left = without;
    return sorted.find(([, times]) => (left -= times) < 0)[0];
  };
  const sorted = Array.from(numbers).sort(([a], [b]) => a - b);
  return [end(sorted), end(sorted.toReversed())];
}
