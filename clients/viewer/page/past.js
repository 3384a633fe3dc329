// Who brought what was there before the page was opened: the server's journal, read as a watch from an old revision on.

import { ask, pathOf } from "./api.js";
import { readMessage } from "./protobuf.js";
import { changeOf, failureOf, framesOf } from "./watch.js";

/** The first revision from which on a session knows now who brought what; none where the server has no journal. */
export async function readPast(session, signal) {
  const until = session.revision;
  // From the beginning, or from where scans can still be undone: as far the journal reaches.
  const oldest = session.info.storage?.undo_from_revision ?? 1;
  for (const first of oldest > 1 ? [1, oldest] : [1]) {
    if (first <= until && (await readFrom(session, first, until, signal))) return first;
  }
  return undefined;
}

/** Reads the changes from `first` to `until`; false where the server does not have them. */
async function readFrom({ name, uuid, arrivals }, first, until, signal) {
  const stop = new AbortController();
  const query = { since_revision: first - 1, map_uuid: uuid };
  const response = await ask(pathOf(name, "watch"), { query, signal: AbortSignal.any([signal, stop.signal]) });
  try {
    for await (const message of framesOf(response.body.getReader(), () => {})) {
      let change, failure, isState = false;
      readMessage(message, {
        3: () => (isState = true),
        4: (bytes) => (change = changeOf(bytes)),
        6: (bytes) => (failure = failureOf(bytes)),
      });
      if (failure) throw failure;
      if (isState) return false;
      if (!change) continue;
      if (change.revision > until) return true;
      const { scan, revision } = change;
      arrivals.takePast(change, scan ? arrivals.pastTagOf(scan.robot, revision, first, until) : 0);
      if (change.isComplete && revision >= until) return true;
    }
    return true;
  } finally {
    stop.abort();
  }
}
