// The tool that measures between two points of the map.

import { element, terms } from "./dom.js";
import { meters } from "./format.js";
import { rgba, theme } from "./palette.js";
import { Shape } from "./shapes.js";
import { length, subtract } from "./vector.js";

export class Ruler {
  title = "Ruler";
  hint = "Click two points.";
  panel = element("div");
  #page;
  #points = [];

  constructor(page) {
    this.#page = page;
  }

  clicked(hit) {
    if (!hit) return;
    if (this.#points.length === 2) this.#points = [];
    this.#points.push(hit.point);
    const shape = new Shape();
    const color = rgba(theme().accent);
    const size = this.#page.pixelsToMeters(6);
    for (const point of this.#points) shape.marker(point, size, color);
    shape.path(this.#points, color);
    this.#page.scene.show("ruler", shape, true);
    this.panel.replaceChildren();
    if (this.#points.length < 2) return;
    const apart = subtract(this.#points[1], this.#points[0]);
    const text = meters(length(apart));
    this.panel.append(
      terms([["distance", text], ["x, y, z", apart.map((value) => value.toFixed(3)).join(", ")], ["across", meters(Math.hypot(apart[0], apart[1]))]]),
    );
    this.#page.label("ruler", this.#points[0].map((value, axis) => value + apart[axis] / 2), text);
  }

  closed() {
    this.#points = [];
    this.panel.replaceChildren();
    this.#page.scene.show("ruler", undefined);
    this.#page.label("ruler", undefined);
  }
}
