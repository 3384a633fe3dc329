// The scans that made a map, robot by robot, and where each robot is now.

import { pathOf, read } from "./api.js";
import { Steps } from "./steps.js";

const PAGE = 5_000;
/** The newest poses that are kept, of all robots. */
const STEPS_MAX = 200_000;
/** The newest scans of which all is kept, so that they can be listed and undone. */
const NEWEST_MAX = 200;

export class Robots {
  #map;
  /** Where scans were taken, in the order of their revisions. */
  steps = new Steps();
  /** The newest of these scans. */
  newest = [];
  /** By name: where the robot is, and what became of its last scan. */
  seen = new Map();

  constructor(map) {
    this.#map = map;
  }

  /** Reads the trajectory and the last sightings anew. */
  async load() {
    const before = this.newest.at(-1)?.revision ?? 0;
    const [steps, newest] = [new Steps(), []];
    this.seen.clear();
    let since = 0;
    while (since !== undefined) {
      const page = await read(pathOf(this.#map, "trajectory"), { since_revision: since, limit: PAGE });
      for (const { map_from_sensor: pose, ...scan } of page.poses) {
        keep(steps, newest, scan, pose.translation_m);
        this.#see(scan.robot, pose.translation_m, pose.rotation_xyzw);
      }
      since = page.next_since_revision;
    }
    // What a watch told in the meantime is not lost; what was there before and is not any more was undone.
    const last = Math.max(before, newest.at(-1)?.revision ?? 0);
    for (const scan of this.newest) if (scan.revision > last) keep(steps, newest, scan, scan.position);
    [this.steps, this.newest] = [steps, newest];
    await this.look();
  }

  /** Reads where the robots are by their last scans, refused and stationary ones too. */
  async look() {
    const { sightings = [] } = await read(pathOf(this.#map));
    for (const { robot, map_from_sensor: pose, verdict } of sightings) {
      this.seen.set(robot, { position: pose.translation_m, rotation: pose.rotation_xyzw, verdict });
    }
  }

  /** Takes up a scan that was just inserted. */
  add(scan, revision) {
    if (revision <= (this.newest.at(-1)?.revision ?? 0)) return;
    keep(this.steps, this.newest, { ...scan, revision }, scan.position);
    this.#see(scan.robot, scan.position, scan.rotation);
  }

  /** Takes up where an accepted scan was taken. */
  #see(robot, position, rotation) {
    this.seen.set(robot, { position, rotation, verdict: "accepted" });
  }

  /** The robots' names, in order. */
  names() {
    return Array.from(this.seen.keys()).sort();
  }
}

/** Names are the same for many scans, and kept once. */
const names = new Map();
const once = (name) => names.get(name) ?? (names.size < 1_000 && names.set(name, name), name);

/** Keeps a scan, and of older ones where they were taken. */
function keep(steps, newest, { robot, session, scan_id, revision, timestamp_ns }, position) {
  steps.push(once(robot), position);
  if (steps.length > STEPS_MAX * 1.1) steps.keepNewest(STEPS_MAX);
  const [x, y, z] = position;
  newest.push({ robot: once(robot), session: once(session), scan_id, revision, timestamp_ns, position: [x, y, z] });
  if (newest.length > NEWEST_MAX) newest.shift();
}
