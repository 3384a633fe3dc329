// What the page's link carries: the map, where it is looked at from, the finest level, the coloring. Never a key.

const SECONDS_BETWEEN = 0.4;
let timer;

export function readLink() {
  const said = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  // A path that has these as names leads elsewhere, however they are quoted.
  if ([".", ".."].includes(said.map)) delete said.map;
  return said;
}

/** Keeps the link up to date, not at each step of a motion. */
export function writeLink(state) {
  clearTimeout(timer);
  timer = setTimeout(() => {
    const said = Object.entries(state()).filter(([, value]) => value !== undefined && value !== "");
    history.replaceState(null, "", `#${new URLSearchParams(said)}`);
  }, SECONDS_BETWEEN * 1000);
}

/** The parts of a link that say where the camera is. */
export function cameraParts(camera) {
  const rounded = (value) => Number(value.toPrecision(6));
  return {
    at: camera.target.map(rounded).join(","),
    distance: rounded(camera.distance),
    yaw: rounded(camera.yaw),
    pitch: rounded(camera.pitch),
    top: camera.isTop ? 1 : undefined,
  };
}

/** Puts a camera where a link says; false where it says nothing of use. */
export function placeCamera(camera, { at, distance, yaw, pitch, top }) {
  const target = (at ?? "").split(",").map(Number);
  const numbers = [...target, Number(distance), Number(yaw), Number(pitch)];
  if (target.length !== 3 || !numbers.every(Number.isFinite) || Number(distance) <= 0) return false;
  Object.assign(camera, { target, distance: Number(distance), yaw: Number(yaw), pitch: Number(pitch), isTop: top === "1" });
  return true;
}
