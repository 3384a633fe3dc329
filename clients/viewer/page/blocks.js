// Voxels as the server sends them: blocks of 8 x 8 x 8, 72 bytes each.
//
//     8 bytes   the packed key: 21 bits an axis, x lowest, in two's complement, in units of blocks
//    64 bytes   a bit a voxel in Morton order: a byte is a cube of 2 x 2 x 2, x fastest

export const BLOCK_BYTES = 72;

/** Where in its block the cube of each byte lies. */
const CUBES = Array.from({ length: 64 }, (_, byte) => {
  const axis = (a) => (((byte >> a) & 1) | (((byte >> (a + 3)) & 1) << 1)) * 2;
  return [axis(0), axis(1), axis(2)];
});

const signed21 = (bits) => (bits << 11) >> 11;

/** Calls `visit(x, y, z, masks)` with the index of each block and its 64 bytes. */
export function eachBlock(bytes, visit) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  for (let at = 0; at + BLOCK_BYTES <= bytes.length; at += BLOCK_BYTES) {
    const low = view.getUint32(at, true);
    const high = view.getUint32(at + 4, true);
    const y = ((low >>> 21) | (high << 11)) & 0x1fffff;
    visit(signed21(low & 0x1fffff), signed21(y), signed21((high >>> 10) & 0x1fffff), bytes.subarray(at + 8, at + BLOCK_BYTES));
  }
}

/** Calls `visit(x, y, z, bits)` with each cube of a block that is not empty; bit x + 2 y + 4 z is a voxel of it. */
export function eachCube(masks, visit) {
  for (let byte = 0; byte < 64; byte++) {
    if (masks[byte] !== 0) visit(CUBES[byte][0], CUBES[byte][1], CUBES[byte][2], masks[byte]);
  }
}

/** Calls `visit(x, y, z)` with the index of each voxel. */
export function eachVoxel(bytes, visit) {
  eachBlock(bytes, (blockX, blockY, blockZ, masks) => {
    eachCube(masks, (x, y, z, bits) => {
      for (let i = 0; i < 8; i++) {
        if ((bits >> i) & 1) visit(blockX * 8 + x + (i & 1), blockY * 8 + y + ((i >> 1) & 1), blockZ * 8 + z + (i >> 2));
      }
    });
  });
}
