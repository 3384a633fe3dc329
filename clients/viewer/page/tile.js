// 64 x 64 x 64 cells of one level: which are occupied, and the words that the GPU draws them from.
//
// A word is a voxel: bits 0-5 x, 6-11 y, 12-17 z, 18-23 which faces have no neighbor (-x +x -y +y -z +z), 24-31 the tag of
// the scan that brought it (0: it was there before). Bits 0-17 are also the cell's number, in whose order words stand.

import { eachBlock, eachCube } from "./blocks.js";

export const SIDE = 64;
const CELL = 0x3ffff;
const TAG_SHIFT = 24;

export class Tile {
  /** @param index of the tile, in units of tiles of its level */
  constructor(level, index, revision) {
    this.level = level;
    this.index = index;
    /** Changes up to this revision are in it. */
    this.revision = revision;
    this.bits = new Uint32Array((SIDE * SIDE * SIDE) / 32);
    this.words = new Uint32Array(0);
    /** Bit i: the octant i, x lowest, which is a tile of the next finer level, is not empty. */
    this.octants = 0;
    /** The pages of the GPU's memory that hold its words. */
    this.pages = [];
    /** Cells that came since the words were made, with their tags. */
    this.fresh = new Map();
    this.isChanged = true;
    /** The GPU has it, as it was once. */
    this.isDrawable = false;
    /** Its cells may have tags that it does not know of. */
    this.isUntagged = false;
    /** It may hold what went since: to be fetched again. */
    this.isStale = false;
    this.drawnAt = 0;
  }

  has(x, y, z) {
    return ((this.bits[(z * SIDE + y) * 2 + (x >> 5)] >>> (x & 31)) & 1) === 1;
  }

  insert(x, y, z, tag) {
    if (this.has(x, y, z)) return;
    this.bits[(z * SIDE + y) * 2 + (x >> 5)] |= 1 << (x & 31);
    this.octants |= 1 << ((x >> 5) | ((y >> 5) << 1) | ((z >> 5) << 2));
    if (tag) this.fresh.set(x | (y << 6) | (z << 12), tag);
    this.isChanged = true;
  }

  remove(x, y, z) {
    if (!this.has(x, y, z)) return;
    this.bits[(z * SIDE + y) * 2 + (x >> 5)] &= ~(1 << (x & 31));
    this.fresh.delete(x | (y << 6) | (z << 12));
    this.isChanged = true;
  }

  /** Holds these blocks and nothing else. Tags stay with the cells that stay. */
  fill(bytes, revision) {
    this.bits.fill(0);
    this.octants = 0;
    eachBlock(bytes, (x, y, z, masks) => this.fillBlock(x, y, z, masks));
    this.revision = revision;
    this.isChanged = true;
    this.isStale = false;
  }

  /** Takes up a block of voxels, if it lies in the tile. */
  fillBlock(blockX, blockY, blockZ, masks) {
    const [tileX, tileY, tileZ] = this.index;
    const [x0, y0, z0] = [blockX - tileX * 8, blockY - tileY * 8, blockZ - tileZ * 8];
    if ((x0 | y0 | z0) & ~7) return;
    this.octants |= 1 << ((x0 >> 2) | ((y0 >> 2) << 1) | ((z0 >> 2) << 2));
    eachCube(masks, (x, y, z, bits) => this.#fillCube(x0 * 8 + x, y0 * 8 + y, z0 * 8 + z, bits));
  }

  #fillCube(x, y, z, bits) {
    const at = (z * SIDE + y) * 2 + (x >> 5);
    const shift = x & 31;
    this.bits[at] |= (bits & 3) << shift;
    this.bits[at + 2] |= ((bits >> 2) & 3) << shift;
    this.bits[at + 2 * SIDE] |= ((bits >> 4) & 3) << shift;
    this.bits[at + 2 * SIDE + 2] |= (bits >> 6) << shift;
  }

  /** Makes the words anew from the bits; `tags` may have tags of cells of which none is known. */
  build(tags) {
    const { bits, words: old, fresh } = this;
    const words = new Uint32Array(bits.reduce((sum, word) => sum + ones(word), 0));
    let count = 0;
    let before = 0;
    for (let row = 0; row < SIDE * SIDE; row++) {
      const at = row * 2;
      const pair = [bits[at], bits[at + 1]];
      if ((pair[0] | pair[1]) === 0) continue;
      const y = row & 63;
      for (let half = 0; half < 2; half++) {
        const word = pair[half];
        if (word === 0) continue;
        const neighbors = [
          half === 0 ? pair[0] << 1 : (pair[1] << 1) | (pair[0] >>> 31),
          half === 0 ? (pair[0] >>> 1) | (pair[1] << 31) : pair[1] >>> 1,
          y > 0 ? bits[at - 2 + half] : 0,
          y < 63 ? bits[at + 2 + half] : 0,
          row >= SIDE ? bits[at - 2 * SIDE + half] : 0,
          row < SIDE * (SIDE - 1) ? bits[at + 2 * SIDE + half] : 0,
        ];
        for (let left = word; left !== 0; left &= left - 1) {
          const bit = 31 - Math.clz32(left & -left);
          const cell = (row << 6) | (half << 5) | bit;
          let faces = 0;
          for (let face = 0; face < 6; face++) faces |= (~(neighbors[face] >>> bit) & 1) << face;
          while (before < old.length && (old[before] & CELL) < cell) before++;
          const kept = before < old.length && (old[before] & CELL) === cell ? old[before] >>> TAG_SHIFT : 0;
          const tag = (fresh.size > 0 ? (fresh.get(cell) ?? kept) : kept) || (tags?.[cell] ?? 0);
          words[count++] = cell | (faces << 18) | (tag << TAG_SHIFT);
        }
      }
    }
    this.words = words;
    this.fresh.clear();
    this.isChanged = this.isUntagged = false;
  }

  /** Gives each tag the one that stands in its place in a table. */
  retag(table) {
    for (let i = 0; i < this.words.length; i++) {
      const tag = this.words[i] >>> TAG_SHIFT;
      if (table[tag] === tag) continue;
      this.words[i] = (this.words[i] & 0xffffff) | (table[tag] << TAG_SHIFT);
      this.isChanged = true;
    }
    for (const [cell, tag] of this.fresh) this.fresh.set(cell, table[tag]);
  }
}

function ones(word) {
  let bits = word - ((word >>> 1) & 0x55555555);
  bits = (bits & 0x33333333) + ((bits >>> 2) & 0x33333333);
  return (((bits + (bits >>> 4)) & 0x0f0f0f0f) * 0x01010101) >>> 24;
}
