// From where the map is looked at: all of it, from above, or as somebody turned it.

import { byId } from "./dom.js";
import { roomOf } from "./room.js";

/** Looking down with x to the right and y up, as maps are drawn. */
const NORTH_YAW = -Math.PI / 2;

export class Views {
  /** Nobody has moved the camera: it follows the map as it grows. */
  isFollowing = true;
  #scene;
  #canvas = byId("picture");
  #bounds = () => undefined;
  #moved;
  /** Where the camera was before it looked from above. */
  #before;

  /** `bounds()` is the box to look at, if there is any; `moved()` is called when a view was chosen. */
  constructor(scene, { bounds, moved }) {
    this.#scene = scene;
    this.#bounds = bounds;
    this.#moved = moved;
    byId("top").addEventListener("click", () => this.turnTop());
    byId("frame").addEventListener("click", () => this.showAll());
    const resized = new ResizeObserver(() => this.#resized());
    for (const id of ["picture", "side"]) resized.observe(byId(id));
  }

  /** Begins with a map: where a link has put the camera, or with a view of all. */
  open(isPlaced) {
    this.#before = undefined;
    this.isFollowing = !isPlaced;
    this.#resized();
    this.#say();
  }

  /** Shows the whole map, where nobody has chosen another view. */
  follow() {
    if (this.isFollowing && this.#bounds()) this.#scene.camera.frame(this.#bounds(), roomOf(this.#canvas));
  }

  showAll() {
    this.isFollowing = true;
    this.follow();
    this.#changed();
  }

  /** All of the map from above along its axes, and back to where the camera was. */
  turnTop() {
    const { camera } = this.#scene;
    const { target, distance, yaw, pitch, isTop } = camera;
    if (isTop) {
      Object.assign(camera, this.#before?.camera, { isTop: false });
      this.isFollowing = this.#before?.isFollowing ?? this.isFollowing;
      this.#before = undefined;
      this.follow();
    } else {
      this.#before = { camera: { target, distance, yaw, pitch }, isFollowing: this.isFollowing };
      Object.assign(camera, { isTop: true, yaw: NORTH_YAW });
      this.isFollowing = true;
      this.follow();
    }
    this.#changed();
  }

  /** Looks at a place from where the camera is. */
  goTo(place) {
    this.#scene.camera.target = place;
    this.isFollowing = false;
    this.#changed();
  }

  #changed() {
    this.#say();
    this.#scene.moved();
    this.#moved();
  }

  #say() {
    byId("top").setAttribute("aria-pressed", this.#scene.camera.isTop);
  }

  /** Keeps the target in the middle of what the panels leave. */
  #resized() {
    const { min, max } = roomOf(this.#canvas);
    this.#scene.camera.middle = [0, 1].map((axis) => (min[axis] + max[axis]) / 2);
    this.follow();
    this.#scene.invalidate();
  }
}
