// Mouse, touch and keys: turning, moving and zooming the camera, and clicks.

const TURN_A_PIXEL = 0.006;
const ZOOM_A_NOTCH = 1.0015;
const CLICK_PIXELS = 5;
const KEY_TURN = 0.1;
const KEY_PAN = 0.08;
const KEY_ZOOM = 1.2;

/** `heard` has `moved()`, `clicked(x, y)` and `pointAt(x, y)`, the point of the map that is seen there, if any. */
export function control(canvas, camera, heard) {
  const pointers = new Map();
  let dragged = 0;
  const center = () => {
    const all = Array.from(pointers.values());
    return [0, 1].map((axis) => all.reduce((sum, place) => sum + place[axis], 0) / all.length);
  };
  const spread = () => {
    const [a, b] = Array.from(pointers.values());
    return b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  };

  /** Zooms at a place of the page: at the surface that is seen there, so that the wheel does not lead through it. */
  const zoomAt = (by, [x, y]) => {
    const point = heard.pointAt(x, y);
    if (point) return camera.zoomTo(point, by);
    const { left, top, width, height } = canvas.getBoundingClientRect();
    camera.zoom(by, [((x - left) / width) * 2 - 1, 1 - ((y - top) / height) * 2]);
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    if (pointers.size === 0) dragged = 0;
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) return;
    const [before, apart] = [center(), spread()];
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    const after = center();
    const [x, y] = [after[0] - before[0], after[1] - before[1]];
    dragged += Math.hypot(x, y) + Math.abs(spread() - apart);
    if (dragged < CLICK_PIXELS) return;
    const pans = pointers.size > 1 || event.shiftKey || event.buttons === 2 || event.buttons === 4;
    if (pans || camera.isTop) camera.pan(-x / canvas.clientHeight, y / canvas.clientHeight);
    else camera.orbit(-x * TURN_A_PIXEL, y * TURN_A_PIXEL);
    if (pointers.size > 1 && spread() > 0) zoomAt(apart / spread(), after);
    heard.moved();
  });
  const ended = (event) => {
    const wasDown = pointers.delete(event.pointerId);
    if (wasDown && event.type === "pointerup" && event.button === 0 && dragged < CLICK_PIXELS && pointers.size === 0) {
      heard.clicked(event.clientX, event.clientY);
    }
  };
  canvas.addEventListener("pointerup", ended);
  canvas.addEventListener("pointercancel", ended);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
      zoomAt(ZOOM_A_NOTCH ** (event.deltaY * lines), [event.clientX, event.clientY]);
      heard.moved();
    },
    { passive: false },
  );
  const middle = () => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    return [left + ((1 + camera.middle[0]) / 2) * width, top + ((1 - camera.middle[1]) / 2) * height];
  };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const [x, y] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [0, 0];
    if (x !== 0 || y !== 0) {
      if (event.shiftKey || camera.isTop) camera.pan(x * KEY_PAN, y * KEY_PAN);
      else camera.orbit(x * KEY_TURN, y * KEY_TURN);
    } else if (event.key === "+" || event.key === "=") zoomAt(1 / KEY_ZOOM, middle());
    else if (event.key === "-") zoomAt(KEY_ZOOM, middle());
    else return;
    event.preventDefault();
    heard.moved();
  });
}
