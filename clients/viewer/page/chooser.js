// The maps of the server: choosing one, making one, restoring one from a file; and what to do where there is none.

import { ask, pathOf, read, send } from "./api.js";
import { byId, element } from "./dom.js";
import { count, meters } from "./format.js";
import { notice } from "./notices.js";

const OTHER = /[^a-z0-9_-]+/g;

export class Chooser {
  maps = [];
  #page;

  constructor(page) {
    this.#page = page;
    byId("maps").addEventListener("change", (event) => page.open(event.target.value));
    byId("create").addEventListener("submit", (event) => {
      event.preventDefault();
      const { map, resolution } = event.target.elements;
      this.#create(map.value, resolution.valueAsNumber);
    });
    byId("file").addEventListener("change", (event) => this.#restore(event.target.files[0]));
    const drop = byId("drop");
    let isOver = 0;
    const over = (by) => (event) => {
      event.preventDefault();
      isOver = Math.max(0, isOver + by);
      drop.hidden = isOver === 0;
    };
    addEventListener("dragenter", over(1));
    addEventListener("dragleave", over(-1));
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      over(-Infinity)(event);
      this.#restore(event.dataTransfer.files[0]);
    });
  }

  /** Reads which maps there are. */
  async load() {
    const { maps, unavailable = [] } = await read("v1/maps");
    this.maps = maps;
    for (const { map, reason } of unavailable) notice(`The map ${map} could not be opened: ${reason}`, { isBad: true });
  }

  /** Shows the maps, with this one chosen. */
  show(chosen) {
    const option = ({ map, levels, settings }) =>
      element("option", { value: map, selected: map === chosen, title: `${count(levels[0].voxels)} voxels of ${meters(settings.resolution_m)}` }, map);
    const options = this.maps.map(option);
    if (!this.maps.some(({ map }) => map === chosen)) options.unshift(element("option", { value: "", selected: true, disabled: true }, "no map"));
    byId("maps").replaceChildren(...options);
    byId("maps").disabled = this.maps.length === 0;
  }

  async #create(map, resolution_m) {
    const made = await this.#page.attempt(() => send("PUT", pathOf(map), { resolution_m }));
    if (made) await this.#page.openNew(made.map);
  }

  /** Makes a map of a file, under the file's name. */
  async #restore(file) {
    if (!file) return;
    const name = file.name.toLowerCase().replace(/\.mrol$/, "").replace(OTHER, "-").replace(/^[-_]+/, "").slice(0, 64) || "restored";
    const headers = { "content-type": "application/octet-stream" };
    const put = async () => (await ask(pathOf(name, "snapshot"), { method: "PUT", headers, body: file })).json();
    const made = await this.#page.attempt(put);
    byId("file").value = "";
    if (!made) return;
    notice(`${file.name} was restored as ${made.map}.`);
    await this.#page.openNew(made.map);
  }
}

/** What stands in the middle where there is nothing to draw. */
export function showEmpty(title, text, commands) {
  const host = byId("empty");
  host.hidden = title === undefined;
  if (host.hidden) return;
  const said = [element("h1", {}, title), element("p", {}, text)];
  if (commands) said.push(element("pre", {}, commands));
  host.replaceChildren(...said);
}

/** Commands that put a first scan into a map of this server. */
export function firstCommands(map) {
  const address = location.origin + location.pathname.replace(/\/$/, "");
  const lines = [
    map ? "# a scan of three points, where it was taken" : "# make a map of 5 cm voxels",
    map ? "" : `curl -X PUT -H 'content-type: application/json' -d '{"resolution_m":0.05}' ${address}/v1/maps/office`,
    `curl -H 'content-type: application/json' -d '{"robot":"r1","points":[[1,2,0.5],[1,2.1,0.5],[1,2.2,0.5]],"align":false}' \\`,
    `     ${address}/v1/maps/${map ?? "office"}/scans`,
    "",
    "# or watch two simulated robots build one",
    "cargo run --release -- demo",
  ];
  return lines.filter((line, i) => line !== "" || i === 4).join("\n");
}
