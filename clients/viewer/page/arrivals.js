// Which robot brought voxels, and when: of those that came while the page was open.
//
// A tag is one robot in one span of time. There are 254 of them; the oldest is forgotten for a new one.

import { Brought } from "./brought.js";
import { rgba, robotColor, theme } from "./palette.js";

const TAGS = 254;
const SPAN_MS = 5_000;
/** Bytes of blocks that are remembered, for tiles that are fetched only later. */
const REMEMBERED_BYTES_MAX = 2 << 20;
/** What is older than this has no color of its own by age. */
const AGE_MAX_MS = 180_000;

export class Arrivals {
  #tags = new Map();
  #next = 1;
  #robots = new Map();
  #brought = new Brought(REMEMBERED_BYTES_MAX);

  /** The place of a robot among those that were seen, which chooses its color. */
  placeOf(robot) {
    if (!this.#robots.has(robot)) this.#robots.set(robot, this.#robots.size);
    return this.#robots.get(robot);
  }

  /** The tag of what `robot` brings now; `forget(tag)` is called of a tag that is taken anew. */
  tagOf(robot, now, forget) {
    for (const [tag, span] of this.#tags) {
      if (span.robot === robot && now - span.begin < SPAN_MS) return tag;
    }
    const tag = this.#next;
    this.#next = (tag % TAGS) + 1;
    if (this.#tags.has(tag)) {
      forget(tag);
      this.#brought.forget(tag);
    }
    this.#tags.set(tag, { robot, begin: now });
    return tag;
  }

  /** Remembers which voxels came with a tag. */
  remember(blocks, tag) {
    if (tag !== 0 && blocks.length > 0) this.#brought.push(blocks, tag);
  }

  /** Tags what is remembered of a tile that was just fetched. */
  tagIn(forest, tile) {
    for (const { blocks, tag } of this.#brought) forest.tagIn(tile, blocks, tag);
  }

  /** The color of a tag by robot or by age. */
  colorOf(tag, isByAge, now) {
    const span = this.#tags.get(tag);
    if (!span) return undefined;
    if (!isByAge) return rgba(robotColor(this.placeOf(span.robot)));
    const age = Math.min((now - span.begin) / AGE_MAX_MS, 1);
    return rgba(theme().accent, (1 - age) ** 0.7);
  }
}
