// Draws voxels as cubes, all of them in one call, and without vertices: a vertex finds its voxel by its number.
//
// A cube shows an eye three faces at most, so that a voxel has 18 vertices: the face across each axis that is turned
// towards the eye, or nothing where a neighbor hides that one.

import { programOf, textureOf } from "./gpu.js";
import { PAGE, Pages } from "./pages.js";

const VERTICES = 18;
const LIST_WIDTH = 64;
const PAGE_UNIT = 0;
const LIST_UNIT = 1;
const COLOR_UNIT = 2;
/** How the list packs a page and a level into one number, which a float holds exactly. */
const PAGES_MAX = 16384;

const VERTEX = `
uniform highp usampler2D u_words;
uniform highp sampler2D u_list;
uniform highp sampler2D u_colors;
uniform mat4 u_clip_from_map;
uniform vec4 u_towards_eye;
uniform vec3 u_cut_min, u_cut_max;
uniform vec2 u_heights;
uniform float u_resolution;
uniform int u_coloring;
flat out vec3 v_color;
out vec2 v_uv;

const vec2 CORNERS[6] = vec2[](vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 0), vec2(1, 1), vec2(0, 1));
const vec3 LIGHT = vec3(0.80, 0.90, 1.0);

vec3 unit(int axis) { return vec3(axis == 0, axis == 1, axis == 2); }
bool is_cut(vec3 center) { return any(lessThan(center, u_cut_min)) || any(greaterThan(center, u_cut_max)); }

vec3 color(int level, uint tag, float height) {
  vec4 brought = texelFetch(u_colors, ivec2(int(tag), 1), 0);
  if (u_coloring == 1) return texelFetch(u_colors, ivec2(level, 2), 0).rgb;
  float share = clamp((height - u_heights.x) / (u_heights.y - u_heights.x), 0.0, 1.0);
  vec3 by_height = texelFetch(u_colors, ivec2(int(share * 255.0), 0), 0).rgb;
  if (u_coloring == 0) return by_height;
  return mix(texelFetch(u_colors, ivec2(0, 1), 0).rgb, brought.rgb, brought.a);
}

void main() {
  int face = gl_VertexID / 6;
  int slot = face / 3;
  int axis = face % 3;
  int entry = slot / ${PAGE};
  vec4 listed = texelFetch(u_list, ivec2(entry % ${LIST_WIDTH}, entry / ${LIST_WIDTH}), 0);
  int page = int(listed.w) % ${PAGES_MAX};
  int level = int(listed.w) / ${PAGES_MAX};
  uint word = texelFetch(u_words, ivec2((page % 4) * ${PAGE} + slot % ${PAGE}, page / 4), 0).r;
  gl_Position = vec4(0, 0, 2, 1);
  if (word == 0xffffffffu) return;
  float side = u_resolution * float(1 << level);
  vec3 cell = vec3(word & 63u, (word >> 6) & 63u, (word >> 12) & 63u);
  vec3 center = listed.xyz + (cell + 0.5) * side;
  if (is_cut(center)) return;
  float towards = u_towards_eye[axis] - center[axis] * u_towards_eye.w;
  float sign = towards > 0.0 ? 1.0 : -1.0;
  vec3 out_of_face = unit(axis) * sign;
  bool is_open = ((word >> (18 + axis * 2 + int(towards > 0.0))) & 1u) == 1u || is_cut(center + out_of_face * side);
  if (!is_open) return;
  vec2 corner = CORNERS[gl_VertexID % 6];
  vec3 along = unit((axis + 1) % 3) * (corner.x - 0.5) + unit((axis + 2) % 3) * (corner.y - 0.5);
  gl_Position = u_clip_from_map * vec4(center + (out_of_face * 0.5 + along) * side, 1);
  float light = LIGHT[axis] * (axis == 2 && sign < 0.0 ? 0.7 : 1.0);
  v_color = color(level, word >> 24, center.z) * light;
  v_uv = corner;
}`;

