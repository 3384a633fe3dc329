"""Whether points lie in occupied voxels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from .._arguments import choice_of, flag_of
from .._arrays import F32, Bools
from ..pose import Pose, PoseLike
from ..version import InParts
from .group import QuestionGroup
from .scope import LOOKUP, LookupScope, Scope

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._transport.deadline import Deadline

POINTS = "points x y z, an array of numbers of shape (..., 3)"

STAND_IN: F32 = np.zeros((1, 3), "<f4")
"""What is asked about where there is no point: all else is checked, and the version told."""

Lookup = Literal["exact", "bloom"]
LOOKUPS = get_args(Lookup)


@dataclass(frozen=True, eq=False)
class Occupancy(InParts):
    """Which points lie in occupied voxels.

    `occupied` has the shape of the points without their last axis; `count` says how many of them are occupied.
    """

    occupied: Bools
    count: int


class OccupancyQuestions(QuestionGroup):
    """Queries of points."""

    @LOOKUP.documented
    def query(
        self,
        points: ArrayLike,
        *,
        map_from_points: PoseLike | None = None,
        lookup: Lookup = "exact",
        keep_out: bool = False,
        **scope: Unpack[LookupScope],
    ) -> Occupancy:
        """Whether points lie in occupied voxels.

        `points` has shape (..., 3), meters, in the map frame, or in one that `map_from_points` carries into it. Contiguous
        float32 is taken as it is; other numbers are converted. `lookup="bloom"` asks the filter alone, which says "occupied" of
        about 2 % of the free points near a surface and never "free" of an occupied one; a replica without filters asks the exact
        set. With `keep_out` points in keep-outs count as occupied.

        Up to 2,000,000 points are answered at one revision, unless a server is set to fewer. More are asked about in parts,
        between which the map may change: `first_version` and `version` tell.

        Raises `InvalidArgument` for points that are not finite (`point_not_finite`) or out of range, naming the first.
        """
        rows, shape = self._rows(points, 3, "points", POINTS)
        pose = None if map_from_points is None else Pose.of(map_from_points, "map_from_points").seven()
        how = pose, choice_of(lookup, "lookup", LOOKUPS), flag_of(keep_out, "keep_out")
        given = rows if len(rows) else STAND_IN

        def ask(part: slice, options: Scope, deadline: Deadline | None) -> Occupancy:
            return Occupancy(*self._backend.query(given[part], how, options, deadline))

        return self._in_parts(ask, LOOKUP.checked(scope, "query"), len(rows), rows.nbytes, shape)
