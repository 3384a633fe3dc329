// The changes of a map as they come, over a fetch stream: alone among a browser's streams it can carry a key.

import { LOST, Problem, ask, pathOf } from "./api.js";
import { numbers, readMessage, text } from "./protobuf.js";

const RETRY_S = [1, 2, 4, 8];
/** A heartbeat comes every few seconds: after so long without anything the connection is lost. */
const SILENCE_MS = 60_000;
const MESSAGE_BYTES_MAX = 64 << 20;
const RPC_UNAVAILABLE = 14;
const STATUS_OF_CODE = { 5: 404, 7: 403, 8: 429, 14: 503, 16: 401 };

export class Watch {
  #map;
  #uuid;
  #revision;
  /** Of what the whole map holds at that revision, sixteen hexadecimal digits; none where it was not told. */
  #hash;
  /** Of that and of what else a copy holds: keep-outs and viewpoints. */
  #stateHash;
  #heard;
  #stop = new AbortController();

  /**
   * Follows a map from a version on: its `revision` and, where it is known, its `hash`. `heard` has `change`, `reset` (what was told before holds no more), `connected`
   * and `lost(problem, retrySeconds)`; without seconds it has ended for good.
   */
  constructor(map, uuid, { revision, hash }, heard) {
    this.#map = map;
    this.#uuid = uuid;
    this.#revision = revision;
    this.#hash = hash;
    this.#heard = heard;
    this.#follow();
  }

  stop() {
    this.#stop.abort();
  }

  async #follow() {
    const { signal } = this.#stop;
    for (let failures = 0; !signal.aborted; ) {
      let problem;
      try {
        await this.#connect(() => (failures = 0));
        problem = new Problem(LOST, "ended", "The connection ended.");
      } catch (error) {
        problem = error instanceof Problem ? error : new Problem(LOST, "broken", "The connection broke off.");
      }
      if (signal.aborted) return;
      const isPassing = [LOST, 429, 503, 504].includes(problem.status);
      if (!isPassing) return this.#heard.lost(problem);
      const seconds = problem.retryAfter ?? RETRY_S[Math.min(failures++, RETRY_S.length - 1)];
      this.#heard.lost(problem, seconds);
      await new Promise((resolve) => setTimeout(resolve, seconds * 1000));
    }
  }

  async #connect(connected) {
    const query = { delta_level: 0, since_revision: this.#revision, map_uuid: this.#uuid };
    // With another hash the server has another history than we read, and tells of the whole state.
    if (this.#hash) query.since_content_hash = this.#hash;
    if (this.#stateHash) query.since_state_hash = this.#stateHash;
    const silence = new AbortController();
    const signal = AbortSignal.any([this.#stop.signal, silence.signal]);
    const response = await ask(pathOf(this.#map, "watch"), { query, signal });
    this.#heard.connected();
    connected();
    let timer;
    const heard = () => {
      clearTimeout(timer);
      timer = setTimeout(() => silence.abort(), SILENCE_MS);
    };
    heard();
    try {
      for await (const message of framesOf(response.body.getReader(), heard)) this.#take(message);
    } finally {
      clearTimeout(timer);
    }
  }

  #take(bytes) {
    let head, state, change, isHeartbeat, failure, stateHash;
    readMessage(bytes, {
      1: (uuid) => (this.#uuid = text(uuid)),
      2: (revision) => (head = revision),
      3: (message) => (state = stateOf(message)),
      4: (message) => (change = changeOf(message)),
      5: () => (isHeartbeat = true),
      6: (message) => (failure = failureOf(message)),
      7: (_, eight) => (stateHash = hexOf(eight)),
    });
    if (failure) throw failure;
    if (state) {
      // Where the server cannot go on from our revision, everything is read anew: the parts of the state are not used.
      if (state.isReset) this.#heard.reset();
      return;
    }
    // The first answer to what we read names the hash of all of it.
    if (isHeartbeat && head === this.#revision) this.#stateHash = stateHash;
    if (!change) return;
    this.#heard.change(change);
    if (change.isComplete) [this.#revision, this.#hash, this.#stateHash] = [change.revision, change.hash, stateHash];
  }
}

/** The messages of a stream, each behind its length in four bytes. */
export async function* framesOf(reader, heard) {
  let kept = new Uint8Array(0);
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    heard();
    if (kept.length === 0) {
      kept = value;
    } else {
      const joined = new Uint8Array(kept.length + value.length);
      joined.set(kept);
      joined.set(value, kept.length);
      kept = joined;
    }
    while (kept.length >= 4) {
      const length = new DataView(kept.buffer, kept.byteOffset).getUint32(0, true);
      if (length > MESSAGE_BYTES_MAX) throw new Error("a message is too long");
      if (kept.length < 4 + length) break;
      yield kept.subarray(4, 4 + length);
      kept = kept.subarray(4 + length);
    }
  }
}

function stateOf(bytes) {
  const state = { isReset: false };
  readMessage(bytes, { 1: (reset) => (state.isReset = reset === 1) });
  return state;
}

export function changeOf(bytes) {
  const none = new Uint8Array(0);
  const change = { revision: 0, isComplete: false, removed: none, added: none, cause: "other" };
  readMessage(bytes, {
    1: (revision) => (change.revision = revision),
    2: (complete) => (change.isComplete = complete === 1),
    3: (_, eight) => (change.hash = hexOf(eight)),
    4: (blocks) => (change.removed = blocks),
    5: (blocks) => (change.added = blocks),
    6: (scan) => Object.assign(change, { cause: "scan", scan: scanOf(scan) }),
    7: () => (change.cause = "deletion"),
    8: () => (change.cause = "undo"),
    9: () => (change.cause = "keep_out"),
  });
  return change;
}

/** Eight bytes, little-endian, as the number's hexadecimal digits. */
function hexOf(bytes) {
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).reverse().join("");
}

function scanOf(bytes) {
  const scan = { robot: "", session: "", scan_id: null, position: [0, 0, 0], rotation: [0, 0, 0, 1] };
  readMessage(bytes, {
    1: (robot) => (scan.robot = text(robot)),
    2: (session) => (scan.session = text(session)),
    3: (id) => (scan.scan_id = id),
    5: (pose) =>
      readMessage(pose, {
        1: (translation) => (scan.position = numbers(translation, 3)),
        2: (rotation) => (scan.rotation = numbers(rotation, 4)),
      }),
  });
  return scan;
}

export function failureOf(bytes) {
  const failure = { code: RPC_UNAVAILABLE, reason: "", message: "" };
  readMessage(bytes, {
    1: (code) => (failure.code = code),
    2: (reason) => (failure.reason = text(reason)),
    3: (message) => (failure.message = text(message)),
    4: (seconds) => (failure.retryAfter = seconds),
  });
  return new Problem(STATUS_OF_CODE[failure.code] ?? LOST, failure.reason, failure.message, failure.retryAfter);
}
