// Draws the tiles of the page twice, each in a context of its own: as the page does, and as instances of a box, which is the usual
// way. The same voxels, camera and size. For `figures_of_two_ways` in figures.rs, which asks for frames in turn.
const load = (name) => import(new URL(`viewer/${name}`, document.baseURI));
const [{ page }, { Voxels }, { programOf }] = await Promise.all(["main.js", "voxels.js", "gpu.js"].map(load));
const { scene, session } = page;
const [WIDTH, HEIGHT] = [1280, 800];
const forest = session.forest;
// The finest that the page has: of a larger site those are not the finest of the map.
const level = Math.min(...Array.from(forest.tiles(), (tile) => tile.level));
const tiles = Array.from(forest.tiles()).filter((tile) => tile.level === level);
const side = forest.resolution * 2 ** level;
const voxels = tiles.reduce((sum, tile) => sum + tile.words.length, 0);
scene.camera.aspect = WIDTH / HEIGHT;
const matrix = scene.camera.clipFromMap(scene.origin);
const FAR = 1e6;

function context() {
  const canvas = Object.assign(document.createElement("canvas"), { width: WIDTH, height: HEIGHT });
  const gl = canvas.getContext("webgl2", { antialias: false });
  gl.viewport(0, 0, WIDTH, HEIGHT);
  gl.enable(gl.DEPTH_TEST);
  return gl;
}

function ofThePage() {
  const gl = context();
  const drawer = new Voxels(gl);
  drawer.paint(new Uint8Array(256 * 3 * 4).fill(200));
  const own = tiles.map(({ level, index, words }) => ({ level, index, words, pages: [] }));
  if (!own.every((tile) => drawer.pages.write(tile))) throw new Error("no room");
  const view = {
    matrix,
    towardsEye: scene.camera.towardsEye(scene.origin),
    origin: scene.origin,
    cut: { min: [-FAR, -FAR, -FAR], max: [FAR, FAR, FAR] },
    heights: [0, 1],
    coloring: 0,
  };
  const pages = own.reduce((sum, tile) => sum + tile.pages.length, 0);
  return { gl, bytes: pages * 1024, draw: () => drawer.draw(forest, own, view) };
}

function ofInstances() {
  const gl = context();
  const vertex = `
    layout(location = 0) in vec3 a_corner;
    layout(location = 1) in vec3 a_center;
    uniform mat4 u_clip_from_map;
    uniform float u_side;
    out vec3 v_at;
    void main() { v_at = a_corner; gl_Position = u_clip_from_map * vec4(a_center + a_corner * u_side, 1); }`;
  const fragment = `
    in vec3 v_at;
    out vec4 o_color;
    void main() {
      vec3 normal = normalize(cross(dFdx(v_at), dFdy(v_at)));
      o_color = vec4(vec3(0.8) * dot(abs(normal), vec3(0.80, 0.90, 1.0)), 1);
    }`;
  const { program, at } = programOf(gl, vertex, fragment);
  const centers = new Float32Array(3 * voxels);
  let count = 0;
  for (const tile of tiles) {
    const { min } = forest.boxOf(tile);
    for (const word of tile.words) {
      [word & 63, (word >> 6) & 63, (word >> 12) & 63].forEach((cell, axis) => {
        centers[3 * count + axis] = min[axis] - scene.origin[axis] + (cell + 0.5) * side;
      });
      count++;
    }
  }
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [i & 1, (i >> 1) & 1, i >> 2].map((bit) => bit - 0.5));
  const faces = [0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5];
  const buffer = (target, data) => (gl.bindBuffer(target, gl.createBuffer()), gl.bufferData(target, data, gl.STATIC_DRAW));
  buffer(gl.ARRAY_BUFFER, new Float32Array(corners));
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  buffer(gl.ARRAY_BUFFER, centers);
  gl.enableVertexAttribArray(1);
  gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 0, 0);
  gl.vertexAttribDivisor(1, 1);
  buffer(gl.ELEMENT_ARRAY_BUFFER, new Uint8Array(faces));
  gl.enable(gl.CULL_FACE);
  const draw = () => {
    gl.useProgram(program);
    gl.uniformMatrix4fv(at.u_clip_from_map, false, Float32Array.from(matrix));
    gl.uniform1f(at.u_side, side);
    gl.drawElementsInstanced(gl.TRIANGLES, 36, gl.UNSIGNED_BYTE, 0, voxels);
  };
  return { gl, bytes: centers.byteLength, draw };
}

/** A frame, to its end; how many pixels it colors. */
function frame({ gl, draw }) {
  const begin = performance.now();
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  draw();
  const pixels = new Uint8Array(4 * WIDTH * HEIGHT);
  gl.readPixels(0, 0, WIDTH, HEIGHT, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const took = performance.now() - begin;
  let colored = 0;
  for (let i = 3; i < pixels.length; i += 4) colored += pixels[i] !== 0;
  return { took, colored };
}

const ways = [ofThePage(), ofInstances()];
globalThis.frameOf = (way) => frame(ways[way]);
return { level, voxels, bytes_a_voxel: ways.map(({ bytes }) => bytes / voxels) };
