// The page: one map that is open, the tools, and the panel beside the picture.

import { pathOf, requestId, send } from "./api.js";
import { robotsByNeed, showAnswers } from "./answers.js";
import { BodyTool } from "./body.js";
import { Ceiling } from "./ceiling.js";
import { Chooser, firstCommands, showEmpty } from "./chooser.js";
import { Coloring } from "./coloring.js";
import * as connection from "./connection.js";
import { control } from "./controls.js";
import { Cuts } from "./cuts.js";
import { button, byId, dot, element } from "./dom.js";
import { freeSpace, frontiers } from "./explored.js";
import { count, meters } from "./format.js";
import { Help } from "./help.js";
import { Labels } from "./labels.js";
import { grid, keepOutShapes, paths, refusedScans, robotMarkers, scaleBar, topOf } from "./layers.js";
import { cameraParts, placeCamera, readLink, writeLink } from "./link.js";
import { failed, notice } from "./notices.js";
import { robotColor, theme, whenThemeChanges } from "./palette.js";
import { Picking, scanText } from "./picking.js";
import { RegionTool, removeKeepOut } from "./region.js";
import { Ruler } from "./ruler.js";
import { Scene, STRAY } from "./scene.js";
import { sayUnseen } from "./seen.js";
import { Session } from "./session.js";
import { Views } from "./views.js";

