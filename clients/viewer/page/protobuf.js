// The wire form of protobuf messages, as far as `WatchResponse` needs it.

const VARINT = 0;
const FIXED64 = 1;
const BYTES = 2;
const FIXED32 = 5;

const utf8 = new TextDecoder();

/**
 * Reads a message field by field: `read[number](value)`, where a value is a number or bytes. Of eight bytes it is the float
 * that they are, with the bytes behind it.
 */
export function readMessage(bytes, read) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = 0;
  const varint = () => {
    let value = 0;
    // Beyond 2^53 a number is not exact. Revisions end there, and times need no nanosecond.
    for (let factor = 1; ; factor *= 128) {
      const byte = view.getUint8(at++);
      value += (byte & 127) * factor;
      if (byte < 128) return value;
    }
  };
  while (at < bytes.length) {
    const tag = varint();
    let value, eight;
    if ((tag & 7) === VARINT) {
      value = varint();
    } else if ((tag & 7) === FIXED64) {
      value = view.getFloat64(at, true);
      eight = bytes.subarray(at, at + 8);
      at += 8;
    } else if ((tag & 7) === BYTES) {
      const length = varint();
      value = bytes.subarray(at, at + length);
      at += length;
    } else if ((tag & 7) === FIXED32) {
      value = view.getFloat32(at, true);
      at += 4;
    } else {
      throw new Error(`the wire type ${tag & 7} is none of this contract`);
    }
    read[tag >>> 3]?.(value, eight);
  }
}

export const text = (bytes) => utf8.decode(bytes);

/** Numbers in the fields 1, 2, ... of a message; those left out are 0. */
export function numbers(bytes, count) {
  const values = new Array(count).fill(0);
  readMessage(bytes, Object.fromEntries(values.map((_, i) => [i + 1, (value) => (values[i] = value)])));
  return values;
}
