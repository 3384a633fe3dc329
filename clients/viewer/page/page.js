// The page: one map that is open, the tools, and the panel beside the picture.

import { pathOf, requestId, send } from "./api.js";
import { showAnswers } from "./answers.js";
import { BodyTool } from "./body.js";
import { Chooser, firstCommands, showEmpty } from "./chooser.js";
import * as connection from "./connection.js";
import { control } from "./controls.js";
import { cutSliders } from "./cuts.js";
import { button, byId, dot, element } from "./dom.js";
import { freeSpace, frontiers } from "./explored.js";
import { count, meters } from "./format.js";
import { Labels } from "./labels.js";
import { grid, keepOutShapes, paths, refusedScans, robotMarkers, scaleBar, topOf } from "./layers.js";
import { cameraParts, placeCamera, readLink, writeLink } from "./link.js";
import { failed, notice } from "./notices.js";
import { robotColor, theme, whenThemeChanges } from "./palette.js";
import { Picking, scanText } from "./picking.js";
import { RegionTool, removeKeepOut } from "./region.js";
import { Ruler } from "./ruler.js";
import { Scene, STRAY } from "./scene.js";
import { Session } from "./session.js";

const SCANS_SHOWN = 100;
/** Lists and layers follow changes at most this often. */
const FOLLOW_MS = 300;
const SECOND_MS = 1000;
const LOOK_FOR_ROBOTS_MS = 5000;
/** Heights above the lowest voxel between which free space is shown, meters. */
const BAND_M = [0.2, 1.6];
const PANEL_PIXELS = 290;
const NARROW_PIXELS = 760;

export class Page {
  session;
  #tool;
  #tools;
  #bounds;
  /** The bounds of most of the map. */
  #bulk;
  #following;
  /** Which refused scans are drawn. */
  #refused;
  #isFollowed = true;
  #opening = 0;

