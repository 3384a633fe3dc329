// What became of the scans that robots sent: the last answer to each robot, and the newest answers of all.
//
// They are asked for once a second. A second stream beside that of changes would be a second of the six connections that a
// browser has to a server, for all its windows.

import { pathOf, read } from "./api.js";

const KEPT = 100;

export class Events {
  /** By robot: what became of its last scan. */
  last = new Map();
  /** Of all robots, the newest last. */
  newest = [];
  #map;
  #number = 0;
  #isAsking = false;

  constructor(map) {
    this.#map = map;
  }

  /** Asks for what came since. That a server cannot be reached, the watch of the map says. */
  async look() {
    if (this.#isAsking) return;
    this.#isAsking = true;
    try {
      const { events } = await read(pathOf(this.#map, "events"), { since_number: this.#number });
      events.forEach((event) => this.#take(event));
    } catch (error) {
      if (error.status === undefined) throw error;
    } finally {
      this.#isAsking = false;
    }
  }

  #take(event) {
    this.#number = event.number;
    this.last.set(event.robot, event);
    this.newest.push(event);
    this.newest.splice(0, this.newest.length - KEPT);
  }
}

/** True of an answer that somebody has to look at: the scan was refused, or its request failed. */
export const isBad = ({ answer }) => !answer?.accepted;

/** The answer in a few words. */
export function wordsOf({ answer, error }) {
  if (!answer) return error?.reason ?? "failed";
  const overlap = `${Math.round(answer.overlap * 100)} %`;
  if (!answer.accepted) return `${answer.verdict}, ${overlap}`;
  if (answer.recovered) return `found again, ${overlap}`;
  return answer.stationary ? `stands still, ${overlap}` : overlap;
}

/** The answer in a sentence, with what it took. */
export function sentenceOf({ answer, error, points, duration_ms: took }) {
  const said = answer ? answer.reason : error?.detail;
  return `${said ?? ""}\n${points} points, answered in ${Math.round(took)} ms`;
}
