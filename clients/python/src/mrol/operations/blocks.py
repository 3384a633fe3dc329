"""A part of a level as it is stored: masks of blocks of voxels, or the distance field of a box."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arguments import level_of
from .._arrays import F32, number_of
from .._bits import blocks_of, voxels_of
from .._fields import reading
from .._transport.request import BYTES, Answer, Parameter, Request
from ..shapes import Box, BoxLike, OrientedBox
from ..version import Version, Versioned, whole_header
from .handle import MapHandle
from .region import region_parameters

QUARTERS = 4
"""Distances are whole numbers of quarters of a voxel."""


@dataclass(frozen=True, eq=False)
class VoxelBlocks(Versioned):
    """Occupied voxels of a level, 8 x 8 x 8 of them a block."""

    level: int
    resolution_m: float
    blocks: NDArray[Any]
    """Records of a packed `key` and a `mask` of 64 bytes, a bit a voxel in Morton order; empty blocks are left out."""

    def indices(self) -> NDArray[np.int32]:
        """Indices i j k of all voxels, shape (n, 3)."""
        return voxels_of(self.blocks)


@dataclass(frozen=True, eq=False)
class DistanceField(Versioned):
    """How far the center of each cell of a box is from the nearest occupied cube, in the box or around it."""

    level: int
    resolution_m: float
    origin: tuple[int, int, int]
    """Indices i j k of the first cell."""
    quarters: NDArray[np.uint8]
    """Shape (z, y, x): quarters of `resolution_m`, rounded down. 0 is an occupied cell."""
    cap: int
    """Stands for all that is as far or farther."""

    def distances_m(self) -> F32:
        """The same in meters, shape (z, y, x); infinite where it is as far as `cap` or farther."""
        distances: F32 = self.quarters * np.float32(self.resolution_m / QUARTERS)
        distances[self.quarters >= self.cap] = np.inf
        return distances


class BlockOperations(MapHandle):
    """Blocks."""

    def block(self, box: BoxLike | OrientedBox | None = None, *, level: int = 0) -> VoxelBlocks:
        """The occupied voxels of a level, 0 the finest, in a `box` (a `Box`, its two corners, or an `OrientedBox`), as masks.

        Without a `box` they are those of all of the `level`.

        Raises `ResourceExhausted` (`block_too_large`: ask for a smaller part or a coarser level).
        """
        answer = self._block({"form": "sparse", "level": level_of(level), **region_parameters(box)})
        with reading("the block"):
            resolution_m = float(answer.header("mrol-resolution-m") or "")
            blocks = blocks_of(answer.body)
            found = VoxelBlocks(Version.of_headers(answer), whole_header(answer, "mrol-level"), resolution_m, blocks)
        return self._noted(found)

    def distances(self, box: BoxLike, *, level: int = 0, cap_m: float | None = None) -> DistanceField:
        """The distance field of a box along the map's axes: a byte a cell.

        `box` is a `Box`, or its two corners; cells are the voxels of a `level`, 0 the finest. What is `cap_m` away or farther is
        not told apart, so that less has to be looked at.

        Raises `ResourceExhausted` (`block_too_large`), `InvalidArgument` (`bad_cap`, `bad_region`).
        """
        # Without a box all of the map would be meant, whose field has no bounds.
        checked = box if isinstance(box, OrientedBox) else Box.of(box)
        parameters: dict[str, Parameter] = {
            "form": "dense",
            "level": level_of(level),
            "cap_m": None if cap_m is None else number_of(cap_m, "cap_m"),
            **region_parameters(checked),
        }
        answer = self._block(parameters)
        with reading("the block"):
            resolution_m = float(answer.header("mrol-resolution-m") or "")
            x, y, z = _three(answer, "mrol-origin")
            shape = _three(answer, "mrol-size")[::-1]
            quarters = np.frombuffer(answer.body, np.uint8).reshape(shape)
            field = DistanceField(
                version=Version.of_headers(answer),
                level=whole_header(answer, "mrol-level"),
                resolution_m=resolution_m,
                origin=(x, y, z),
                quarters=quarters,
                cap=whole_header(answer, "mrol-cap"),
            )
        return self._noted(field)

    def _block(self, parameters: dict[str, Parameter]) -> Answer:
        return self._caller.call(Request("GET", self._target("block", **parameters), accept=BYTES))


def _three(answer: Answer, name: str) -> list[int]:
    numbers = [int(number) for number in (answer.header(name) or "").split(",")]
    if len(numbers) != 3 or (name == "mrol-size" and min(numbers) < 0):
        raise ValueError(f"{name}: {numbers}")
    return numbers
