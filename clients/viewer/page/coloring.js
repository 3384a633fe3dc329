// What the colors of voxels say, as it is chosen in the panel.

import { byId } from "./dom.js";
import { failed } from "./notices.js";

export class Coloring {
  #scene;
  #session;

  /** `changed()` is called when somebody has chosen another coloring. */
  constructor(scene, changed) {
    this.#scene = scene;
    byId("coloring").addEventListener("change", (event) => (this.set(event.target.value), changed()));
  }

  /** Begins with a map, and with the coloring that a link names. */
  open(session, coloring) {
    this.#session = session;
    this.set(coloring ?? this.#scene.coloring);
  }

  set(coloring) {
    const chosen = Array.from(byId("coloring").querySelectorAll("input")).find((input) => input.value === coloring);
    if (!chosen) return;
    chosen.checked = true;
    this.#scene.coloring = coloring;
    this.#scene.repaint();
    const isOfScans = ["robot", "age"].includes(coloring);
    byId("coloring-hint").hidden = !isOfScans;
    if (isOfScans && this.#session) this.#readPast(this.#session, coloring);
  }

  async #readPast(session, coloring) {
    byId("coloring-hint").textContent = "Reading which scans brought what is here.";
    const said = await session.readPast().then((first) => saidOf(coloring, first, session), (problem) => (session === this.#session && failed(problem), saidOf(coloring, undefined, session)));
    if (session !== this.#session || this.#scene.coloring !== coloring) return;
    byId("coloring-hint").textContent = said;
    this.#scene.repaint();
  }
}

function saidOf(coloring, first, { revision, arrivals }) {
  const by = coloring === "age" ? "The newest scans are the strongest in color, the oldest the palest." : "By the robot that saw a voxel first.";
  if (arrivals.tags.isFull) return `${by} This map has more voxels than this page keeps scans of: others are gray.`;
  if (first === 1 || revision === 0) return by;
  const since = first === undefined ? "scans that came while this page was open: the server has no older ones of this map" : `scans since revision ${first}`;
  return `${by} Of ${since}; others are gray.`;
}
