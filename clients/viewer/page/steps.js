// Where robots took their scans, one after the other: a few bytes each, since a map may have hundreds of thousands.

export class Steps {
  /** Names of robots by their places. */
  #names = [];
  #places = new Map();
  /** Of each step the robot's place, and x y z. */
  #robots = new Uint32Array(256);
  #positions = new Float64Array(3 * 256);
  length = 0;

  push(robot, position) {
    if (this.length === this.#robots.length) this.#resize(2 * this.length);
    if (!this.#places.has(robot)) this.#places.set(robot, this.#names.push(robot) - 1);
    this.#robots[this.length] = this.#places.get(robot);
    this.#positions.set(position, 3 * this.length);
    this.length += 1;
  }

  /** Forgets all but the newest. */
  keepNewest(count) {
    const gone = this.length - count;
    if (gone <= 0) return;
    this.#robots.copyWithin(0, gone, this.length);
    this.#positions.copyWithin(0, 3 * gone, 3 * this.length);
    this.length = count;
  }

  *[Symbol.iterator]() {
    for (let i = 0; i < this.length; i++) {
      yield { robot: this.#names[this.#robots[i]], position: Array.from(this.#positions.subarray(3 * i, 3 * i + 3)) };
    }
  }

  #resize(count) {
    const [robots, positions] = [this.#robots, this.#positions];
    this.#robots = new Uint32Array(count);
    this.#robots.set(robots);
    this.#positions = new Float64Array(3 * count);
    this.#positions.set(positions);
  }
}
