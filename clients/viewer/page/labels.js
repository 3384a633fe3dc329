// Names that stand over places of the map.

import { dot, element } from "./dom.js";

const LABELS_MAX = 60;

export class Labels {
  #scene;
  #host;
  #labels = new Map();

  constructor(scene, host) {
    this.#scene = scene;
    this.#host = host;
    scene.whenDrawn(() => this.#place());
  }

  /** Puts a label over a place; without a place it goes. Of labels that would cover each other the first is shown. */
  put(name, place, text, { color, isBad = false } = {}) {
    const label = this.#labels.get(name);
    if (!place) {
      label?.shown.remove();
      this.#labels.delete(name);
      return;
    }
    if (!label && this.#labels.size >= LABELS_MAX) return;
    const shown = label?.shown ?? this.#host.appendChild(element("span"));
    shown.replaceChildren(...(color ? [dot(color)] : []), text);
    shown.classList.toggle("bad", isBad);
    this.#labels.set(name, { shown, place, size: [shown.offsetWidth, shown.offsetHeight] });
    this.#scene.invalidate();
  }

  /** Takes away those whose names begin so. */
  clear(prefix) {
    for (const name of Array.from(this.#labels.keys())) if (name.startsWith(prefix)) this.put(name, undefined);
  }

  #place() {
    const taken = [];
    for (const { shown, place, size } of this.#labels.values()) {
      const at = this.#scene.pageOf(place);
      const isCovered = ([x, y, [width, height]]) => Math.abs(at[0] - x) < (size[0] + width) / 2 && Math.abs(at[1] - y) < (size[1] + height) / 2;
      shown.hidden = !at || taken.some(isCovered);
      if (shown.hidden) continue;
      taken.push([...at, size]);
      shown.style.transform = `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px) translate(-50%, -150%)`;
    }
  }
}