  constructor() {
    this.scene = new Scene(byId("picture"));
    this.labels = new Labels(this.scene, byId("labels"));
    this.chooser = new Chooser(this);
    this.cuts = cutSliders((cut) => {
      this.scene.cut = cut;
      this.scene.moved();
    });
    this.#tools = { pick: new Picking(this), ruler: new Ruler(this), region: new RegionTool(this), body: new BodyTool(this) };
    const moved = () => {
      this.#isFollowed = false;
      this.scene.moved();
      this.#writeLink();
    };
    control(byId("picture"), this.scene.camera, { moved, clicked: (x, y) => this.#clicked(x, y) });
    this.#wire();
    this.useTool("pick");
    this.scene.whenDrawn(() => this.#drawn());
    whenThemeChanges(() => this.#showLayers());
    setInterval(() => this.scene.coloring === "age" && this.scene.repaint(), SECOND_MS);
    setInterval(() => this.session && !document.hidden && this.session.lookForRobots(), LOOK_FOR_ROBOTS_MS);
    setInterval(() => document.hidden || this.#askForAnswers(), SECOND_MS);
  }

  /** Reads the maps, and opens the one that the link names, or the first. */
  async start() {
    const wanted = readLink();
    const again = () => this.start();
    if (!(await this.attempt(async () => (await this.chooser.load(), true), again))) {
      return showEmpty("No map can be shown", "The server did not tell its maps. When it does, they are here.", undefined);
    }
    const { maps } = this.chooser;
    const named = wanted.map ?? this.session?.name ?? maps[0]?.map;
    if (named) return this.open(named, wanted);
    this.#close();
    this.chooser.show(undefined);
    byId("create").parentElement.open = true;
    showEmpty("No map yet", "This server has no map. Make one with “New map”, drop a .mrol file here, or, in a terminal:", firstCommands());
  }

  /** Opens a map that was just made. */
  async openNew(name) {
    await this.attempt(async () => (await this.chooser.load(), true));
    await this.open(name);
  }

  async open(name, link = {}) {
    const opening = ++this.#opening;
    this.#close();
    connection.connecting();
    this.chooser.show(name);
    const session = await this.attempt(() => Session.open(name, this.#told(name)), () => this.open(name, link));
    if (opening !== this.#opening) return;
    if (!session) return connection.none();
    this.session = session;
    const { scene } = this;
    scene.open(session.forest, session.loader, session.arrivals);
    this.#measure();
    this.#isFollowed = !placeCamera(scene.camera, link);
    if (this.#isFollowed) this.#frame();
    byId("top").setAttribute("aria-pressed", scene.camera.isTop);
    this.cuts.reset(this.#bounds);
    const { levels } = session.info;
    byId("finest").max = levels.length - 1;
    this.#setFinest(Math.max(0, Math.min(Math.round(Number(link.level)) || 0, levels.length - 1)));
    if (link.color) this.#setColoring(link.color);
    session.follow();
    this.#askForAnswers();
    this.#follow();
    this.#writeLink();
  }

  #close() {
    this.session?.close();
    this.session = undefined;
    this.#bounds = undefined;
    this.#refused = undefined;
    this.scene.open(undefined);
    this.labels.clear("");
    this.#tool?.closed();
    for (const id of ["robots", "answers", "scans", "keep-outs"]) byId(id).replaceChildren();
    for (const id of ["count", "layers-said", "attention"]) byId(id).textContent = "";
    connection.none();
    showEmpty(undefined);
  }

  #told(name) {
    const isOpen = () => this.session?.name === name;
    return {
      arrived: () => this.scene.invalidate(),
      changed: () => {
        this.scene.repaint();
        connection.live(this.session.revision);
        this.#followSoon();
      },
      robots: () => this.#followSoon(),
      keepOuts: () => this.#showKeepOuts(),
      connected: () => connection.live(this.session.revision),
      lost: (problem, seconds) => {
        connection.lost(problem, seconds);
        if (seconds !== undefined) return;
        if ([401, 403].includes(problem.status)) failed(problem, () => this.open(name, this.#place()));
        else if (problem.status === 404) this.start();
        else notice(problem.message, { isBad: true });
      },
      reset: () => isOpen() && this.open(name, this.#place()),
      failed: (problem) => {
        if (problem.status === 401) failed(problem, () => this.open(name, this.#place()));
        else if (problem.status !== 0 && problem.status !== 404) failed(problem);
      },
    };
  }

  /** Does something that may be refused, which is explained then; undefined in that case. */
  async attempt(act, again) {
    try {
      return await act();
    } catch (error) {
      failed(error, again ?? (async () => void (await this.attempt(act))));
      return undefined;
    }
  }

  /** Takes scans or a deletion back. */
  async undo(target) {
    const body = { ...target, request_id: requestId() };
    const answer = await this.attempt(() => send("POST", pathOf(this.session.name, "undo"), body));
    if (answer) notice(`Undone: ${count(answer.removed)} voxels went, ${count(answer.restored)} came back.`);
  }

  useTool(name) {
    this.#tool?.closed();
    this.#tool = this.#tools[name];
    for (const shown of byId("tools").querySelectorAll("[data-tool]")) {
      shown.setAttribute("aria-pressed", shown.dataset.tool === name);
    }
    byId("picture").classList.toggle("aims", name !== "pick");
    const panel = byId("tool-panel");
    panel.hidden = false;
    panel.replaceChildren(element("h2", {}, this.#tool.title), element("p", { className: "hint" }, this.#tool.hint), this.#tool.panel);
  }

  label(name, place, text) {
    this.labels.put(name, place, text);
  }

  pixelsToMeters(pixels) {
    return pixels / this.scene.camera.pixelsPerMeter(this.scene.camera.distance, byId("picture").clientHeight);
  }

  /** A scan as an entry of a list: a click leads there, and it can be undone. */
  scanItem(scan) {
    const { camera } = this.scene;
    const text = scanText(scan);
    const go = () => {
      camera.target = scan.position ?? scan.map_from_sensor.translation_m;
      this.#isFollowed = false;
      this.scene.moved();
    };
    const target = scan.scan_id === null ? { revision: scan.revision } : { robot: scan.robot, session: scan.session, scan_id: scan.scan_id };
    const color = robotColor(this.session.arrivals.placeOf(scan.robot));
    return element("li", {}, dot(color), button(text, go, { className: "place", title: text }), button("Undo", () => this.undo(target)));
  }

  #clicked(x, y) {
    if (!this.session) return;
    this.#tool.clicked(this.scene.pickAt(x, y));
  }

  #wire() {
    for (const shown of byId("tools").querySelectorAll("[data-tool]")) shown.addEventListener("click", () => this.useTool(shown.dataset.tool));
    const { camera } = this.scene;
    const top = () => {
      camera.isTop = !camera.isTop;
      byId("top").setAttribute("aria-pressed", camera.isTop);
      this.scene.moved();
      this.#writeLink();
    };
    const all = () => {
      this.#frame();
      this.#isFollowed = true;
      this.scene.moved();
      this.#writeLink();
    };
    byId("top").addEventListener("click", top);
    byId("frame").addEventListener("click", all);
    const actions = { t: top, f: all, 1: () => this.useTool("pick"), 2: () => this.useTool("ruler"), 3: () => this.useTool("region"), 4: () => this.useTool("body"), Escape: () => this.useTool("pick") };
    addEventListener("keydown", (event) => {
      const isTyping = event.target instanceof HTMLInputElement && event.target.type !== "range" && event.target.type !== "checkbox";
      if (!isTyping && !event.ctrlKey && !event.metaKey && !byId("key-dialog").open) actions[event.key]?.();
    });
    byId("coloring").addEventListener("change", (event) => (this.#setColoring(event.target.value), this.#writeLink()));
    byId("finest").addEventListener("input", (event) => (this.#setFinest(event.target.valueAsNumber), this.#writeLink()));
    for (const id of ["show-paths", "show-robots", "show-refused", "show-keep-outs", "show-grid"]) byId(id).addEventListener("change", () => this.#showLayers());
    byId("ask-frontiers").addEventListener("click", () => this.#askFor("frontiers", (bounds) => frontiers(this.session, bounds)));
    byId("ask-free").addEventListener("click", () => this.#askFor("free", (bounds) => freeSpace(this.session, bounds, BAND_M.map((height) => bounds.min[2] + height))));
    byId("open-side").addEventListener("click", () => {
      const isClosed = byId("side").classList.toggle("is-closed");
      byId("open-side").setAttribute("aria-expanded", !isClosed);
    });
    if (innerWidth <= NARROW_PIXELS) byId("open-side").click();
    byId("answers").parentElement.addEventListener("toggle", () => this.#showAnswers());
    byId("scans").parentElement.addEventListener("toggle", () => this.session && this.#showLists());
    addEventListener("hashchange", () => this.start());
  }

  /** Shows what the server says of space, or takes it away again. */
  async #askFor(name, ask) {
    const shown = byId(`ask-${name}`);
    if (shown.getAttribute("aria-pressed") === "true") {
      shown.setAttribute("aria-pressed", false);
      byId("layers-said").textContent = "";
      return this.scene.show(name, undefined);
    }
    if (!this.#bounds) return;
    const answer = await this.attempt(() => ask(this.#bulk));
    if (!answer) return;
    shown.setAttribute("aria-pressed", true);
    this.scene.show(name, answer.shape);
    byId("layers-said").textContent = answer.text;
  }

  #setColoring(coloring) {
    const chosen = Array.from(byId("coloring").querySelectorAll("input")).find((input) => input.value === coloring);
    if (!chosen) return;
    chosen.checked = true;
    this.scene.coloring = coloring;
    byId("coloring-hint").hidden = !["robot", "age"].includes(coloring);
    this.scene.repaint();
  }

  #setFinest(level) {
    byId("finest").value = level;
    byId("finest-said").textContent = this.session ? `${level} (${meters(this.session.forest.side(level))})` : "";
    this.scene.finest = level;
    this.scene.invalidate();
  }

  #followSoon() {
    this.#following ??= setTimeout(() => {
      this.#following = undefined;
      if (this.session) this.#follow();
    }, FOLLOW_MS);
  }

  /** Takes over what has changed, in the panel and in the layers. */
  #follow() {
    const { session, scene } = this;
    this.#measure();
    scene.measure();
    this.cuts.measure(this.#bounds);
    // Somebody who has not moved the camera sees the map grow as a whole.
    if (this.#isFollowed) this.#frame();
    if (session.forest.isPartial && !session.isSaidPartial) {
      session.isSaidPartial = true;
      notice("This map is spread over more places than this page keeps: some are not shown.", { isBad: true });
    }
    const isEmpty = !this.#bounds;
    const isDone = "The map is here, and there is nothing in it. Scans appear as they are inserted. For example:";
    showEmpty(isEmpty ? `${session.name} is empty` : undefined, isDone, isEmpty ? firstCommands(session.name) : undefined);
    this.#showLists();
    this.#showLayers();
  }

  #measure() {
    this.#bounds = this.session.forest.bounds();
    this.#bulk = this.session.forest.bounds(STRAY);
  }

  /** Looks at the whole map, beside the panel. */
  #frame() {
    const { clientWidth } = byId("picture");
    const share = Math.max(0.5, 1 - (2 * PANEL_PIXELS) / clientWidth);
    if (this.#bounds) this.scene.camera.frame(this.#bulk, clientWidth > NARROW_PIXELS ? share : 1);
  }

  #showLists() {
    const { robots } = this.session;
    const isOpen = byId("scans").parentElement.open;
    byId("scans").replaceChildren(...robots.newest.slice(isOpen ? -SCANS_SHOWN : Infinity).reverse().map((scan) => this.scanItem(scan)));
  }

  async #askForAnswers() {
    await this.session?.events.look();
    // A list that somebody points at stays as it is.
    if (!byId("robots").matches(":hover") && !byId("answers").matches(":hover")) this.#showAnswers();
  }

  #showAnswers() {
    const { session } = this;
    if (!session) return;
    const goTo = (position) => {
      this.scene.camera.target = position;
      this.#isFollowed = false;
      this.scene.moved();
    };
    showAnswers(session, goTo);
    const size = Math.max(2 * session.forest.resolution, 0.05);
    const isShown = byId("show-refused").checked;
    const refused = `${session.name} ${session.events.number} ${isShown}`;
    if (refused === this.#refused) return;
    this.#refused = refused;
    this.scene.show("refused", isShown ? refusedScans(session.events, size) : undefined, true);
  }

  #showKeepOuts() {
    const item = (keepOut) =>
      element("li", {}, dot(theme().keepOut), element("span", { title: keepOut.made_by ? `made by ${keepOut.made_by}` : "" }, keepOut.name), button("Remove", () => removeKeepOut(this, keepOut.name)));
    byId("keep-outs").replaceChildren(...this.session.keepOuts.map(item));
    this.#showLayers();
  }

  #showLayers() {
    const { session, scene } = this;
    if (!session) return;
    this.#showAnswers();
    const { robots, arrivals, keepOuts } = session;
    const [isOfPaths, isOfRobots, isOfKeepOuts, isOfGrid] = ["show-paths", "show-robots", "show-keep-outs", "show-grid"].map((id) => byId(id).checked);
    scene.show("grid", isOfGrid && this.#bounds ? grid(this.#bulk).shape : undefined);
    scene.show("paths", isOfPaths ? paths(robots, arrivals) : undefined, true);
    const size = Math.max(2.5 * session.forest.resolution, 0.06);
    scene.show("robots", isOfRobots ? robotMarkers(robots, arrivals, size) : undefined, true);
    scene.show("keep-outs", isOfKeepOuts ? keepOutShapes(keepOuts) : undefined);
    this.labels.clear("robot ");
    this.labels.clear("keep-out ");
    if (isOfRobots) for (const [name, { position }] of robots.seen) this.labels.put(`robot ${name}`, position, name, robotColor(arrivals.placeOf(name)));
    if (isOfKeepOuts) for (const keepOut of keepOuts) this.labels.put(`keep-out ${keepOut.name}`, topOf(keepOut), keepOut.name, theme().keepOut);
  }

  #drawn() {
    const { camera, drawn } = this.scene;
    const { text, pixels } = scaleBar(camera, byId("picture").clientHeight);
    byId("scale").style.width = `${pixels}px`;
    byId("scale-said").textContent = text;
    byId("count").textContent = this.session ? `${count(drawn.voxels)} voxels shown` : "";
  }

  /** What a link to this place says. */
  #place() {
    return { ...cameraParts(this.scene.camera), level: this.scene.finest || undefined, color: this.scene.coloring === "height" ? undefined : this.scene.coloring };
  }

  #writeLink() {
    writeLink(() => ({ map: this.session?.name, ...this.#place() }));
  }
}
