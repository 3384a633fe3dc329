// The blocks that scans brought, with their tags: one array of bytes, since there may be thousands of scans.

export class Brought {
  #bytesMax;
  #bytes = new Uint8Array(1 << 16);
  /** Of each entry its tag, and where it ends. */
  #tags = [];
  #ends = [];

  /** @param bytesMax of all blocks; the oldest go for new ones */
  constructor(bytesMax) {
    this.#bytesMax = bytesMax;
  }

  get length() {
    return this.#ends.at(-1) ?? 0;
  }

  push(blocks, tag) {
    if (blocks.length > this.#bytesMax) return;
    if (this.length + blocks.length > this.#bytesMax) {
      // A quarter at once: what stays is moved.
      const kept = Math.min(this.#bytesMax - blocks.length, 0.75 * this.#bytesMax);
      const least = this.length - kept;
      this.#keep((_, start) => start >= least);
    }
    const end = this.length + blocks.length;
    if (end > this.#bytes.length) {
      const bytes = new Uint8Array(Math.min(Math.max(2 * this.#bytes.length, end), this.#bytesMax));
      bytes.set(this.#bytes);
      this.#bytes = bytes;
    }
    this.#bytes.set(blocks, this.length);
    this.#ends.push(end);
    this.#tags.push(tag);
  }

  forget(tag) {
    this.#keep((own) => own !== tag);
  }

  *[Symbol.iterator]() {
    for (let i = 0, start = 0; i < this.#ends.length; start = this.#ends[i++]) {
      yield { blocks: this.#bytes.subarray(start, this.#ends[i]), tag: this.#tags[i] };
    }
  }

  #keep(isKept) {
    const [tags, ends] = [this.#tags, this.#ends];
    [this.#tags, this.#ends] = [[], []];
    for (let i = 0, start = 0; i < ends.length; start = ends[i++]) {
      if (!isKept(tags[i], start)) continue;
      const at = this.length;
      this.#bytes.copyWithin(at, start, ends[i]);
      this.#tags.push(tags[i]);
      this.#ends.push(at + ends[i] - start);
    }
  }
}