const SCANS_SHOWN = 100;
/** Lists and layers follow changes at most this often. */
const FOLLOW_MS = 300;
const SECOND_MS = 1000;
const LOOK_FOR_ROBOTS_MS = 5000;
/** Heights above the lowest voxel between which free space is shown, meters. */
const BAND_M = [0.2, 1.6];
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
  #opening = 0;

  constructor() {
    this.scene = new Scene(byId("picture"));
    this.labels = new Labels(this.scene, byId("labels"));
    this.chooser = new Chooser(this);
    const chosen = () => this.#writeLink();
    this.cuts = new Cuts((cut) => {
      this.scene.cut = cut;
      this.scene.moved();
      this.ceiling?.say();
      if (this.session) chosen();
    });
    this.ceiling = new Ceiling(this.cuts, { pressed: chosen, measured: () => this.#followSoon() });
    this.coloring = new Coloring(this.scene, chosen);
    this.views = new Views(this.scene, { bounds: () => this.#left(), moved: chosen });
    this.help = new Help();
    this.#tools = { pick: new Picking(this), ruler: new Ruler(this), region: new RegionTool(this), body: new BodyTool(this) };
    const moved = () => {
      this.views.isFollowing = false;
      this.scene.moved();
      this.#writeLink();
    };
    const pointAt = (x, y) => this.scene.pickAt(x, y)?.point;
    control(byId("picture"), this.scene.camera, { moved, pointAt, clicked: (x, y) => this.#clicked(x, y) });
    this.#wire();
    this.useTool("pick");
    this.scene.whenDrawn(() => this.#drawn());
    whenThemeChanges(() => this.#showLayers());
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
    this.views.open(placeCamera(scene.camera, link));
    this.cuts.open(this.#bounds, link.cut);
    this.ceiling.open(session, this.#bulk);
    const { levels } = session.info;
    byId("finest").max = levels.length - 1;
    this.#setFinest(Math.max(0, Math.min(Math.round(Number(link.level)) || 0, levels.length - 1)));
    this.coloring.open(session, link.color);
    session.follow();
    this.#askForAnswers();
    this.#follow();
    this.#writeLink();
  }

  #close() {
    this.session?.close();
    this.session = undefined;
    this.#bounds = this.#bulk = undefined;
    this.#refused = undefined;
    this.ceiling.open(undefined);
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
    const text = scanText(scan);
    const go = () => this.views.goTo(scan.position ?? scan.map_from_sensor.translation_m);
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
    const actions = { t: () => this.views.turnTop(), f: () => this.views.showAll(), c: () => this.ceiling.turn(), "?": () => this.help.open(), 1: () => this.useTool("pick"), 2: () => this.useTool("ruler"), 3: () => this.useTool("region"), 4: () => this.useTool("body"), Escape: () => this.useTool("pick") };
    addEventListener("keydown", (event) => {
      const isTyping = event.target instanceof HTMLInputElement && event.target.type !== "range" && event.target.type !== "checkbox";
      if (!isTyping && !event.ctrlKey && !event.metaKey && !byId("key-dialog").open) actions[event.key]?.();
    });
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
    const { session } = this;
    this.#measure();
    this.cuts.measure(this.#bounds);
    this.ceiling.follow(this.#bulk);
    this.views.follow();
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

  /** Most of the map, as far as it is not cut off. */
  #left() {
    if (!this.#bulk) return undefined;
    const { min, max } = this.cuts.cut;
    const inside = [0, 1, 2].map((axis) => [Math.max(min[axis], this.#bulk.min[axis]), Math.min(max[axis], this.#bulk.max[axis])]);
    return inside.every(([from, to]) => from < to) ? { min: inside.map(([from]) => from), max: inside.map(([, to]) => to) } : this.#bulk;
  }

  #measure() {
    const { forest } = this.session;
    this.#bounds = forest.bounds();
    this.#bulk = forest.bounds(STRAY);
    const { range } = this.ceiling;
    if (!this.#bulk) return;
    if (range) [this.#bulk.min[2], this.#bulk.max[2]] = [Math.max(range[0], this.#bulk.min[2]), Math.min(range[1], this.#bulk.max[2])];
    this.scene.measure(this.#bounds, this.#bulk);
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
    if (!session?.areRobotsKnown) return;
    showAnswers(session, (position) => this.views.goTo(position));
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
    const [isOfPaths, areRobotsShown, isOfKeepOuts, isOfGrid] = ["show-paths", "show-robots", "show-keep-outs", "show-grid"].map((id) => byId(id).checked);
    const isOfRobots = areRobotsShown && session.areRobotsKnown;
    scene.show("grid", isOfGrid && this.#bounds ? grid(this.#bulk).shape : undefined);
    scene.show("paths", isOfPaths ? paths(robots, arrivals) : undefined, true);
    const size = Math.max(2.5 * session.forest.resolution, 0.06);
    scene.show("robots", isOfRobots ? robotMarkers(robots, arrivals, size) : undefined, true);
    scene.show("keep-outs", isOfKeepOuts ? keepOutShapes(keepOuts) : undefined);
    this.labels.clear("robot ");
    this.labels.clear("keep-out ");
    if (isOfRobots) {
      for (const { name, seen, isBad } of robotsByNeed(session)) this.labels.put(`robot ${name}`, seen.position, name, { color: robotColor(arrivals.placeOf(name)), isBad });
    }
    if (isOfKeepOuts) for (const keepOut of keepOuts) this.labels.put(`keep-out ${keepOut.name}`, topOf(keepOut), keepOut.name, { color: theme().keepOut });
  }

  #drawn() {
    const { camera, drawn } = this.scene;
    const { text, pixels } = scaleBar(camera, byId("picture").clientHeight);
    byId("scale").style.width = `${pixels}px`;
    byId("scale-said").textContent = text;
    // While more is on its way, or the camera moves, it is not known yet.
    if (!drawn.is_complete) return;
    const seen = this.scene.seen();
    byId("count").textContent = !this.session ? "" : seen === "voxels" ? `${count(drawn.voxels)} voxels shown` : "no voxel in the picture";
    sayUnseen(seen, { uncut: () => byId("uncut").click(), all: () => this.views.showAll() });
  }

  /** What a link to this place says. */
  #place() {
    return { ...cameraParts(this.scene.camera), level: this.scene.finest || undefined, color: this.scene.coloring === "height" ? undefined : this.scene.coloring, cut: this.cuts.said() };
  }

  #writeLink() {
    writeLink(() => ({ map: this.session?.name, ...this.#place() }));
  }
}
