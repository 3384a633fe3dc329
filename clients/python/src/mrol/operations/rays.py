"""What rays meet first."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import F32, Bools, number_of, rows_of
from .._question import I32, Arrays, Names
from ..errors import ArgumentError, BadAnswer
from ..version import InParts, Version
from .checks import Unknown
from .handle import MapHandle, asked, word_of
from .occupancy import STAND_IN
from .parts import Part

AHEAD: F32 = np.array([[1, 0, 0]], "<f4")


@dataclass(frozen=True, eq=False)
class Rays(InParts):
    """What each ray meets first. Arrays have the shape of the rays."""

    hit: Bools
    count: int
    """How many rays meet something."""
    distances_m: F32
    """How far it is from the origin to where the ray enters what it meets; infinite where it meets nothing."""
    voxels: I32
    """The voxel, indices i j k of the level, shape (..., 3): where a ray meets a voxel."""
    keep_outs: Names
    """The name of the keep-out that is met in the place of a voxel, or None."""


class RayOperations(MapHandle):
    """Rays."""

    def cast_rays(
        self,
        origins: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        range_m: float | None = None,
        ends: ArrayLike | None = None,
        unknown: Unknown = "free",
        level: int = 0,
        ignore_keep_outs: bool = False,
        min_revision: int | None = None,
        map_uuid: str | None = None,
    ) -> Rays:
        """What each ray meets first: from origins along unit vectors, up to `range_m`, or to `ends`.

        `directions` or `ends` have shape (..., 3); `origins` the same, or (3,) for all rays. Map frame, meters. With
        `unknown="occupied"` a ray ends where no scan saw through.
        More than the server takes at once are asked about in several requests (see `query`).

        Raises `InvalidArgument` (`bad_ray`, `point_out_of_range`), naming which.
        """
        if (directions is None) == (ends is None):
            raise ArgumentError("directions", "both or neither of directions and ends", "the only one of them")
        name, towards = ("ends", ends) if directions is None else ("directions", directions)
        assert towards is not None
        rows, shape = rows_of(towards, 3, name, f"{name} x y z, shape (..., 3)", self._request_bytes_max)
        of_origins = "origins x y z, one for each ray or one of shape (3,) for all"
        starts, start_shape = rows_of(origins, 3, "origins", of_origins, self._request_bytes_max)
        if start_shape not in (shape, (), (1,)):
            raise ArgumentError("origins", f"shape {(*start_shape, 3)} for rays of shape {(*shape, 3)}", of_origins)
        of_all = {
            "range_m": None if range_m is None else number_of(range_m, "range_m"),
            "unknown": word_of(unknown, "unknown"),
            **asked(level, ignore_keep_outs, min_revision, map_uuid),
        }
        has_own = len(starts) == len(rows)
        # Where there is no ray one along x from the origin stands in.
        given, begins = (rows, starts) if len(rows) else (AHEAD, STAND_IN)

        def ask(part: Part) -> Rays:
            arrays, of_part = Arrays(), given[part.of]
            origins_of_part = begins[part.of] if has_own else begins
            head = {"origins": arrays.add(origins_of_part), name: arrays.add(of_part), **of_all}
            answer = self._ask("rays", head, arrays, part)
            count = len(of_part)
            if answer.head.whole("rays") != count:
                raise BadAnswer(f"{answer.head.whole('rays')} rays were cast, not {count}")
            hits = answer.head.whole("hits")
            return Rays(
                Version.of(answer.head),
                answer.bits("hit", count, hits),
                hits,
                answer.floats("distances_m", count),
                answer.voxels("voxels", count),
                answer.names("keep_outs", count),
            )

        return self._in_parts(len(rows), rows.nbytes + starts.nbytes, shape, ask)
