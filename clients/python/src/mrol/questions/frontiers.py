"""Where free space ends and nothing is known beyond."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .._arrays import F64, number_of, whole_of
from .._fields import Fields
from ..pose import Pose, pose_in
from ..shapes import Box, BoxLike
from ..version import Versioned
from .group import QuestionGroup
from .scope import QUESTION, QuestionScope

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(frozen=True, eq=False)
class FrontierView:
    """A place from which a line to a frontier runs through free voxels alone. Nothing says that a robot can stand there."""

    map_from_view: Pose
    """Where to look from, x forward."""
    target_m: F64
    """What to look at, shape (3,)."""
    yaw_rad: float
    elevation_rad: float


@dataclass(frozen=True, eq=False)
class Frontier:
    """A cluster of free voxels beside unknown ones."""

    voxels: int
    """How many there are."""
    center_m: F64
    """Their center, shape (3,)."""
    min_m: F64
    max_m: F64
    view: FrontierView | None


@dataclass(frozen=True, eq=False)
class Frontiers(Versioned):
    """The frontiers of a box, the largest first."""

    frontiers: tuple[Frontier, ...]
    frontiers_total: int
    """How many there are, told or not."""
    voxels_total: int
    """How many voxels they have."""


class FrontierQuestions(QuestionGroup):
    """Frontiers."""

    @QUESTION.documented
    def frontiers(
        self,
        box: BoxLike,
        *,
        size_min: int | None = None,
        frontiers_max: int | None = None,
        standoff_m: float | None = None,
        **scope: Unpack[QuestionScope],
    ) -> Frontiers:
        """Free voxels beside unknown ones in a box, in clusters of `size_min` (8) voxels or more, `frontiers_max` (100) of them.

        `box` is a `Box`, or its two corners, shape (2, 3). `standoff_m` is how far from a frontier its view is (20 voxels).

        Raises `ResourceExhausted` (`frontier_box_too_large`: take a coarser level), `InvalidArgument` (`bad_frontiers`,
        `point_out_of_range`).
        """
        min_m, max_m = Box.of(box).corners()
        fields = {
            "box": {
                "min_m": [number_of(x, "box.min_m") for x in min_m],
                "max_m": [number_of(x, "box.max_m") for x in max_m],
            },
            "size_min": None if size_min is None else whole_of(size_min, "size_min"),
            "frontiers_max": None if frontiers_max is None else whole_of(frontiers_max, "frontiers_max", 0, (1 << 32) - 1),
            "standoff_m": None if standoff_m is None else number_of(standoff_m, "standoff_m"),
        }
        answer = self._backend.ask("frontiers", fields, QUESTION.checked(scope, "frontiers"))
        head = answer.head
        frontiers = tuple(_frontier(of) for of in head.objects("frontiers"))
        return Frontiers(answer.version, frontiers, head.whole("frontiers_total"), head.whole("voxels_total"))


def _frontier(fields: Fields) -> Frontier:
    view = fields.object("view") if fields.has("view") else None
    return Frontier(
        voxels=fields.whole("voxels"),
        center_m=fields.numbers("center_m", (3,)),
        min_m=fields.numbers("min_m", (3,)),
        max_m=fields.numbers("max_m", (3,)),
        view=None if view is None else _view(view),
    )


def _view(fields: Fields) -> FrontierView:
    return FrontierView(
        pose_in(fields, "map_from_view"),
        fields.numbers("target_m", (3,)),
        fields.number("yaw_rad"),
        fields.number("elevation_rad"),
    )
