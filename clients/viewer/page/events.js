// What became of the scans that robots sent: the last answer to each robot, and the newest answers of all.
//
// They are asked for once a second. A second stream beside that of changes would be a second of the six connections that a
// browser has to a server, for all its windows.

import { ask, pathOf } from "./api.js";

const KEPT = 100;
const ROBOTS_MAX = 256;

export class Events {
  /** By robot: what became of its last scan; the robot that was heard of last is the last one. */
  last = new Map();
  /** Of all robots, the newest last. */
  newest = [];
  #map;
  #number = 0;
  #isAsking = false;
  /** How far the server's clock is ahead of this machine's. */
  #ahead = 0;

  constructor(map) {
    this.#map = map;
  }

  get number() {
    return this.#number;
  }

  /** The time by the server's clock. */
  now() {
    return Date.now() + this.#ahead;
  }

  /** Asks for what came since. That a server cannot be reached, the watch of the map says. */
  async look() {
    if (this.#isAsking) return;
    this.#isAsking = true;
    try {
      const response = await ask(pathOf(this.#map, "events"), { query: { since_number: this.#number } });
      this.#ahead = (Date.parse(response.headers.get("date")) || Date.now()) - Date.now();
      const { events } = await response.json();
      events.forEach((event) => this.#take(event));
    } catch (error) {
      if (error.status === undefined) throw error;
    } finally {
      this.#isAsking = false;
    }
  }

  #take(event) {
    this.#number = event.number;
    this.last.delete(event.robot);
    this.last.set(event.robot, event);
    if (this.last.size > ROBOTS_MAX) this.last.delete(this.last.keys().next().value);
    this.newest.push(event);
    this.newest.splice(0, this.newest.length - KEPT);
  }
}

/** True of an answer that somebody has to look at: the scan does not fit, taken or not, or its request failed. */
export const isBad = ({ answer }) => !answer?.accepted || answer.verdict !== "accepted";

/** The answer in a few words. */
export function wordsOf({ answer, error }) {
  if (!answer) return error?.reason ?? "failed";
  const share = `${Math.round(answer.overlap * 100)} %`;
  const overlap = `overlap ${share}`;
  // A verdict that names the overlap says of what the share is.
  const verdict = answer.verdict.includes("overlap") ? `${answer.verdict} ${share}` : `${answer.verdict}, ${overlap}`;
  if (!answer.accepted) return verdict;
  if (answer.verdict !== "accepted") return `forced: ${verdict}`;
  if (answer.replayed) return `sent again, ${overlap}`;
  if (answer.recovered) return `found again, ${overlap}`;
  return answer.stationary ? `stands still, ${overlap}` : overlap;
}

/** The answer in a sentence, with the rivals that leave it open and what it took. */
export function sentenceOf({ answer, error, points, duration_ms: took }) {
  const said = answer ? answer.reason : error?.detail;
  const rivals = (answer?.rivals ?? []).map(({ map_from_sensor: { translation_m: place }, rays }) => {
    const where = place.map((value) => value.toFixed(2)).join(" ");
    return `\nor at ${where} m: ${agreeOf(rays)}`;
  });
  return `${said ?? ""}${rivals.join("")}\n${points} points, answered in ${Math.round(took)} ms`;
}

/** How many of the rays that say anything agree, of the scan's and of what earlier scans met. */
const agreeOf = ({ of_scan, of_map }) => [of_scan, of_map].map(({ agree, contradicted }) => {
  const told = agree + contradicted;
  return told > 0 ? `${Math.round((100 * agree) / told)} %` : "none";
}).join(" and ") + " of rays agree";
