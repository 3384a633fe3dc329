// The part of the picture that bar, tools and panel leave free.

import { byId } from "./dom.js";

const MARGIN_PIXELS = 14;
/** Less than this share of the picture is no room: the map is then drawn behind the panels. */
const SHARE_MIN = 0.12;

/** Its corners, -1 to 1 from left to right and from bottom to top. */
export function roomOf(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const place = (id) => byId(id).getBoundingClientRect();
  const [bar, tools, side, foot] = ["bar", "tools", "side", "foot"].map(place);
  // On a narrow page the tools stand in a row below the bar, else below each other.
  const isRow = tools.width > tools.height;
  const [left, top, isOpen] = [isRow ? 0 : tools.right, isRow ? tools.bottom : bar.bottom, side.width > 0];
  // On a narrow page the panel lies below the map, else beside it.
  const isBelow = isOpen && side.width > width / 2;
  const right = isOpen && !isBelow ? side.left : width;
  const bottom = Math.min(foot.top, isBelow ? side.top : height);
  const across = fit(left + MARGIN_PIXELS, right - MARGIN_PIXELS, width);
  const up = fit(height - bottom + MARGIN_PIXELS, height - top - MARGIN_PIXELS, height);
  return { min: [across[0], up[0]], max: [across[1], up[1]] };
}

const fit = (from, to, size) => (to - from < SHARE_MIN * size ? [-1, 1] : [from, to].map((pixel) => (2 * pixel) / size - 1));
