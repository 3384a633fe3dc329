// The tool that says what a voxel is, and who saw it.

import { pathOf, read } from "./api.js";
import { button, byId, element, terms } from "./dom.js";
import { clock, meters, place } from "./format.js";
import { rgba, theme } from "./palette.js";
import { Shape } from "./shapes.js";

export class Picking {
  title = "Pick";
  hint = "Click a voxel.";
  #page;
  #panel = element("div");
  #picked;

  constructor(page) {
    this.#page = page;
  }

  get panel() {
    return this.#panel;
  }

  clicked(hit) {
    this.#picked = hit;
    this.#draw();
    if (!hit) return this.#panel.replaceChildren(element("p", { className: "hint" }, "No voxel is there."));
    const { forest } = this.#page.session;
    const { level, index, center } = hit;
    this.#panel.replaceChildren(
      terms([
        ["voxel", index.join(", ")],
        ["center", `${place(center)} m`],
        ["level", `${level}, ${meters(forest.side(level))} a side`],
      ]),
      element("div", { className: "row" }, button("Who saw it?", () => this.#observers(hit), { id: "observers" })),
    );
  }

  closed() {
    this.#picked = undefined;
    this.#panel.replaceChildren();
    this.#page.scene.show("picked", undefined);
  }

  async #observers({ level, index }) {
    const query = { voxel: index.join(","), level };
    const answer = await this.#page.attempt(() => read(pathOf(this.#page.session.name, "observers"), query));
    if (!answer) return;
    const scans = answer.scans.map((scan) => this.#page.scanItem(scan));
    const more = answer.older_scans ? element("p", { className: "hint" }, "There are older ones, or may be.") : null;
    const none = scans.length === 0 ? element("p", { className: "hint" }, "No scan that the journal still has.") : null;
    byId("observers")?.remove();
    this.#panel.append(element("ul", { className: "list", id: "observed" }, ...scans), ...[more, none].filter(Boolean));
  }

  #draw() {
    if (!this.#picked) return this.#page.scene.show("picked", undefined);
    const { level, center } = this.#picked;
    const half = this.#page.session.forest.side(level) * 0.52;
    const shape = new Shape();
    shape.box((at) => at.map((value, axis) => center[axis] + value * half), rgba(theme().accent), rgba(theme().accent, 0.45));
    this.#page.scene.show("picked", shape, true);
  }
}

/** A scan as one line: who, which, when. */
export function scanText({ robot, session, scan_id, revision, timestamp_ns }) {
  const number = scan_id === null ? `revision ${revision}` : `scan ${scan_id}`;
  const when = timestamp_ns > 1e18 ? `, ${clock(timestamp_ns / 1e6)}` : "";
  return `${robot}, ${number}${when}${session ? `, session ${session}` : ""}`;
}
