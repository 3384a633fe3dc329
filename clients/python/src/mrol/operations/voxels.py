"""The occupied voxels of a level."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arguments import flag_of, level_of
from .._arrays import F64, numbers_text, vector_of
from .._fields import Fields, reading
from .._transport.request import Parameter
from ..errors import ArgumentError, excerpt
from ..pose import Pose, PoseLike
from ..shapes import BoxLike, OrientedBox
from ..version import Version, Versioned
from .handle import MapHandle
from .region import region_parameters

ARRAY = b'"voxels":['
"""What stands before the list of voxels, which is the last field of its answer."""


@dataclass(frozen=True, eq=False)
class View:
    """What a camera sees, whose frame has z forward, x right and y down."""

    map_from_camera: PoseLike
    fov_rad: ArrayLike
    """From edge to edge, horizontally and vertically."""
    range_m: ArrayLike
    """The nearest and the farthest in front of the camera."""


@dataclass(frozen=True, eq=False)
class Voxels(Versioned):
    """Occupied voxels of a level, at one revision."""

    indices: NDArray[np.int32]
    """Shape (n, 3): voxel i j k spans `[i, i + 1) * resolution_m` in x, and so on."""
    level: int
    resolution_m: float
    """The side of the level's voxels."""

    def __len__(self) -> int:
        return len(self.indices)

    @property
    def centers_m(self) -> F64:
        """The centers of the voxels, shape (n, 3), in the map frame."""
        return np.asarray((self.indices + 0.5) * self.resolution_m, np.float64)


class VoxelOperations(MapHandle):
    """Listings of voxels."""

    def voxels(
        self,
        level: int = 0,
        *,
        box: BoxLike | OrientedBox | None = None,
        view: View | None = None,
        keep_out: bool = False,
    ) -> Voxels:
        """The occupied voxels of a level: all, those with their centers in a box, or those that a camera sees.

        `level` 0 is the finest. `box` is a `Box`, its two corners, or an `OrientedBox`; `view` what a camera sees, a `View`. With
        `keep_out` voxels count whose centers lie in keep-outs.

        Raises `ResourceExhausted` (`listing_too_large`: take a box or a coarser level).
        """
        answer = self._get("voxels", **_listing(level, box, view, keep_out))
        with reading("the listing"):
            head, indices = _read(answer.body)
            if head.whole("voxels_total") != len(indices):
                raise ValueError(f"{len(indices)} voxels of {head.whole('voxels_total')}")
            found = Voxels(Version.of(head), indices, head.whole("level"), head.number("resolution_m"))
        return self._noted(found)

    def count_voxels(
        self,
        level: int = 0,
        *,
        box: BoxLike | OrientedBox | None = None,
        view: View | None = None,
        keep_out: bool = False,
    ) -> int:
        """How many voxels `voxels` would list by the same `level`, `box`, `view` and `keep_out`; any number is counted."""
        parameters = _listing(level, box, view, keep_out)
        return self._get_fields("voxels", count_only=True, **parameters).whole("voxels_total")


def _listing(level: int, box: BoxLike | OrientedBox | None, view: View | None, keep_out: bool) -> dict[str, Parameter]:
    of_view: dict[str, Parameter] = {}
    if view is not None:
        if not isinstance(view, View):
            raise ArgumentError("view", excerpt(view), "a View")
        of_view = {
            "map_from_camera": numbers_text(Pose.of(view.map_from_camera, "view.map_from_camera").seven()),
            "fov": numbers_text(vector_of(view.fov_rad, 2, "view.fov_rad", is_finite=True)),
            "range": numbers_text(vector_of(view.range_m, 2, "view.range_m", is_finite=True)),
        }
    return {"level": level_of(level), "keep_out": flag_of(keep_out, "keep_out"), **region_parameters(box), **of_view}


def _read(body: memoryview) -> tuple[Fields, NDArray[np.int32]]:
    """The head of a listing, and its voxels: read as numbers at once, since millions of lists take gigabytes."""
    text = bytes(body)
    begin = text.find(ARRAY)
    if begin < 0 or not text.endswith(b"]}"):
        raise ValueError("it has no voxels at its end")
    head: Any = json.loads(text[:begin] + b'"voxels":null}')
    numbers = text[begin + len(ARRAY) : -2].translate(None, b"[] ")
    # What is no number ends the reading, and then there are too few.
    indices = np.fromstring(numbers, np.int32, sep=",").reshape(-1, 3)
    indices.setflags(write=False)
    return Fields(head), indices
