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
    this.seen.clear();
    let since = 0;
    while (since !== undefined) {
      const page = await read(pathOf(this.#map, "trajectory"), { since_revision: since, limit: PAGE });
      for (const { map_from_sensor: pose, ...scan } of page.poses) {
        scans.push(kept(scan, pose.translation_m));
        this.#see(scan.robot, pose.translation_m, pose.rotation_xyzw);
      }
      scans.splice(0, scans.length - SCANS_MAX);
      since = page.next_since_revision;
    }
    const last = this.scans.at(-1)?.revision ?? 0;
    // What a watch told in the meantime is not lost.
    const newer = this.scans.filter((scan) => scan.revision > (scans.at(-1)?.revision ?? 0) && scan.revision <= last);
    this.scans = scans.concat(newer);
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
    if (revision <= (this.scans.at(-1)?.revision ?? 0)) return;
    this.scans.push(kept({ ...scan, revision }, scan.position));
    if (this.scans.length > SCANS_MAX * 1.1) this.scans.splice(0, this.scans.length - SCANS_MAX);
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

/** What is kept of a scan, since there may be many. */
function kept({ robot, session, scan_id, revision, timestamp_ns }, position) {
  // An array of three numbers as it stands takes a quarter of one that was made first and filled then.
  const [x, y, z] = position;
  return { robot: once(robot), session: once(session), scan_id, revision, timestamp_ns, position: [x, y, z] };
}
