"""What is known of points: occupied, free, or neither."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Bools, rows_of
from .._question import Arrays
from ..errors import BadAnswer
from ..version import InParts, Version
from .handle import MapHandle, asked
from .occupancy import POINTS, STAND_IN
from .parts import Part


@dataclass(frozen=True, eq=False)
class Classification(InParts):
    """What is known of each point. Arrays have the shape of the points without their last axis."""

    occupied: Bools
    """A scan put a point into its voxel, or a keep-out is there."""
    free: Bools
    """It is not occupied, and some scan saw beyond the voxel's center."""

    @property
    def unknown(self) -> Bools:
        """Neither: nobody has seen it."""
        return np.logical_not(np.logical_or(self.occupied, self.free))


class ClassificationOperations(MapHandle):
    """Classification of points."""

    def classify(
        self,
        points: ArrayLike,
        *,
        level: int = 0,
        ignore_keep_outs: bool = False,
        min_revision: int | None = None,
        map_uuid: str | None = None,
    ) -> Classification:
        """Whether points are occupied, free or unknown, by voxels of a level.

        `points` has shape (..., 3), meters, in the map frame.
        More than the server takes at once are asked about in several requests (see `query`).

        Raises `InvalidArgument` (`point_not_finite`, `point_out_of_range`).
        """
        rows, shape = rows_of(points, 3, "points", POINTS, self._request_bytes_max)
        of_all = asked(level, ignore_keep_outs, min_revision, map_uuid)
        given = rows if len(rows) else STAND_IN

        def ask(part: Part) -> Classification:
            arrays, of_part = Arrays(), given[part.of]
            answer = self._ask("classification", {"points": arrays.add(of_part), **of_all}, arrays, part)
            count = len(of_part)
            if answer.head.whole("points") != count:
                raise BadAnswer(f"{answer.head.whole('points')} points were classified, not {count}")
            occupied, free = (answer.bits(name, count) for name in ("occupied", "free"))
            return Classification(Version.of(answer.head), occupied, free)

        return self._in_parts(len(rows), rows.nbytes, shape, ask)
