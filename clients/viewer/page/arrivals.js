// Which robot brought voxels, and when.
//
// A tag is the color of a robot and one of 31 spans of revisions: the first 15 are of scans from before the page was
// opened, the others of those that came since. Where these are used up, two neighbors become one.

import { ROBOT_COLORS, rgba, robotColor, theme } from "./palette.js";
import { Tags } from "./tags.js";

const SPANS = 31;
const PAST_SPANS = 15;
/** At first; twice as long each time that spans are joined. */
const SPAN_MS = 5_000;
/** How much of its color the oldest voxel has by age. */
const OLDEST_SHARE = 0.12;

export class Arrivals {
  tags = new Tags();
  #robots = new Map();
  /** Of each span the revision that it begins at. */
  #begins = new Array(SPANS);
  #live = PAST_SPANS;
  #spanMs = SPAN_MS;
  #spanAt = -Infinity;
  #newest = 0;

  /** The place of a robot among those that were seen, which chooses its color. */
  placeOf(robot) {
    if (!this.#robots.has(robot)) this.#robots.set(robot, this.#robots.size);
    return this.#robots.get(robot);
  }

  /** The tag of what `robot` brings now; `retag(table)` is called where tags become others. */
  tagOf(robot, revision, now, retag) {
    this.#newest = revision;
    if (now - this.#spanAt >= this.#spanMs) {
      if (this.#live === SPANS) this.#join(retag);
      this.#begins[this.#live++] = revision;
      this.#spanAt = now;
    }
    return this.#tag(robot, this.#live - 1);
  }

  /** The tag of what `robot` brought at a revision of the past, of which `first` to `last` are known. */
  pastTagOf(robot, revision, first, last) {
    const span = Math.floor((PAST_SPANS * (revision - first)) / (last - first + 1));
    this.#begins[span] ??= revision;
    this.#newest = Math.max(this.#newest, revision);
    return this.#tag(robot, span);
  }

  /** Takes up what came and went with a change. */
  take({ added, removed }, tag) {
    this.tags.clear(removed);
    if (tag !== 0) this.tags.put(added, tag, false);
  }

  /** Takes up what a change of the past touched and removed: the first who brought a voxel is the one that counts. */
  takePast({ added, removed }, tag) {
    this.tags.clear(removed, (own) => (own - 1) % SPANS < PAST_SPANS);
    if (tag !== 0) this.tags.put(added, tag, true);
  }

  /** The color of a tag by robot or by age: how late among the scans that are known. */
  colorOf(tag, isByAge) {
    if (tag > ROBOT_COLORS * SPANS) return undefined;
    const span = (tag - 1) % SPANS;
    if (!isByAge) return rgba(robotColor(Math.floor((tag - 1) / SPANS)));
    const first = this.#begins.find((begin) => begin !== undefined);
    if (this.#begins[span] === undefined) return undefined;
    const share = (this.#begins[span] - first) / Math.max(1, this.#newest - first);
    return rgba(theme().accent, OLDEST_SHARE + (1 - OLDEST_SHARE) * share ** 1.5);
  }

  #tag(robot, span) {
    return 1 + (this.placeOf(robot) % ROBOT_COLORS) * SPANS + span;
  }

  /** Makes one of each two neighboring spans. */
  #join(retag) {
    const joined = (span) => (span < PAST_SPANS ? span : PAST_SPANS + ((span - PAST_SPANS) >> 1));
    const table = Uint8Array.from({ length: 256 }, (_, tag) => {
      if (tag === 0 || tag > ROBOT_COLORS * SPANS) return tag;
      const span = (tag - 1) % SPANS;
      return tag - span + joined(span);
    });
    for (let span = PAST_SPANS; span < SPANS; span += 2) this.#begins[joined(span)] = this.#begins[span];
    this.#live = joined(SPANS - 1) + 1;
    this.#begins.fill(undefined, this.#live);
    this.#spanMs *= 2;
    this.tags.retag(table);
    retag(table);
  }
}
