"""Bitmaps, packed keys and blocks of voxels.

A packed key has 21 bits an axis, x lowest, in two's complement. A block is 8 x 8 x 8 voxels: its key in units of blocks, and a
bit a voxel in Morton order (bits z2 y2 x2 z1 y1 x1 z0 y0 x0 of the place in the block).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Bools

AXIS_BITS = 21
BLOCK_SIDE = 8
BLOCK_VOXELS = BLOCK_SIDE**3
BLOCK = np.dtype([("key", "<u8"), ("mask", "u1", (BLOCK_VOXELS // 8,))])
"""A block as it is sent: 72 bytes."""


def unpacked(bitmap: memoryview, count: int, set_bits: int | None = None) -> Bools:
    """So many booleans of a bitmap, the lowest bit of each byte first; where it is told how many are set, so many are.

    Raises `ValueError` for a bitmap of another number of them.
    """
    if bitmap.nbytes != (count + 7) // 8:
        raise ValueError(f"{bitmap.nbytes} bytes are no {count} bits")
    bits = np.unpackbits(np.frombuffer(bitmap, np.uint8), count=count, bitorder="little").view(np.bool_)
    if count % 8 and bitmap[-1] >> (count % 8):
        raise ValueError(f"bits behind the last of {count}")
    if set_bits is not None and np.count_nonzero(bits) != set_bits:
        raise ValueError(f"{np.count_nonzero(bits)} bits are set, and {set_bits} are told")
    bits.setflags(write=False)
    return bits


def indices_of(keys: NDArray[Any]) -> NDArray[np.int32]:
    """Indices i j k of packed keys of shape (n,), shape (n, 3)."""
    signed = keys.astype(np.int64)
    shifts = np.array([64 - AXIS_BITS * (axis + 1) for axis in range(3)])
    indices: NDArray[np.int32] = ((signed[:, None] << shifts) >> (64 - AXIS_BITS)).astype(np.int32)
    return indices


def voxels_of(blocks: NDArray[Any]) -> NDArray[np.int32]:
    """Indices i j k of all voxels of blocks, shape (n, 3)."""
    block, place = np.nonzero(np.unpackbits(blocks["mask"], axis=1, bitorder="little"))
    indices: NDArray[np.int32] = indices_of(blocks["key"])[block] * BLOCK_SIDE + _PLACES[place]
    return indices


def blocks_of(data: bytes | memoryview) -> NDArray[Any]:
    """Blocks as they are sent."""
    return np.frombuffer(data, BLOCK)


def _places() -> NDArray[np.int32]:
    number = np.arange(BLOCK_VOXELS)
    axes = [sum((number >> (3 * bit + axis) & 1) << bit for bit in range(3)) for axis in range(3)]
    return np.stack(axes, axis=1).astype(np.int32)


_PLACES = _places()
"""Place in its block of each voxel, in Morton order."""
