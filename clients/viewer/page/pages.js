// The GPU's memory for voxels: one texture of u32 words, cut into pages that tiles take and give back.

import { textureOf } from "./gpu.js";

export const PAGE = 256;
const WIDTH = 1024;
const PAGES_A_ROW = WIDTH / PAGE;
/** Four million voxels, 16 MiB. */
const HEIGHT = 4096;
/** What stands where a page has no voxel: no tag is 255. */
const NOTHING = 0xffffffff;

export class Pages {
  #gl;
  #unit;
  #texture;
  #free = [];
  #page = new Uint32Array(PAGE);
  /** Changes with the pages of any tile. */
  generation = 0;

  constructor(gl, unit) {
    this.#gl = gl;
    this.#unit = unit;
    const height = Math.min(HEIGHT, gl.getParameter(gl.MAX_TEXTURE_SIZE));
    this.#texture = textureOf(gl, unit, gl.R32UI, WIDTH, height);
    this.count = height * PAGES_A_ROW;
    for (let page = this.count - 1; page >= 0; page--) this.#free.push(page);
  }

  get free() {
    return this.#free.length;
  }

  bind() {
    this.#gl.activeTexture(this.#gl.TEXTURE0 + this.#unit);
    this.#gl.bindTexture(this.#gl.TEXTURE_2D, this.#texture);
  }

  /** Puts a tile's words where the GPU finds them; false where there is no room. */
  write(tile) {
    const gl = this.#gl;
    const needed = Math.ceil(tile.words.length / PAGE);
    if (needed > tile.pages.length + this.#free.length) return false;
    if (tile.pages.length !== needed) this.generation += 1;
    while (tile.pages.length > needed) this.#free.push(tile.pages.pop());
    while (tile.pages.length < needed) tile.pages.push(this.#free.pop());
    this.bind();
    tile.pages.forEach((page, i) => {
      const words = tile.words.subarray(i * PAGE, (i + 1) * PAGE);
      this.#page.set(words);
      this.#page.fill(NOTHING, words.length);
      const [x, y] = [(page % PAGES_A_ROW) * PAGE, Math.floor(page / PAGES_A_ROW)];
      gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, PAGE, 1, gl.RED_INTEGER, gl.UNSIGNED_INT, this.#page);
    });
    return true;
  }

  release(tile) {
    this.#free.push(...tile.pages);
    this.generation += 1;
    tile.pages = [];
  }
}
