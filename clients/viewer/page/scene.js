// The picture: draws a map's tiles and what lies over them when something has changed, and rests otherwise.

import { Camera } from "./camera.js";
import { choose } from "./detail.js";
import { TILES_MAX } from "./forest.js";
import { rgba, theme, voxelColors, whenThemeChanges } from "./palette.js";
import { pick } from "./pick.js";
import { isAnySeen } from "./seen.js";
import { Shapes } from "./shapes.js";
import { clamp } from "./vector.js";
import { Voxels } from "./voxels.js";

/** Pixels that a voxel may take up before finer ones are looked for. */
const PIXELS_MAX = 3;
/** How much coarser the picture may be while it moves, where the machine is slow. */
const COARSER_MAX = 12;
/** How much coarser one slow frame makes the next. */
const COARSEN_MAX = 3;
const SLOW_FRAME_MS = 55;
const FAST_FRAME_MS = 22;
const STILL_MS = 250;
/** Milliseconds for which tiles are made ready at once, between frames. */
const BUILD_MS = 2.5;
/** While tiles are made ready, the picture follows this often. */
const BUILD_SHOWN_MS = 200;
const VOXELS_MAX = 2_500_000;
/** Tiles that are kept; each takes 32 KiB and its words. */
const KEPT_MS = 3_000;
/** Share of the coarsest voxels at each end of each axis that may be stray ones. */
export const STRAY = 0.02;
const COLORINGS = { height: 0, level: 1, robot: 2, age: 3 };
const EVERYWHERE = { min: Array(3).fill(-Infinity), max: Array(3).fill(Infinity) };
const FAR = 1e9;

export class Scene {
  camera = new Camera();
  coloring = "height";
  finest = 0;
  cut = EVERYWHERE;
  /** What is 0 for the GPU, whose floats would not tell far places apart. */
  origin = [0, 0, 0];
  /** What the last picture was made of. */
  drawn = { tiles: 0, voxels: 0, calls: 0, script_ms: 0, is_complete: false };
  #canvas;
  #gl;
  #voxels;
  #shapes;
  #forest;
  #loader;
  #arrivals;
  #heights = [0, 3];
  #shown = [];
  #layers = new Map();
  #scheduled = false;
  #building = undefined;
  #builtShownAt = 0;
  #frameAt = 0;
  #scheduledAt = 0;
  #scriptMs = 0;
  #movedAt = -Infinity;
  #isMoving = false;
  /** How much coarser than at rest it is drawn while it moves; kept for the next motion. */
  #coarser = 1;
  #heard = new Set();
  #isPaintNeeded = true;

