// Mouse, touch and keys: turning, moving and zooming the camera, and clicks.

const TURN_A_PIXEL = 0.006;
const ZOOM_A_NOTCH = 1.0015;
const CLICK_PIXELS = 5;
const KEY_TURN = 0.1;
const KEY_PAN = 0.08;
const KEY_ZOOM = 1.2;

/** `heard` has `moved()` and `clicked(x, y)`. */
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
    if (pointers.size > 1 && spread() > 0) camera.zoom(apart / spread());
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
      const place = [(event.offsetX / canvas.clientWidth) * 2 - 1, 1 - (event.offsetY / canvas.clientHeight) * 2];
      camera.zoom(ZOOM_A_NOTCH ** (event.deltaY * lines), place);
      heard.moved();
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const [x, y] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [0, 0];
    if (x !== 0 || y !== 0) {
      if (event.shiftKey || camera.isTop) camera.pan(x * KEY_PAN, y * KEY_PAN);
      else camera.orbit(x * KEY_TURN, y * KEY_TURN);
    } else if (event.key === "+" || event.key === "=") camera.zoom(1 / KEY_ZOOM);
    else if (event.key === "-") camera.zoom(KEY_ZOOM);
    else return;
    event.preventDefault();
    heard.moved();
  });
}
