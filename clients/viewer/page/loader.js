// Fetches tiles: the coarsest level first, then those that are asked for, the most wanted first.

import { Problem, readBlocks } from "./api.js";
import { SIDE } from "./tile.js";

/** A browser opens six connections to a server. One is the watch's, and one is left for people's clicks. */
const AT_ONCE_MAX = 4;
/** Cells that a map reaches to in each direction, at level 0. */
const RANGE = 1 << 20;
const STALE_EVERY_MS = 500;
const PAUSE_MS = 1000;

export class Loader {
  #map;
  #forest;
  #told;
  #asked = new Map();
  #wanted = [];
  #pausedUntil = 0;
  #staleAt = 0;
  #timer;
  #stop = new AbortController();
  bytes = 0;
  requests = 0;

  /** `told` has `fetched(tile)`, `arrived()` and `failed(problem)`. */
  constructor(map, forest, told) {
    this.#map = map;
    this.#forest = forest;
    this.#told = told;
  }

  get isBusy() {
    return this.#asked.size + this.#wanted.length > 0;
  }

  stop() {
    clearTimeout(this.#timer);
    this.#stop.abort();
  }

  /** Reads the coarsest level; the uuid and the revision of the map. */
  async readRoots() {
    const { top } = this.#forest;
    const read = async (box) => {
      try {
        const blocks = await this.#blocks(top, box);
        this.#forest.plantRoots(blocks.bytes, blocks.revision);
        return blocks;
      } catch (error) {
        if (!(error instanceof Problem) || error.reason !== "block_too_large") throw error;
        // What is too much for one answer is read in eighths, of which most are empty.
        const { min, max } = box ?? { min: Array(3).fill(-RANGE >> top), max: Array(3).fill(RANGE >> top) };
        let first;
        for (let i = 0; i < 8; i++) {
          const middle = min.map((value, axis) => (value + max[axis]) / 2);
          const part = [0, 1, 2].map((axis) => ((i >> axis) & 1 ? [middle[axis], max[axis]] : [min[axis], middle[axis]]));
          const blocks = await read({ min: part.map(([from]) => from), max: part.map(([, to]) => to) });
          first ??= blocks;
        }
        return first;
      }
    };
    return read(undefined);
  }

  /** Keeps a change for the tiles that are on their way: they may be of a revision before it. */
  note(change, tag) {
    for (const asked of this.#asked.values()) asked.changes.push([change, tag]);
  }

  /** Fetches these `{ level, index }` from now on, in this order, and what was wanted before no more. */
  want(tiles) {
    this.#wanted = tiles.concat(this.#stale());
    this.#fetchNext();
  }

  /** What changes left uncertain; not at each of them. */
  #stale() {
    const now = performance.now();
    if (now < this.#staleAt + STALE_EVERY_MS) {
      this.#lookAgainIn(STALE_EVERY_MS);
      return this.#wanted.filter((tile) => tile.isStale);
    }
    this.#staleAt = now;
    const stale = Array.from(this.#forest.tiles()).filter((tile) => tile.isStale);
    return stale.sort((a, b) => b.level - a.level || b.drawnAt - a.drawnAt);
  }

  /** Has what is wanted looked at once more, after some milliseconds. */
  #lookAgainIn(milliseconds) {
    this.#timer ??= setTimeout(() => {
      this.#timer = undefined;
      this.#told.arrived();
    }, milliseconds);
  }

  #fetchNext() {
    const pause = this.#pausedUntil - performance.now();
    if (pause > 0) return this.#lookAgainIn(pause);
    while (this.#asked.size < AT_ONCE_MAX && this.#wanted.length > 0) {
      const { level, index } = this.#wanted.shift();
      this.#fetch(level, index);
    }
  }

  async #fetch(level, index) {
    const name = `${level}:${index}`;
    if (this.#asked.has(name)) return;
    const changes = [];
    this.#asked.set(name, { changes });
    try {
      const box = { min: index.map((i) => i * SIDE), max: index.map((i) => (i + 1) * SIDE) };
      const { bytes, revision } = await this.#blocks(level, box);
      const tile = this.#forest.at(level, index) ?? this.#forest.plant(level, index, revision);
      tile.fill(bytes, revision);
      this.#asked.delete(name);
      for (const [change, tag] of changes) this.#forest.applyTo(tile, change, tag);
      this.#told.fetched(tile);
    } catch (error) {
      this.#asked.delete(name);
      if (error.name === "AbortError") return;
      this.#pausedUntil = performance.now() + (error.retryAfter ?? 1) * PAUSE_MS;
      this.#told.failed(error);
    }
    this.#told.arrived();
    this.#fetchNext();
  }

  async #blocks(level, box) {
    this.requests += 1;
    const blocks = await readBlocks(this.#map, level, this.#forest.side(level), box, this.#stop.signal);
    this.bytes += blocks.bytes.length;
    return blocks;
  }
}
