// Says whether changes are coming in.

import { LOST } from "./api.js";
import { byId } from "./dom.js";
import { explained } from "./notices.js";

let timer;

function say(state, text) {
  clearInterval(timer);
  byId("connection").dataset.state = state;
  byId("connection-said").textContent = text;
}

export const connecting = () => say("", "connecting");
export const live = (revision) => say("live", `live, revision ${revision}`);
export const none = () => say("", "");

/** The connection is lost, and tried again after some seconds; for good without. */
export function lost(problem, seconds) {
  if (seconds === undefined) return say("lost", explained(problem));
  const until = Date.now() + seconds * 1000;
  const why = problem.status === LOST ? "Connection lost" : explained(problem);
  const tell = () => {
    const left = Math.ceil((until - Date.now()) / 1000);
    byId("connection-said").textContent = left > 0 ? `${why}; again in ${left} s` : `${why}; connecting`;
  };
  say("lost", "");
  tell();
  timer = setInterval(tell, 1000);
}
