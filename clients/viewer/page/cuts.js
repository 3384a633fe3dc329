// What is cut off of the map along each axis, and the sliders that say so.

import { byId, element } from "./dom.js";

const STEPS = 200;
const AXES = ["x", "y", "z"];

export class Cuts {
  /** Corners of what is left, meters; infinite where nothing is cut. */
  cut = nothingCut();
  /** Somebody has set a cut, or has taken one away. */
  isByHand = false;
  #bounds;
  #sliders;
  #changed;

  /** `changed(cut)` is called with each motion. */
  constructor(changed) {
    this.#changed = changed;
    const host = byId("cuts");
    // Ceilings are what people cut off: the heights come first.
    this.#sliders = [2, 0, 1].flatMap((axis) => ["min", "max"].map((end) => this.#slider(host, axis, end)));
    byId("uncut").addEventListener("click", () => this.#byHand(nothingCut()));
  }

  get isAny() {
    return [...this.cut.min, ...this.cut.max].some(Number.isFinite);
  }

  /** Starts anew with a map: nothing is cut, or what a link says. */
  open(bounds, said) {
    this.#bounds = bounds;
    this.cut = cutOf(said) ?? nothingCut();
    this.isByHand = said !== undefined;
    this.#tell();
  }

  /** Takes over how far the map reaches; what is cut stays so. */
  measure(bounds) {
    this.#bounds = bounds;
    this.#show();
  }

  /** Leaves out what is above a height; without one nothing. */
  setTop(height = Infinity) {
    if (this.cut.max[2] === height) return;
    this.cut = { min: this.cut.min, max: [this.cut.max[0], this.cut.max[1], height] };
    this.#tell();
  }

  /** What a link says of it, once somebody has set it. */
  said() {
    if (!this.isByHand) return undefined;
    return [...this.cut.min, ...this.cut.max].map((value) => (Number.isFinite(value) ? value.toFixed(2) : "")).join(",");
  }

  #slider(host, axis, end) {
    const word = end === "min" ? "from" : "to";
    const input = element("input", { type: "range", min: 0, max: STEPS, id: `cut-${AXES[axis]}-${word}` });
    const said = element("output");
    input.addEventListener("input", () => {
      if (!this.#bounds) return;
      const { min, max } = this.#bounds;
      const value = min[axis] + ((max[axis] - min[axis]) * input.valueAsNumber) / STEPS;
      const cut = structuredClone(this.cut);
      // At its end a slider cuts nothing, even of what comes yet.
      cut[end][axis] = input.valueAsNumber === endOf(end) ? infiniteOf(end) : value;
      this.#byHand(cut);
    });
    host.append(element("label", { className: "slider" }, `${AXES[axis]} ${word}`, input, said));
    return { input, said, axis, end };
  }

  #byHand(cut) {
    this.cut = cut;
    this.isByHand = true;
    this.#tell();
  }

  #tell() {
    this.#show();
    this.#changed(this.cut);
  }

  #show() {
    for (const { input, said, axis, end } of this.#sliders) {
      const value = this.cut[end][axis];
      const { min, max } = this.#bounds ?? { min: [0, 0, 0], max: [1, 1, 1] };
      const step = Math.round(((value - min[axis]) / (max[axis] - min[axis])) * STEPS);
      input.value = Number.isFinite(value) ? step : endOf(end);
      said.textContent = Number.isFinite(value) ? `${value.toFixed(1)} m` : "all";
    }
  }
}

const endOf = (end) => (end === "min" ? 0 : STEPS);
const infiniteOf = (end) => (end === "min" ? -Infinity : Infinity);
const nothingCut = () => ({ min: Array(3).fill(-Infinity), max: Array(3).fill(Infinity) });

function cutOf(said) {
  const parts = (said ?? "").split(",");
  if (parts.length !== 6) return undefined;
  const values = parts.map((part, i) => (part !== "" && Number.isFinite(Number(part)) ? Number(part) : infiniteOf(i < 3 ? "min" : "max")));
  return { min: values.slice(0, 3), max: values.slice(3) };
}
