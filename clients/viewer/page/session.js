// A map that is open: what was read of it, and its changes as they come.

import { pathOf, read } from "./api.js";
import { Arrivals } from "./arrivals.js";
import { Events } from "./events.js";
import { Forest } from "./forest.js";
import { Loader } from "./loader.js";
import { Robots } from "./robots.js";
import { Watch } from "./watch.js";

export class Session {
  keepOuts = [];
  #told;
  #watch;
  #isClosed = false;

  /** `told` has `arrived`, `changed(change)`, `robots`, `keepOuts`, `connected`, `lost`, `reset` and `failed`. */
  constructor(info, told) {
    this.name = info.map;
    this.info = info;
    this.voxels = info.levels[0].voxels;
    this.#told = told;
    this.forest = new Forest(info.settings.resolution_m, info.settings.levels);
    this.arrivals = new Arrivals();
    this.robots = new Robots(this.name);
    this.events = new Events(this.name);
    const failed = (problem) => this.#isClosed || told.failed(problem);
    this.loader = new Loader(this.name, this.forest, { fetched: (tile) => this.arrivals.tagIn(this.forest, tile), arrived: told.arrived, failed });
  }

  static async open(name, told) {
    const session = new Session(await read(pathOf(name)), told);
    const { revision, hash, uuid } = await session.loader.readRoots();
    session.revision = revision;
    session.hash = hash;
    session.uuid = uuid;
    return session;
  }

  /** Follows the map from what was read of it. */
  follow() {
    const told = this.#told;
    this.#watch = new Watch(this.name, this.uuid, this, {
      change: (change) => this.#take(change),
      reset: told.reset,
      connected: told.connected,
      lost: told.lost,
    });
    this.readRobots();
    this.readKeepOuts();
  }

  close() {
    this.#isClosed = true;
    this.#watch?.stop();
    this.loader.stop();
  }

  #take(change) {
    const { scan } = change;
    const forget = (tag) => Array.from(this.forest.tiles(), (tile) => tile.forget(tag));
    const tag = scan ? this.arrivals.tagOf(scan.robot, performance.now(), forget) : 0;
    this.arrivals.remember(change.added, tag);
    this.loader.note(change, tag);
    this.forest.apply(change, tag);
    this.revision = Math.max(this.revision, change.revision);
    if (scan && change.isComplete) this.robots.add(scan, change.revision);
    if (change.cause === "undo" && change.isComplete) this.readRobots();
    if (change.cause === "keep_out") this.readKeepOuts();
    this.#told.changed(change);
  }

  readRobots() {
    return this.#reading(() => this.robots.load(), this.#told.robots);
  }

  /** Where the robots are by now, those too whose scans change nothing. */
  lookForRobots() {
    return this.#reading(() => this.robots.look(), this.#told.robots);
  }

  readKeepOuts() {
    const load = async () => (this.keepOuts = (await read(pathOf(this.name, "keep-outs"))).keep_outs);
    return this.#reading(load, this.#told.keepOuts);
  }

  async #reading(load, done) {
    try {
      await load();
      if (!this.#isClosed) done();
    } catch (error) {
      if (!this.#isClosed) this.#told.failed(error);
    }
  }
}
