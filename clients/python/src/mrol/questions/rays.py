"""What rays meet first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .._arguments import choice_of
from .._arrays import F32, Bools, number_of
from ..errors import ArgumentError
from ..version import InParts
from .backend import I32, Names
from .checks import UNKNOWNS, Unknown
from .group import QuestionGroup
from .occupancy import STAND_IN
from .scope import QUESTION, QuestionScope, Scope

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._transport.deadline import Deadline

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


class RayQuestions(QuestionGroup):
    """Rays."""

    @QUESTION.documented
    def cast_rays(
        self,
        origins: ArrayLike,
        directions: ArrayLike | None = None,
        *,
        range_m: float | None = None,
        ends: ArrayLike | None = None,
        unknown: Unknown = "free",
        **scope: Unpack[QuestionScope],
    ) -> Rays:
        """What each ray meets first: from origins along unit vectors, up to `range_m`, or to `ends`.

        `directions` or `ends` have shape (..., 3); `origins` the same, or (3,) for all rays. Map frame, meters. With
        `unknown="occupied"` a ray ends where no scan saw through.
        More than are taken at once are asked about in parts (see `query`).

        Raises `InvalidArgument` (`bad_ray`, `point_out_of_range`), naming which.
        """
        if (directions is None) == (ends is None):
            raise ArgumentError("directions", "both or neither of directions and ends", "the only one of them")
        name, towards = ("ends", ends) if directions is None else ("directions", directions)
        assert towards is not None
        rows, shape = self._rows(towards, 3, name, f"{name} x y z, shape (..., 3)")
        of_origins = "origins x y z, one for each ray or one of shape (3,) for all"
        starts, start_shape = self._rows(origins, 3, "origins", of_origins)
        if start_shape not in (shape, (), (1,)):
            raise ArgumentError("origins", f"shape {(*start_shape, 3)} for rays of shape {(*shape, 3)}", of_origins)
        fields = {
            "range_m": None if range_m is None else number_of(range_m, "range_m"),
            "unknown": choice_of(unknown, "unknown", UNKNOWNS),
        }
        has_own = len(starts) == len(rows)
        # Where there is no ray one along x from the origin stands in.
        given, begins = (rows, starts) if len(rows) else (AHEAD, STAND_IN)

        def ask(part: slice, options: Scope, deadline: Deadline | None) -> Rays:
            of_part = given[part]
            of_rays = {"origins": begins[part] if has_own else begins, name: of_part}
            answer = self._backend.ask("rays", {**of_rays, **fields}, options, deadline)
            count, hits = len(of_part), answer.head.whole("hits")
            answer.check_count("rays", count)
            return Rays(
                answer.version,
                answer.bits("hit", count, hits),
                hits,
                answer.floats("distances_m", count),
                answer.voxels("voxels", count),
                answer.names("keep_outs", count),
            )

        return self._in_parts(ask, QUESTION.checked(scope, "cast_rays"), len(rows), rows.nbytes + starts.nbytes, shape)
