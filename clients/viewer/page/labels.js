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

  /** Puts a label over a place; without a place it goes. */
  put(name, place, text, color) {
    const label = this.#labels.get(name);
    if (!place) {
      label?.shown.remove();
      this.#labels.delete(name);
      return;
    }
    if (!label && this.#labels.size >= LABELS_MAX) return;
    const shown = label?.shown ?? this.#host.appendChild(element("span"));
    shown.replaceChildren(...(color ? [dot(color)] : []), text);
    this.#labels.set(name, { shown, place });
    this.#scene.invalidate();
  }

  /** Takes away those whose names begin so. */
  clear(prefix) {
    for (const name of Array.from(this.#labels.keys())) if (name.startsWith(prefix)) this.put(name, undefined);
  }

  #place() {
    for (const { shown, place } of this.#labels.values()) {
      const at = this.#scene.pageOf(place);
      shown.hidden = !at;
      if (at) shown.style.transform = `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px) translate(-50%, -150%)`;
    }
  }
}
