// Numbers as people read them.

export const count = (number) => Math.round(number).toLocaleString("en");

export function meters(value) {
  const size = Math.abs(value);
  if (size >= 1000) return `${trimmed(value / 1000)} km`;
  if (size >= 1 || size === 0) return `${trimmed(value)} m`;
  return size >= 0.01 ? `${trimmed(value * 100)} cm` : `${trimmed(value * 1000)} mm`;
}

const trimmed = (value) => String(Number(value.toPrecision(3)));

export const place = (point) => point.map((value) => value.toFixed(2)).join(", ");

/** 1, 2 or 5 times a power of ten, at most `value`. */
export function roundDown(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [5, 2, 1].find((step) => step * power <= value * 1.0001);
}

export function clock(milliseconds) {
  return new Date(milliseconds).toLocaleTimeString();
}

/** How long ago something was. */
export function ago(milliseconds) {
  const seconds = Math.max(0, Math.round(milliseconds / 1000));
  if (seconds < 2) return "now";
  if (seconds < 120) return `${seconds} s ago`;
  if (seconds < 7200) return `${Math.round(seconds / 60)} min ago`;
  return `${Math.round(seconds / 3600)} h ago`;
}
