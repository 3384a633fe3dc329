// The sliders that cut the map off along each axis.

import { byId, element } from "./dom.js";

const STEPS = 200;

/** Makes the sliders; `changed(cut)` is called with each motion. Returns what sets them to the bounds of a map. */
export function cutSliders(changed) {
  const host = byId("cuts");
  let bounds;
  // Ceilings are what people cut off: the heights come first.
  const [z, x, y] = ["z", "x", "y"].map((axis) => [-1, 1].map((side) => slider(axis, side)));
  const sliders = [x, y, z];

  function slider(axis, side) {
    const input = element("input", { type: "range", min: 0, max: STEPS, value: side < 0 ? 0 : STEPS, id: `cut-${axis}-${side < 0 ? "from" : "to"}` });
    const said = element("output");
    input.addEventListener("input", () => tell());
    host.append(element("label", { className: "slider" }, `${axis} ${side < 0 ? "from" : "to"}`, input, said));
    return { input, said };
  }

  function tell() {
    if (!bounds) return;
    const cut = { min: [], max: [] };
    sliders.forEach((pair, axis) => {
      pair.forEach(({ input, said }, i) => {
        const value = bounds.min[axis] + ((bounds.max[axis] - bounds.min[axis]) * input.valueAsNumber) / STEPS;
        // At its end a slider cuts nothing, even of what comes yet.
        const isEnd = input.valueAsNumber === (i === 0 ? 0 : STEPS);
        (i === 0 ? cut.min : cut.max).push(isEnd ? (i === 0 ? -Infinity : Infinity) : value);
        said.textContent = isEnd ? "all" : `${value.toFixed(1)} m`;
      });
    });
    changed(cut);
  }

  function open() {
    for (const [from, to] of sliders) [from.input.value, to.input.value] = [0, STEPS];
    tell();
  }

  byId("uncut").addEventListener("click", open);
  return {
    /** Starts anew, with nothing cut. */
    reset(of) {
      bounds = of;
      open();
    },
    /** Takes over how far the map reaches; what is cut stays so. */
    measure(of) {
      bounds = of;
    },
  };
}
