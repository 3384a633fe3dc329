"""The nearest occupied voxel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

from numpy.typing import ArrayLike

from .._arguments import choice_of
from .._arrays import F32, Bools, number_of
from ..version import InParts
from .backend import I32, Names
from .group import QuestionGroup
from .occupancy import POINTS, STAND_IN
from .scope import QUESTION, QuestionScope, Scope

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._transport.deadline import Deadline

MeasuredTo = Literal["cubes", "centers"]
ENDS = get_args(MeasuredTo)


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


class NearestQuestions(QuestionGroup):
    """Searches for the nearest voxel."""

    @QUESTION.documented
    def nearest(
        self,
        points: ArrayLike,
        radius_m: float,
        *,
        to: MeasuredTo = "cubes",
        **scope: Unpack[QuestionScope],
    ) -> Nearest:
        """The occupied voxel or the keep-out nearest to each point, within `radius_m` (64 voxels of the level at most).

        `points` has shape (..., 3), meters, in the map frame. Distances are to the cubes of voxels, or with
        `to="centers"` to their centers.
        More than are taken at once are asked about in parts (see `query`).

        Raises `InvalidArgument` (`bad_radius`, `point_not_finite`, `point_out_of_range`).
        """
        rows, shape = self._rows(points, 3, "points", POINTS)
        fields = {"radius_m": number_of(radius_m, "radius_m"), "to": choice_of(to, "to", ENDS)}
        given = rows if len(rows) else STAND_IN

        def ask(part: slice, options: Scope, deadline: Deadline | None) -> Nearest:
            of_part = given[part]
            answer = self._backend.ask("nearest", {"points": of_part, **fields}, options, deadline)
            count = len(of_part)
            answer.check_count("points", count)
            return Nearest(
                answer.version,
                answer.bits("found", count),
                answer.floats("distances_m", count),
                answer.voxels("voxels", count),
                answer.floats("away", count, 3),
                answer.names("keep_outs", count),
            )

        return self._in_parts(ask, QUESTION.checked(scope, "nearest"), len(rows), rows.nbytes, shape)
