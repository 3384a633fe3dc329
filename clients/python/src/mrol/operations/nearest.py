"""The nearest occupied voxel."""

from dataclasses import dataclass
from typing import Literal

from numpy.typing import ArrayLike

from .._arrays import F32, Bools, number_of, rows_of
from .._question import I32, Arrays, Names
from ..errors import BadAnswer
from ..version import InParts, Version
from .handle import MapHandle, asked, word_of
from .occupancy import POINTS, STAND_IN
from .parts import Part

MeasuredTo = Literal["cubes", "centers"]


@dataclass(frozen=True, eq=False)
class Nearest(InParts):
    """What is nearest to each point. Arrays have the shape of the points without their last axis."""

    found: Bools
    """Whether anything is within the radius."""
    distances_m: F32
    """The distance to it; infinite where nothing is found."""
    voxels: I32
    """The voxel, indices i j k of the level, shape (..., 3): where a voxel is nearest."""
    away: F32
    """The unit vector that leads away from it, shape (..., 3); zero where there is none."""
    keep_outs: Names
    """The name of the keep-out that is nearer than all voxels, or None."""


class NearestOperations(MapHandle):
    """Searches for the nearest voxel."""

    def nearest(
        self,
        points: ArrayLike,
        radius_m: float,
        *,
        to: MeasuredTo = "cubes",
        level: int = 0,
        ignore_keep_outs: bool = False,
        min_revision: int | None = None,
        map_uuid: str | None = None,
    ) -> Nearest:
        """The occupied voxel or the keep-out nearest to each point, within `radius_m` (64 voxels of the level at most).

        `points` has shape (..., 3), meters, in the map frame. Distances are to the cubes of voxels, or to their centers.
        More than the server takes at once are asked about in several requests (see `query`).

        Raises `InvalidArgument` (`bad_radius`, `point_not_finite`, `point_out_of_range`).
        """
        rows, shape = rows_of(points, 3, "points", POINTS, self._request_bytes_max)
        of_all = {
            "radius_m": number_of(radius_m, "radius_m"),
            "to": word_of(to, "to"),
            **asked(level, ignore_keep_outs, min_revision, map_uuid),
        }
        given = rows if len(rows) else STAND_IN

        def ask(part: Part) -> Nearest:
            arrays, of_part = Arrays(), given[part.of]
            answer = self._ask("nearest", {"points": arrays.add(of_part), **of_all}, arrays, part)
            count = len(of_part)
            if answer.head.whole("points") != count:
                raise BadAnswer(f"{answer.head.whole('points')} points were looked at, not {count}")
            return Nearest(
                Version.of(answer.head),
                answer.bits("found", count),
                answer.floats("distances_m", count),
                answer.voxels("voxels", count),
                answer.floats("away", count, 3),
                answer.names("keep_outs", count),
            )

        return self._in_parts(len(rows), rows.nbytes, shape, ask)
