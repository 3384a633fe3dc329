// The tool that marks a box or a ball, to delete the voxels in it or to keep robots out.

import { pathOf, read, requestId, send } from "./api.js";
import { button, element, numberField } from "./dom.js";
import { count } from "./format.js";
import { addRegion } from "./layers.js";
import { notice } from "./notices.js";
import { rgba, theme } from "./palette.js";
import { Shape } from "./shapes.js";

export class RegionTool {
  title = "Region";
  hint = "Click where its middle is.";
  panel = element("div");
  #page;
  #center;
  #kind = "sphere";
  #radius = 0.5;
  #size = [1, 1, 1];

  constructor(page) {
    this.#page = page;
  }

  clicked(hit) {
    if (!hit) return;
    this.#center = hit.point.map((value) => Number(value.toFixed(3)));
    this.#show();
  }

  closed() {
    this.#center = undefined;
    this.panel.replaceChildren();
    this.#page.scene.show("region", undefined);
  }

  /** The region as JSON has it. */
  #region() {
    if (this.#kind === "sphere") return { sphere: { center_m: this.#center, radius_m: this.#radius } };
    const corner = (sign) => this.#center.map((value, axis) => value + (sign * this.#size[axis]) / 2);
    return { box: { min_m: corner(-1), max_m: corner(1) } };
  }

  #draw() {
    const shape = new Shape();
    addRegion(shape, this.#region(), rgba(theme().accent), rgba(theme().accent, 0.22));
    this.#page.scene.show("region", shape, true);
  }

  #show() {
    this.#draw();
    const kinds = ["sphere", "box"].map((kind) => {
      const input = element("input", { type: "radio", name: "region-kind", value: kind, checked: kind === this.#kind });
      input.addEventListener("change", () => ((this.#kind = kind), this.#show()));
      return element("label", {}, input, kind === "sphere" ? "ball" : kind);
    });
    const field = (label, value, set) => numberField(label, value, "m", (to) => (set(to), this.#draw()));
    const sizes = ["length", "width", "height"].map((label, axis) =>
      field(label, this.#size[axis], (to) => (this.#size[axis] = Math.abs(to) || 0.01)),
    );
    const radius = field("radius", this.#radius, (to) => (this.#radius = Math.abs(to)));
    const center = ["x", "y", "z"].map((label, axis) => field(label, this.#center[axis], (to) => (this.#center[axis] = to)));
    const name = element("input", { type: "text", placeholder: "name", id: "keep-out-name", autocomplete: "off" });
    this.panel.replaceChildren(
      element("fieldset", { className: "choice" }, ...kinds),
      ...(this.#kind === "sphere" ? [radius] : sizes),
      ...center,
      element("div", { className: "row" }, button("Delete voxels", () => this.#delete(), { className: "first", id: "delete" })),
      element("div", { className: "row" }, name, button("Keep out", () => this.#keepOut(name.value.trim()), { id: "keep-out" })),
    );
  }

  async #delete() {
    const { session } = this.#page;
    const body = { ...this.#region(), request_id: requestId() };
    const answer = await this.#page.attempt(() => send("POST", pathOf(session.name, "deletions"), body));
    if (!answer) return;
    if (answer.removed === 0) return notice("There was no voxel in it.");
    const undo = ["Undo", () => this.#page.undo({ revision: answer.revision })];
    notice(`${count(answer.removed)} voxels deleted.`, { action: undo });
  }

  async #keepOut(name) {
    const path = pathOf(this.#page.session.name, "keep-outs", name || "keep-out");
    const put = () => send("PUT", path, { ...this.#region(), request_id: requestId() });
    if (await this.#page.attempt(put)) this.#page.useTool("pick");
  }
}

/** Takes a keep-out away. */
export async function removeKeepOut(page, name) {
  const path = pathOf(page.session.name, "keep-outs", name);
  await page.attempt(() => read(path, { request_id: requestId() }, { method: "DELETE" }));
}
