// Draws what is no voxel: lines, and surfaces that one can see through. Each layer is two buffers, drawn in one call each.

import { programOf } from "./gpu.js";

const FLOATS = 7;

const VERTEX = `
layout(location = 0) in vec3 a_place;
layout(location = 1) in vec4 a_color;
uniform mat4 u_clip_from_map;
out vec4 v_color;
void main() {
  gl_Position = u_clip_from_map * vec4(a_place, 1);
  v_color = a_color;
}`;

const FRAGMENT = `
in vec4 v_color;
out vec4 o_color;
void main() { o_color = vec4(v_color.rgb * v_color.a, v_color.a); }`;

/** Lines and triangles that are put together in map coordinates, in colors of four numbers from 0 to 1. */
export class Shape {
  lines = [];
  triangles = [];

  line(from, to, color) {
    this.lines.push(...from, ...color, ...to, ...color);
  }

  path(places, color) {
    for (let i = 1; i < places.length; i++) this.line(places[i - 1], places[i], color);
  }

  triangle(a, b, c, color) {
    this.triangles.push(...a, ...color, ...b, ...color, ...c, ...color);
  }

  quad(a, b, c, d, color) {
    this.triangle(a, b, c, color);
    this.triangle(a, c, d, color);
  }

  /** A polygon of corners x y between two heights. */
  prism(corners, [from, to], edge, face) {
    const at = ([x, y], z) => [x, y, z];
    corners.forEach((corner, i) => {
      const next = corners[(i + 1) % corners.length];
      this.line(at(corner, from), at(next, from), edge);
      this.line(at(corner, to), at(next, to), edge);
      this.line(at(corner, from), at(corner, to), edge);
      this.quad(at(corner, from), at(next, from), at(next, to), at(corner, to), face);
    });
  }

  /** The box from -1 to 1, as `place` puts it into the map. */
  box(place, edge, face) {
    const corner = (i) => place([i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1]);
    const edges = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];
    for (const [a, b] of edges) this.line(corner(a), corner(b), edge);
    if (!face) return;
    const faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    for (const of of faces) this.quad(...of.map(corner), face);
  }

  sphere([x, y, z], radius, edge, face) {
    const [STEPS, RINGS] = [32, 12];
    const at = (turn, tilt) => [
      x + radius * Math.cos(turn) * Math.cos(tilt),
      y + radius * Math.sin(turn) * Math.cos(tilt),
      z + radius * Math.sin(tilt),
    ];
    for (let i = 0; i < STEPS; i++) {
      const [a, b] = [i, i + 1].map((step) => (step / STEPS) * 2 * Math.PI);
      this.line(at(a, 0), at(b, 0), edge);
      this.line(at(0, a), at(0, b), edge);
      this.line(at(Math.PI / 2, a), at(Math.PI / 2, b), edge);
      if (!face) continue;
      for (let ring = 0; ring < RINGS; ring++) {
        const [low, high] = [ring, ring + 1].map((step) => (step / RINGS - 0.5) * Math.PI);
        this.quad(at(a, low), at(b, low), at(b, high), at(a, high), face);
      }
    }
  }

  /** This shape, which is whole: its numbers take no more room than they need. */
  sealed() {
    this.lines = Float64Array.from(this.lines);
    this.triangles = Float64Array.from(this.triangles);
    return this;
  }

  /** A small solid that marks a place. */
  marker([x, y, z], size, color) {
    const shade = (by) => [color[0] * by, color[1] * by, color[2] * by, color[3]];
    const ring = [[x + size, y, z], [x, y + size, z], [x - size, y, z], [x, y - size, z]];
    ring.forEach((corner, i) => {
      this.triangle(corner, ring[(i + 1) % 4], [x, y, z + 1.4 * size], shade(1 - 0.08 * i));
      this.triangle(corner, ring[(i + 1) % 4], [x, y, z - 1.4 * size], shade(0.75 - 0.08 * i));
    });
  }
}

/** Layers of shapes, by name. */
export class Shapes {
  #gl;
  #program;
  #layers = new Map();
  calls = 0;

  constructor(gl) {
    this.#gl = gl;
    this.#program = programOf(gl, VERTEX, FRAGMENT);
  }

  /** Shows a shape in the place of the layer's last one; none takes the layer away. */
  show(name, shape, origin, isOnTop = false) {
    const gl = this.#gl;
    const layer = this.#layers.get(name);
    if (!shape) {
      if (layer) for (const { buffer, array } of layer.parts) gl.deleteBuffer(buffer), gl.deleteVertexArray(array);
      this.#layers.delete(name);
      return;
    }
    const parts = layer?.parts ?? [gl.TRIANGLES, gl.LINES].map((mode) => this.#part(mode));
    [shape.triangles, shape.lines].forEach((numbers, i) => {
      const data = Float32Array.from(numbers);
      for (let at = 0; at < data.length; at += FLOATS) {
        for (let axis = 0; axis < 3; axis++) data[at + axis] = numbers[at + axis] - origin[axis];
      }
      parts[i].count = data.length / FLOATS;
      gl.bindBuffer(gl.ARRAY_BUFFER, parts[i].buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    });
    this.#layers.set(name, { parts, isOnTop });
  }

  #part(mode) {
    const gl = this.#gl;
    const part = { mode, buffer: gl.createBuffer(), array: gl.createVertexArray(), count: 0 };
    gl.bindVertexArray(part.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, part.buffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, FLOATS * 4, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 4, gl.FLOAT, false, FLOATS * 4, 12);
    gl.bindVertexArray(null);
    return part;
  }

  draw(matrix) {
    const gl = this.#gl;
    const { program, at } = this.#program;
    gl.useProgram(program);
    gl.uniformMatrix4fv(at.u_clip_from_map, false, Float32Array.from(matrix));
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.calls = 0;
    const layers = Array.from(this.#layers.values()).sort((a, b) => a.isOnTop - b.isOnTop);
    for (const { parts, isOnTop } of layers) {
      (isOnTop ? gl.disable : gl.enable).call(gl, gl.DEPTH_TEST);
      for (const { mode, array, count } of parts) {
        if (count === 0) continue;
        // What one sees through hides nothing behind it.
        gl.depthMask(mode === gl.LINES);
        gl.bindVertexArray(array);
        gl.drawArrays(mode, 0, count);
        this.calls += 1;
      }
    }
    gl.bindVertexArray(null);
    gl.depthMask(true);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
  }
}
