// The tag of each voxel of level 0 of which one is known: a byte a voxel, block by block.

import { eachBlock, eachCube } from "./blocks.js";
import { SIDE } from "./tile.js";

/** Blocks that are kept: half a KiB each. */
const BLOCKS_MAX = 120_000;
const BLOCK_SIDE = 8;
/** Keys are exact for blocks up to so far from the origin. */
const RANGE = 1 << 16;

const keyOf = (x, y, z) => ((x + RANGE) * 2 * RANGE + (y + RANGE)) * 2 * RANGE + (z + RANGE);

export class Tags {
  /** There was no room for the tags of some voxels. */
  isFull = false;
  #blocks = new Map();
  #cells = new Uint8Array(SIDE ** 3);
  #blocksMax;

  constructor(blocksMax = BLOCKS_MAX) {
    this.#blocksMax = blocksMax;
  }

  /** Gives a tag to the voxels of these blocks; with `isOlder` only to those that have none. */
  put(bytes, tag, isOlder) {
    this.#each(bytes, true, (tags, at) => {
      if (!isOlder || tags[at] === 0) tags[at] = tag;
    });
  }

  /** Takes their tags away from the voxels of these blocks; `isTaken(tag)` says from which. */
  clear(bytes, isTaken = () => true) {
    this.#each(bytes, false, (tags, at) => {
      if (isTaken(tags[at])) tags[at] = 0;
    });
  }

  /** Gives each tag the one that stands in its place in a table. */
  retag(table) {
    for (const { tags } of this.#blocks.values()) tags.forEach((tag, i) => (tags[i] = table[tag]));
  }

  /** The tag of each cell of a tile, 0 where none is known; good until the next call. */
  of({ level, index }) {
    const cells = this.#cells.fill(0);
    for (const { x, y, z, tags } of this.#within(level, index)) {
      for (let i = 0; i < tags.length; i++) {
        if (tags[i] === 0) continue;
        const [cellX, cellY, cellZ] = [x * BLOCK_SIDE + (i & 7), y * BLOCK_SIDE + ((i >> 3) & 7), z * BLOCK_SIDE + (i >> 6)].map((cell) => (cell >> level) & 63);
        cells[cellX | (cellY << 6) | (cellZ << 12)] = tags[i];
      }
    }
    return cells;
  }

  /** The blocks that lie in a tile. */
  *#within(level, [x, y, z]) {
    const isIn = (block, at) => block >> (level + 3) === at;
    if (level > 0) {
      for (const block of this.#blocks.values()) if (isIn(block.x, x) && isIn(block.y, y) && isIn(block.z, z)) yield block;
      return;
    }
    for (let i = 0; i < 512; i++) {
      const block = this.#blocks.get(keyOf(x * 8 + (i & 7), y * 8 + ((i >> 3) & 7), z * 8 + (i >> 6)));
      if (block) yield block;
    }
  }

  #each(bytes, isMade, visit) {
    eachBlock(bytes, (x, y, z, masks) => {
      const key = keyOf(x, y, z);
      let block = this.#blocks.get(key);
      if (!block && !isMade) return;
      if (!block) {
        const hasRoom = this.#blocks.size < this.#blocksMax && [x, y, z].every((at) => Math.abs(at) < RANGE);
        if (!hasRoom) return void (this.isFull = true);
        this.#blocks.set(key, (block = { x, y, z, tags: new Uint8Array(BLOCK_SIDE ** 3) }));
      }
      eachCube(masks, (cubeX, cubeY, cubeZ, bits) => {
        for (let i = 0; i < 8; i++) {
          if ((bits >> i) & 1) visit(block.tags, cubeX + (i & 1) + 8 * (cubeY + ((i >> 1) & 1)) + 64 * (cubeZ + (i >> 2)));
        }
      });
    });
  }
}
