"""What is known of points: occupied, free, or neither."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Bools
from ..version import InParts
from .group import QuestionGroup
from .occupancy import POINTS, STAND_IN
from .scope import QUESTION, QuestionScope, Scope

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._transport.deadline import Deadline


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


class ClassificationQuestions(QuestionGroup):
    """Classification of points."""

    @QUESTION.documented
    def classify(self, points: ArrayLike, **scope: Unpack[QuestionScope]) -> Classification:
        """Whether points are occupied, free or unknown, by voxels of a level.

        `points` has shape (..., 3), meters, in the map frame.
        More than are taken at once are asked about in parts (see `query`).

        Raises `InvalidArgument` (`point_not_finite`, `point_out_of_range`).
        """
        rows, shape = self._rows(points, 3, "points", POINTS)
        given = rows if len(rows) else STAND_IN

        def ask(part: slice, options: Scope, deadline: Deadline | None) -> Classification:
            of_part = given[part]
            answer = self._backend.ask("classification", {"points": of_part}, options, deadline)
            count = len(of_part)
            answer.check_count("points", count)
            return Classification(answer.version, answer.bits("occupied", count), answer.bits("free", count))

        return self._in_parts(ask, QUESTION.checked(scope, "classify"), len(rows), rows.nbytes, shape)
