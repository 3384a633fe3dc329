"""Whether a body can move along configurations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import F32, U32, Bools, counts_of, number_of
from ..body import Body, BodyLike, ConfigurationsLike, configurations_of
from ..errors import ArgumentError
from ..shapes import Shape
from ..version import InParts
from .checks import ONE, Unknown, obstacles_of, rows_of_groups, stand_in_poses
from .group import QuestionGroup
from .scope import QUESTION, QuestionScope, Scope

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._transport.deadline import Deadline


@dataclass(frozen=True, eq=False)
class Motions(InParts):
    """Which motions are free. Arrays have the shape in which the motions were given."""

    free: Bools
    count: int
    """How many are free."""
    first_hits: F32
    """The share of the motion, 0 to 1, at which something is met; NaN of one that is free."""
    clearances_m: F32 | None
    """The least distance to an obstacle along the way, meters, where `clearance_max_m` asked for it."""


class MotionQuestions(QuestionGroup):
    """Checks of motions."""

    @QUESTION.documented
    def check_motions(
        self,
        body: BodyLike,
        configurations: ConfigurationsLike,
        *,
        lengths: ArrayLike | None = None,
        step_m: float | None = None,
        clearance_max_m: float | None = None,
        ignored: Sequence[Shape] = (),
        unknown: Unknown = "free",
        **scope: Unpack[QuestionScope],
    ) -> Motions:
        """Whether a body fits all along each of many motions.

        `body` and `configurations` are as of `check_poses`, and the last axis of their shape runs along each motion: an array of
        shape (m, 2, 7) is m edges of one link. Motions of unequal lengths are one array of all configurations with `lengths`,
        shape (m,). Between two configurations a link moves along a line and turns the shorter way. The body is checked so often
        that no point of it moves by more than half a voxel, or by `step_m`, from one check to the next. `clearance_max_m` asks
        for the least distance to an obstacle as well. Voxels in `ignored` (`Box`, `Sphere`, `OrientedBox`) do not count. With
        `unknown="occupied"` voxels are met that no scan saw through. More than are taken at once are asked about in parts (see
        `query`).
        """
        checked = Body.of(body)
        links = len(checked.links)
        rows, lead = configurations_of(configurations, links, "configurations", self._backend.bytes_max)
        counts, shape = lengths_of(lead, lengths)
        fields = {
            "body": self._backend.body_of(checked),
            "step_m": None if step_m is None else number_of(step_m, "step_m"),
            "clearance_max_m": None if clearance_max_m is None else number_of(clearance_max_m, "clearance_max_m"),
            **obstacles_of(ignored, unknown),
        }
        given, lengths_given = (rows, counts) if len(counts) else (stand_in_poses(2 * links), 2 * ONE)

        def ask(part: slice, options: Scope, deadline: Deadline | None) -> Motions:
            of_part = lengths_given[part]
            of_motions = {"configurations": rows_of_groups(given, lengths_given, part, links), "lengths": of_part}
            answer = self._backend.ask("motions", {**of_motions, **fields}, options, deadline)
            count, free = len(of_part), answer.head.whole("free_count")
            answer.check_count("motions", count)
            clearances_m = answer.floats("clearances_m", count) if answer.head.has("clearances_m") else None
            return Motions(answer.version, answer.bits("free", count, free), free, answer.finite("first_hits", count), clearances_m)

        return self._in_parts(ask, QUESTION.checked(scope, "check_motions"), len(counts), rows.nbytes + counts.nbytes, shape)


def lengths_of(lead: tuple[int, ...], lengths: ArrayLike | None) -> tuple[U32, tuple[int, ...]]:
    """How many configurations each motion has, and the shape of the motions; of no configuration they are none."""
    if lengths is not None:
        counts = counts_of(lengths, "lengths")
        configurations = math.prod(lead)
        total = int(counts.sum(dtype=np.uint64))
        if total != configurations:
            raise ArgumentError("lengths", f"a sum of {total}", f"counts of all {configurations} configurations")
        return counts, counts.shape
    if not lead:
        raise ArgumentError("configurations", "one configuration", "motions of two configurations or more")
    if lead == (0,):
        return np.zeros(0, np.dtype("<u4")), lead
    shape = lead[:-1]
    return np.full(math.prod(shape), lead[-1], np.dtype("<u4")), shape