  constructor(canvas) {
    this.#canvas = canvas;
    this.#gl = canvas.getContext("webgl2", { antialias: true, powerPreference: "high-performance" });
    if (!this.#gl) throw new Error("WebGL2 is not to be had in this browser.");
    this.#prepare();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.#prepare());
    new ResizeObserver(() => this.invalidate()).observe(canvas);
    whenThemeChanges(() => this.repaint());
  }

  /** Makes what the GPU holds; again, where it lost all. */
  #prepare() {
    this.#voxels = new Voxels(this.#gl);
    this.#shapes = new Shapes(this.#gl);
    for (const tile of this.#forest?.tiles() ?? []) Object.assign(tile, { pages: [], isChanged: true, isDrawable: false });
    for (const [name, { shape, isOnTop }] of this.#layers) this.#shapes.show(name, shape, this.origin, isOnTop);
    this.repaint();
  }

  /** Shows another map; without one, nothing. */
  open(forest, loader, arrivals) {
    for (const tile of this.#forest?.tiles() ?? []) this.#voxels.pages.release(tile);
    for (const name of Array.from(this.#layers.keys())) this.show(name, undefined);
    this.#forest = forest;
    this.#loader = loader;
    this.#arrivals = arrivals;
    this.#shown = [];
    this.cut = EVERYWHERE;
    this.origin = (forest?.bounds()?.min ?? [0, 0, 0]).map(Math.round);
    this.repaint();
  }

  /** Takes over how far the map reaches by now, and most of it. */
  measure(bounds, { min, max }) {
    this.#heights = [min[2], Math.max(max[2], min[2] + 0.1)];
    this.camera.reach = 2 * Math.hypot(...bounds.max.map((value, axis) => value - bounds.min[axis])) + 20;
    this.invalidate();
  }

  /** Calls `heard` after each picture. */
  whenDrawn(heard) {
    this.#heard.add(heard);
  }

  /** Shows a shape as the layer of that name; none takes the layer away. */
  show(name, shape, isOnTop = false) {
    // Kept for when the browser takes the GPU's memory away.
    if (shape) this.#layers.set(name, { shape: shape.sealed(), isOnTop });
    else this.#layers.delete(name);
    this.#shapes.show(name, shape, this.origin, isOnTop);
    this.invalidate();
  }

  /** Draws soon. */
  invalidate() {
    if (this.#scheduled) return;
    this.#scheduled = true;
    this.#scheduledAt = performance.now();
    requestAnimationFrame(() => this.#frame());
  }

  /** The colors have changed. */
  repaint() {
    this.#isPaintNeeded = true;
    this.invalidate();
  }

  /** The camera moves: rather fast than fine. */
  moved() {
    this.#movedAt = performance.now();
    this.invalidate();
  }

  /** A point of the page as a ray. */
  rayAt(x, y) {
    const { left, top, width, height } = this.#canvas.getBoundingClientRect();
    return this.camera.ray([((x - left) / width) * 2 - 1, 1 - ((y - top) / height) * 2]);
  }

  pickAt(x, y) {
    return this.#forest && pick(this.#forest, this.#shown, this.rayAt(x, y), this.cut);
  }

  /** What the picture shows of the map: "voxels", "cut" where they are cut off, or "nothing". */
  seen() {
    if (!this.#forest || this.#forest.roots.size === 0) return "voxels";
    const aim = { matrix: this.camera.clipFromMap(this.origin), origin: this.origin };
    if (isAnySeen(this.#forest, this.#shown, { ...aim, cut: this.cut })) return "voxels";
    return isAnySeen(this.#forest, this.#forest.roots, { ...aim, cut: EVERYWHERE }) && this.cut !== EVERYWHERE ? "cut" : "nothing";
  }

  /** Where in the page a place of the map is; none behind the eye. */
  pageOf(place) {
    const m = this.camera.clipFromMap(this.origin);
    const at = place.map((value, axis) => value - this.origin[axis]);
    const clip = [0, 1, 3].map((row) => m[row] * at[0] + m[4 + row] * at[1] + m[8 + row] * at[2] + m[12 + row]);
    if (clip[2] <= 0) return undefined;
    const { clientWidth, clientHeight } = this.#canvas;
    return [((clip[0] / clip[2] + 1) / 2) * clientWidth, ((1 - clip[1] / clip[2]) / 2) * clientHeight];
  }

  #frame() {
    this.#scheduled = false;
    const begin = performance.now();
    // A frame may come so late that the motion which asked for it seems to be over.
    this.#isMoving = this.#movedAt >= this.#frameAt || begin - this.#movedAt < STILL_MS;
    this.#adapt(begin);
    this.#resize();
    if (this.#isPaintNeeded) this.#paint();
    const gl = this.#gl;
    gl.viewport(0, 0, this.#canvas.width, this.#canvas.height);
    gl.clearColor(...rgba(theme().background));
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const matrix = this.camera.clipFromMap(this.origin);
    this.drawn = { tiles: 0, voxels: 0, calls: 0, script_ms: 0, is_complete: true };
    if (this.#forest) this.#drawMap(matrix, begin);
    this.#shapes.draw(matrix);
    this.drawn.calls += this.#shapes.calls;
    this.drawn.script_ms = performance.now() - begin;
    for (const heard of this.#heard) heard();
    this.#scriptMs = this.drawn.script_ms;
    // Once it rests, all is drawn.
    if (this.#isMoving && this.#coarser > 1) setTimeout(() => this.invalidate(), STILL_MS);
  }

  #drawMap(matrix, begin) {
    const forest = this.#forest;
    const isBuilt = this.#changed().length === 0;
    if (!isBuilt) this.#building ??= setTimeout(() => this.#build());
    const cut = { min: this.cut.min.map((value) => Math.max(value, -FAR)), max: this.cut.max.map((value) => Math.min(value, FAR)) };
    const coarser = this.#isMoving ? this.#coarser : 1;
    const pixelsMax = PIXELS_MAX * devicePixelRatio * coarser;
    const aim = { camera: this.camera, matrix, origin: this.origin, pixelsHigh: this.#canvas.height, pixelsMax };
    const chosen = choose(forest, { ...aim, finest: this.finest, cut, voxelsMax: VOXELS_MAX });
    const isSame = chosen.shown.length === this.#shown.length && chosen.shown.every((tile, i) => tile === this.#shown[i]);
    if (!isSame) this.#shown = chosen.shown;
    this.#makeRoom(begin);
    this.#loader.want(forest.size < TILES_MAX ? chosen.wanted : []);
    const voxels = this.#voxels.draw(forest, this.#shown, {
      matrix,
      towardsEye: this.camera.towardsEye(this.origin),
      origin: this.origin,
      cut,
      heights: this.#heights,
      coloring: COLORINGS[this.coloring],
    });
    const is_complete = isBuilt && chosen.wanted.length === 0 && !this.#loader.isBusy && coarser === 1;
    this.drawn = { tiles: this.#shown.length, voxels, calls: 1, script_ms: 0, is_complete };
  }

  /** Tiles that are not as the GPU has them; the first to be made ready comes first. */
  #changed() {
    const changed = Array.from(this.#forest?.tiles() ?? []).filter((tile) => tile.isChanged);
    return changed.sort((a, b) => a.isDrawable - b.isDrawable || b.level - a.level);
  }

  /** Makes changed tiles ready to be drawn, a few at a time, so that the page answers in between. */
  #build() {
    const begin = performance.now();
    let left = this.#changed();
    while (left.length > 0 && performance.now() - begin < BUILD_MS) {
      const tile = left.shift();
      tile.build(tile.isUntagged ? this.#arrivals?.tags.of(tile) : undefined);
      // Without room it stays away, and its parent is drawn instead.
      tile.isDrawable = this.#voxels.pages.write(tile);
    }
    this.#building = left.length > 0 ? setTimeout(() => this.#build()) : undefined;
    if (left.length > 0 && begin - this.#builtShownAt < BUILD_SHOWN_MS) return;
    this.#builtShownAt = begin;
    this.invalidate();
  }

  /** Lets tiles go that have not been drawn for a while, where there are too many. */
  #makeRoom(now) {
    const { pages } = this.#voxels;
    if (this.#forest.size < TILES_MAX * 0.9 && pages.free > pages.count * 0.1) return;
    const old = Array.from(this.#forest.tiles()).filter((tile) => tile.level < this.#forest.top && now - tile.drawnAt > KEPT_MS);
    old.sort((a, b) => a.drawnAt - b.drawnAt);
    for (const tile of old.slice(0, Math.ceil(old.length / 2))) {
      pages.release(tile);
      this.#forest.remove(tile);
    }
  }

  /** Draws coarser for as long as the camera moves and frames come slowly. */
  #adapt(now) {
    // Frames come as fast as they are drawn, but none while nobody asks for one.
    const took = Math.max(now - Math.max(this.#frameAt, this.#scheduledAt), this.#scriptMs);
    this.#frameAt = now;
    if (!this.#isMoving) return;
    if (took > SLOW_FRAME_MS) this.#coarser = clamp(this.#coarser * clamp(Math.sqrt(took / SLOW_FRAME_MS), 1.2, COARSEN_MAX), 1, COARSER_MAX);
    else if (took < FAST_FRAME_MS) this.#coarser = Math.max(this.#coarser / 1.1, 1);
  }

  #resize() {
    const { clientWidth, clientHeight } = this.#canvas;
    const [width, height] = [clientWidth, clientHeight].map((size) => Math.max(1, Math.round(size * clamp(devicePixelRatio, 1, 2))));
    if (this.#canvas.width !== width || this.#canvas.height !== height) Object.assign(this.#canvas, { width, height });
    this.camera.aspect = width / height;
  }

  #paint() {
    this.#isPaintNeeded = false;
    this.#voxels.paint(voxelColors((tag) => this.#arrivals?.colorOf(tag, this.coloring === "age")));
  }
}
