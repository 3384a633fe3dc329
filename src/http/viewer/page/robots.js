// The scans that made a map, robot by robot, and where each robot is now.

import { pathOf, read } from "./api.js";

const PAGE = 5_000;
/** The newest poses that are kept, of all robots. */
const SCANS_MAX = 200_000;

export class Robots {
  #map;
  /** Scans in the order of their revisions. */
  scans = [];
  /** By name: where the robot is, and what became of its last scan. */
  seen = new Map();

  constructor(map) {
    this.#map = map;
  }

  /** Reads the trajectory and the last sightings anew. */
  async load() {
    const scans = [];
    let since = 0;
    while (since !== undefined) {
      const page = await read(pathOf(this.#map, "trajectory"), { since_revision: since, limit: PAGE });
      for (const { map_from_sensor: pose, ...scan } of page.poses) {
        scans.push({ ...scan, position: pose.translation_m, rotation: pose.rotation_xyzw });
      }
      scans.splice(0, scans.length - SCANS_MAX);
      since = page.next_since_revision;
    }
    const last = this.scans.at(-1)?.revision ?? 0;
    // What a watch told in the meantime is not lost.
    const newer = this.scans.filter((scan) => scan.revision > (scans.at(-1)?.revision ?? 0) && scan.revision <= last);
    this.scans = scans.concat(newer);
    this.seen.clear();
    for (const scan of this.scans) this.#see(scan, "accepted");
    await this.look();
  }

  /** Reads where the robots are by their last scans, refused and stationary ones too. */
  async look() {
    const { sightings = [] } = await read(pathOf(this.#map));
    for (const { robot, map_from_sensor: pose, verdict, seen_at_ns } of sightings) {
      this.seen.set(robot, { position: pose.translation_m, rotation: pose.rotation_xyzw, verdict, at: seen_at_ns / 1e6 });
    }
  }

  /** Takes up a scan that was just inserted. */
  add(scan, revision) {
    if (revision <= (this.scans.at(-1)?.revision ?? 0)) return;
    this.scans.push({ ...scan, revision });
    if (this.scans.length > SCANS_MAX * 1.1) this.scans.splice(0, this.scans.length - SCANS_MAX);
    this.#see(scan, "accepted", Date.now());
  }

  #see({ robot, position, rotation }, verdict, at) {
    this.seen.set(robot, { position, rotation, verdict, at });
  }

  /** The robots' names, in order. */
  names() {
    return Array.from(this.seen.keys()).sort();
  }
}