// Edges are drawn where a face is large enough to show them.
const FRAGMENT = `
flat in vec3 v_color;
in vec2 v_uv;
out vec4 o_color;
void main() {
  vec2 pixel = fwidth(v_uv);
  vec2 inside = min(v_uv, 1.0 - v_uv) / max(pixel, 1e-6);
  float edge = 1.0 - smoothstep(0.0, 1.5, min(inside.x, inside.y));
  float shown = 1.0 - smoothstep(0.06, 0.16, max(pixel.x, pixel.y));
  o_color = vec4(v_color * (1.0 - 0.22 * edge * shown), 1);
}`;

export class Voxels {
  #gl;
  #program;
  #list;
  #colors;
  #entries;
  #listed = [];
  #generation = -1;
  #count = 0;

  constructor(gl) {
    this.#gl = gl;
    this.#program = programOf(gl, VERTEX, FRAGMENT);
    this.pages = new Pages(gl, PAGE_UNIT);
    const height = this.pages.count / LIST_WIDTH;
    this.#list = textureOf(gl, LIST_UNIT, gl.RGBA32F, LIST_WIDTH, height);
    this.#entries = new Float32Array(LIST_WIDTH * height * 4);
    this.#colors = textureOf(gl, COLOR_UNIT, gl.RGBA8, 256, 3);
  }

  /** Takes over three rows of 256 colors, RGBA: by height, by tag (alpha: how much of it), by level. */
  paint(colors) {
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE0 + COLOR_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, this.#colors);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 3, gl.RGBA, gl.UNSIGNED_BYTE, colors);
  }

  /** Draws tiles; how many voxels they have. */
  draw(forest, tiles, { matrix, towardsEye, origin, cut, heights, coloring }) {
    const gl = this.#gl;
    const count = this.#listPages(forest, tiles, origin);
    if (count === 0) return 0;
    const { program, at } = this.#program;
    gl.useProgram(program);
    this.pages.bind();
    for (const [unit, texture] of [[LIST_UNIT, this.#list], [COLOR_UNIT, this.#colors]]) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    }
    gl.uniform1i(at.u_words, PAGE_UNIT);
    gl.uniform1i(at.u_list, LIST_UNIT);
    gl.uniform1i(at.u_colors, COLOR_UNIT);
    gl.uniformMatrix4fv(at.u_clip_from_map, false, Float32Array.from(matrix));
    gl.uniform4fv(at.u_towards_eye, towardsEye);
    gl.uniform3fv(at.u_cut_min, cut.min.map((value, axis) => value - origin[axis]));
    gl.uniform3fv(at.u_cut_max, cut.max.map((value, axis) => value - origin[axis]));
    gl.uniform2fv(at.u_heights, heights.map((height) => height - origin[2]));
    gl.uniform1f(at.u_resolution, forest.resolution);
    gl.uniform1i(at.u_coloring, coloring);
    gl.drawArrays(gl.TRIANGLES, 0, count * PAGE * VERTICES);
    return tiles.reduce((voxels, tile) => voxels + tile.words.length, 0);
  }

  /** Lists the pages that are drawn, where they are not listed yet; their number. */
  #listPages(forest, tiles, origin) {
    const isListed =
      this.#generation === this.pages.generation &&
      this.#listed.length === tiles.length &&
      tiles.every((tile, i) => tile === this.#listed[i]);
    if (isListed) return this.#count;
    let count = 0;
    for (const tile of tiles) {
      const { min } = forest.boxOf(tile);
      for (const page of tile.pages) {
        const at = 4 * count++;
        for (let axis = 0; axis < 3; axis++) this.#entries[at + axis] = min[axis] - origin[axis];
        this.#entries[at + 3] = page + PAGES_MAX * tile.level;
      }
    }
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE0 + LIST_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, this.#list);
    const rows = Math.ceil(count / LIST_WIDTH);
    if (rows > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, LIST_WIDTH, rows, gl.RGBA, gl.FLOAT, this.#entries);
    this.#listed = tiles;
    this.#generation = this.pages.generation;
    this.#count = count;
    return count;
  }
}
