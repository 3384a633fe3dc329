// What the page has to say, for a while, at its lower edge; and the question for a key.

import { LOST, Problem, useKey } from "./api.js";
import { button, byId, element } from "./dom.js";

const SHOWN_MS = 12_000;
/** With something that one may do about it. */
const OFFERED_MS = 60_000;
const NOTICES_MAX = 4;

/** Says something, with what one may do about it: `[label, action]`. */
export function notice(text, { isBad = false, action } = {}) {
  const made = element("div", { className: `card${isBad ? " bad" : ""}` }, element("span", {}, text));
  const close = () => made.remove();
  if (action) {
    const [label, act] = action;
    made.append(button(label, () => (close(), act())));
  }
  made.append(button("Close", close));
  const all = byId("notices");
  const same = Array.from(all.children).find((other) => other.firstChild.textContent === text);
  same?.remove();
  all.append(made);
  while (all.children.length > NOTICES_MAX) all.firstChild.remove();
  setTimeout(close, action ? OFFERED_MS : SHOWN_MS);
}

/** What a refusal means to somebody before this page. */
export function explained(problem) {
  const wait = problem.retryAfter ? ` It says to come back in ${Math.ceil(problem.retryAfter)} s.` : "";
  switch (problem.status) {
    case LOST:
      return problem.message;
    case 401:
      return `The server asks for a key. ${problem.message}`;
    case 403:
      return `The key is not for this. ${problem.message}`;
    case 429:
      return `A limit of the server is reached. ${problem.message}${wait}`;
    case 503:
      return `The server is not ready. ${problem.message}${wait}`;
    case 504:
      return `The server takes too long for this. ${problem.message}`;
    default:
      return problem.message;
  }
}

/** Tells of a failure; where a key would help, there is a way to give one. `again` is done with the key. */
export function failed(error, again) {
  if (!(error instanceof Problem)) {
    console.error(error);
    return notice(`The page has a defect: ${error.message}`, { isBad: true });
  }
  if (error.status === 401) return askForKey(error, again);
  const action = error.status === 403 ? ["Other key", () => askForKey(error, again)] : undefined;
  notice(explained(error), { isBad: true, action });
}

export function askForKey(problem, again) {
  const dialog = byId("key-dialog");
  if (dialog.open) return;
  byId("key-title").textContent = problem.status === 403 ? "The key is not for this" : "This server asks for a key";
  byId("key-said").textContent = problem.message;
  byId("key").value = "";
  dialog.onclose = () => {
    if (dialog.returnValue !== "use") return;
    useKey(byId("key").value);
    byId("key").value = "";
    again?.();
  };
  dialog.returnValue = "";
  dialog.showModal();
}
