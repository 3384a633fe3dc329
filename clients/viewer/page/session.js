// A map that is open: what was read of it, and its changes as they come.

import { pathOf, read } from "./api.js";
import { Arrivals } from "./arrivals.js";
import { Events } from "./events.js";
import { Forest } from "./forest.js";
import { Loader } from "./loader.js";
import { readPast } from "./past.js";
import { Robots } from "./robots.js";
import { Watch } from "./watch.js";

export class Session {
  keepOuts = [];
  /** The robots were read, or were tried to be. */
  areRobotsKnown = false;
  #told;
  #watch;
  #isClosed = false;
  #past;
  #pastStop = new AbortController();

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
    this.loader = new Loader(this.name, this.forest, { fetched: (tile) => (tile.isUntagged = true), arrived: told.arrived, failed });
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
    this.#pastStop.abort();
    this.loader.stop();
  }

  #take(change) {
    const { scan } = change;
    const retag = (table) => Array.from(this.forest.tiles(), (tile) => tile.retag(table));
    const tag = scan ? this.arrivals.tagOf(scan.robot, change.revision, performance.now(), retag) : 0;
    this.arrivals.take(change, tag);
    this.loader.note(change, tag);
    this.forest.apply(change, tag);
    this.revision = Math.max(this.revision, change.revision);
    if (scan && change.isComplete) this.robots.add(scan, change.revision);
    if (change.cause === "undo" && change.isComplete) this.readRobots();
    if (change.cause === "keep_out") this.readKeepOuts();
    this.#told.changed(change);
  }

  /** Reads who brought what was there before, once: the first revision that is known of, or none. */
  readPast() {
    this.#past ??= readPast(this, this.#pastStop.signal).then((first) => {
      for (const tile of this.forest.tiles()) tile.isUntagged = tile.isChanged = true;
      if (!this.#isClosed) this.#told.arrived();
      return first;
    });
    this.#past.catch(() => (this.#past = undefined));
    return this.#past;
  }

  async readRobots() {
    await this.#reading(() => this.robots.load(), () => {
      // In the order in which they came to the map, so that each has the same color in every page.
      for (const name of this.robots.seen.keys()) this.arrivals.placeOf(name);
    });
    this.areRobotsKnown = true;
    if (!this.#isClosed) this.#told.robots();
  }

  /** Where the robots are by now, those too whose scans change nothing. */
  async lookForRobots() {
    if (this.areRobotsKnown) await this.#reading(() => this.robots.look(), this.#told.robots);
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
