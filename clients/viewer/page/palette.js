// Colors, as light and as dark as the reader's system is.

const dark = matchMedia("(prefers-color-scheme: dark)");

const THEMES = {
  light: {
    background: "#eef1f4",
    grid: "#c9d1d9",
    plain: "#98a6b3",
    accent: "#d9541e",
    keepOut: "#b3261e",
    refused: "#c2185b",
    free: "#5aa06f",
    unknown: "#8a93a0",
    heights: ["#3d5a80", "#4f83a1", "#74aaa9", "#a9c6a0", "#dcd3a0", "#e6b981"],
  },
  dark: {
    background: "#14181d",
    grid: "#2b333c",
    plain: "#5f6c79",
    accent: "#ff7a45",
    keepOut: "#ff5449",
    refused: "#ff5fa2",
    free: "#4f9a68",
    unknown: "#6d7683",
    heights: ["#2e4a6e", "#3a6f91", "#4f9797", "#86b58c", "#c9c387", "#e0ad6f"],
  },
};

/** Colors of robots, easy to tell apart in both themes. */
const ROBOTS = ["#e4572e", "#2e86de", "#2a9d5c", "#9b5de5", "#d4a017", "#00a5a5", "#d6438b", "#7c8a2e"];
const LEVELS = ["#4f83a1", "#5f9f95", "#7fae83", "#a8b577", "#cdb26f", "#dd9f6b", "#dc8670", "#cd7386", "#b46b9f", "#936bb0", "#7270b5", "#5a7aae"];

export const theme = () => (dark.matches ? THEMES.dark : THEMES.light);

export const whenThemeChanges = (heard) => dark.addEventListener("change", heard);

/** How many colors robots have; then they repeat. */
export const ROBOT_COLORS = ROBOTS.length;

/** The color of a robot, by its place among the robots. */
export const robotColor = (place) => ROBOTS[place % ROBOTS.length];

/** Four numbers from 0 to 1. */
export function rgba(hex, alpha = 1) {
  return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255).concat(alpha);
}

const mix = (a, b, share) => a.map((value, i) => value + (b[i] - value) * share);

function ramp(stops, share) {
  const at = share * (stops.length - 1);
  const from = Math.min(Math.floor(at), stops.length - 2);
  return mix(rgba(stops[from]), rgba(stops[from + 1]), at - from);
}

/** The colors of voxels: rows of 256 by height, by tag and by level. `tagColor(tag)` is four numbers, or none. */
export function voxelColors(tagColor) {
  const { heights, plain } = theme();
  const colors = new Uint8Array(3 * 256 * 4);
  const put = (row, i, color) => colors.set(color.map((value) => Math.round(value * 255)), (row * 256 + i) * 4);
  for (let i = 0; i < 256; i++) {
    put(0, i, ramp(heights, i / 255));
    put(1, i, (i > 0 && tagColor(i)) || rgba(plain, i === 0 ? 1 : 0));
    put(2, i, rgba(LEVELS[Math.min(i, LEVELS.length - 1)]));
  }
  return colors;
}
