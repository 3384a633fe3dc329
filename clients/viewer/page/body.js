// The tool that asks whether a robot fits where one clicks: an upright body of balls.

import { pathOf, send } from "./api.js";
import { element, numberField, terms } from "./dom.js";
import { meters, place } from "./format.js";
import { rgba, theme } from "./palette.js";
import { Shape } from "./shapes.js";

/** Clearances are told up to this. */
const CLEARANCE_MAX_M = 1;
const BALLS_MAX = 64;

export class BodyTool {
  title = "Does a robot fit?";
  hint = "Click where it would stand.";
  panel = element("div");
  #page;
  #radius = 0.25;
  #height = 1;
  #lift = 0.05;
  #isUnknownMet = false;
  #hit;
  #answer = element("div");

  constructor(page) {
    this.#page = page;
    const field = (label, value, set) => numberField(label, value, "m", (to) => (set(to), this.#ask()), { min: 0 });
    const unknown = element("input", { type: "checkbox" });
    unknown.addEventListener("change", () => ((this.#isUnknownMet = unknown.checked), this.#ask()));
    this.panel.append(
      field("radius", this.#radius, (to) => (this.#radius = to)),
      field("height", this.#height, (to) => (this.#height = to)),
      field("above the floor", this.#lift, (to) => (this.#lift = to)),
      element("label", {}, unknown, "what is unknown counts as occupied"),
      this.#answer,
    );
  }

  clicked(hit) {
    if (!hit) return;
    this.#hit = hit;
    this.#ask();
  }

  closed() {
    this.#hit = undefined;
    this.#answer.replaceChildren();
    this.#page.scene.show("body", undefined);
  }

  /** Balls over each other, from the foot of the body to its head. */
  #balls() {
    const [radius, height] = [Math.max(this.#radius, 0.001), Math.max(this.#height, 2 * this.#radius)];
    const number = Math.min(Math.max(Math.ceil((height - 2 * radius) / radius) + 1, 1), BALLS_MAX);
    const rise = number > 1 ? (height - 2 * radius) / (number - 1) : 0;
    return Array.from({ length: number }, (_, i) => [0, 0, radius + i * rise, radius]);
  }

  async #ask() {
    if (!this.#hit) return;
    const foot = [...this.#hit.point.slice(0, 2), this.#hit.point[2] + this.#lift];
    const spheres = this.#balls();
    const body = {
      body: { links: [{ spheres }] },
      configurations: [[...foot, 0, 0, 0, 1]],
      answer: "clearance",
      clearance_max_m: CLEARANCE_MAX_M,
      unknown: this.#isUnknownMet ? "occupied" : "free",
    };
    const answer = await this.#page.attempt(() => send("POST", pathOf(this.#page.session.name, "poses"), body));
    if (!answer) return;
    const [collides, clearance] = [answer.colliding[0], answer.clearances_m[0]];
    const color = collides ? theme().keepOut : theme().free;
    const shape = new Shape();
    for (const [, , z, radius] of spheres) shape.sphere([foot[0], foot[1], foot[2] + z], radius, rgba(color), rgba(color, 0.12));
    this.#page.scene.show("body", shape, true);
    const room = clearance === null || clearance >= CLEARANCE_MAX_M ? `${meters(CLEARANCE_MAX_M)} or more` : meters(clearance);
    this.#answer.replaceChildren(
      terms([["stands at", place(foot)], ["it", collides ? "does not fit" : "fits"], ["clearance", collides ? undefined : room]]),
    );
  }
}
