// The panel's lists of robots and of the answers to them: what needs somebody to look comes first.

import { button, byId, dot, element } from "./dom.js";
import { isBad, sentenceOf, wordsOf } from "./events.js";
import { ago, clock } from "./format.js";
import { robotColor } from "./palette.js";

const SHOWN = 50;
const ROBOTS_SHOWN = 100;

/** Shows what a session knows of its robots; `goTo(position)` leads there. */
export function showAnswers({ robots, events, arrivals }, goTo) {
  const names = Array.from(new Set([...robots.names(), ...events.last.keys()])).sort();
  const of = names.map((name) => ({ name, event: events.last.get(name), seen: robots.seen.get(name), color: robotColor(arrivals.placeOf(name)) }));
  const bad = of.filter(needsAttention);
  byId("attention").textContent = bad.length > 0 ? `${bad.length} of ${of.length} ${bad.length === 1 ? "needs" : "need"} attention` : "";
  const now = events.now();
  const inOrder = [...bad, ...of.filter((robot) => !needsAttention(robot))];
  const items = inOrder.slice(0, ROBOTS_SHOWN).map((robot) => robotItem(robot, now, goTo));
  byId("robots").replaceChildren(...items);
  if (of.length === 0) byId("robots").replaceChildren(element("li", { className: "soft" }, "no scan yet"));
  if (!byId("answers").parentElement.open) return;
  const newest = events.newest.slice(-SHOWN).reverse();
  byId("answers").replaceChildren(...newest.map((event) => answerItem(event, robotColor(arrivals.placeOf(event.robot)), goTo)));
}

/** The names of the robots that are seen, those first that need attention, and whether they do. */
export function robotsByNeed({ robots, events }) {
  const named = robots.names().map((name) => ({ name, seen: robots.seen.get(name), event: events.last.get(name) }));
  const all = named.map((robot) => ({ ...robot, isBad: needsAttention(robot) }));
  return all.sort((a, b) => b.isBad - a.isBad);
}

/** What is known of the last scan: of one from before the server's start, only where it was taken and its verdict. */
const needsAttention = ({ event, seen }) => (event ? isBad(event) : seen.verdict !== "accepted");

function robotItem(robot, now, goTo) {
  const { name, event, seen, color } = robot;
  const words = event ? wordsOf(event) : seen.verdict;
  const when = event ? `${ago(now - event.time_ms)}, ${Math.round(event.duration_ms)} ms` : "";
  return element(
    "li",
    { className: "robot", title: event ? sentenceOf(event) : "" },
    dot(color),
    placeButton(name, event?.guess?.translation_m, seen?.position, goTo),
    element("span", { className: needsAttention(robot) ? "bad" : "soft" }, words),
    element("small", { className: "soft" }, when),
  );
}

function answerItem(event, color, goTo) {
  const found = event.answer?.map_from_sensor.translation_m;
  return element(
    "li",
    { title: sentenceOf(event) },
    dot(color),
    placeButton(`${clock(event.time_ms)} ${event.robot}`, isBad(event) ? event.guess?.translation_m : undefined, found, goTo),
    element("span", { className: isBad(event) ? "bad" : "soft" }, wordsOf(event)),
  );
}

/** A name that leads to the first place that there is. */
function placeButton(name, first, second, goTo) {
  const position = first ?? second;
  return button(name, () => position && goTo(position), { className: "place", disabled: !position });
}
