"""Whether a body can move along configurations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import F32, U32, Bools, counts_of, number_of
from .._question import Arrays, QuestionAnswer
from ..body import Body, BodyLike, ConfigurationsLike, configurations_of
from ..errors import ArgumentError, BadAnswer
from ..shapes import Shape
from ..version import InParts, Version
from .checks import ONE, Unknown, obstacles_of, rows_of_groups, stand_in_poses
from .handle import MapHandle, asked
from .parts import Part


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


class MotionOperations(MapHandle):
    """Checks of motions."""

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
        level: int = 0,
        ignore_keep_outs: bool = False,
        min_revision: int | None = None,
        map_uuid: str | None = None,
    ) -> Motions:
        """Whether a body fits all along each of many motions.

        Configurations are as of `check_poses`, and the last axis of their shape runs along each motion: an array of shape
        (m, 2, 7) is m edges of one link. Motions of unequal lengths are one array of all configurations with `lengths`, shape (m,).
        Between two configurations a link moves along a line and turns the shorter way. The body is checked so often that no
        point of it moves by more than half a voxel, or by `step_m`, from one check to the next. `clearance_max_m` asks for the
        least distance to an obstacle as well. The other arguments are those of `check_poses`.
        More than the server takes at once are asked about in several requests (see `query`).
        """
        checked = Body.of(body)
        links = len(checked.links)
        rows, lead = configurations_of(configurations, links, "configurations", self._request_bytes_max)
        counts, shape = lengths_of(lead, lengths)
        of_all = {
            "step_m": None if step_m is None else number_of(step_m, "step_m"),
            "clearance_max_m": None if clearance_max_m is None else number_of(clearance_max_m, "clearance_max_m"),
            **obstacles_of(ignored, unknown),
            **asked(level, ignore_keep_outs, min_revision, map_uuid),
        }
        given, lengths_given = (rows, counts) if len(counts) else (stand_in_poses(2 * links), 2 * ONE)

        def ask(part: Part) -> Motions:
            arrays, of_part = Arrays(), lengths_given[part.of]
            head = {
                "body": checked.json(arrays, self._request_bytes_max),
                "configurations": arrays.add(rows_of_groups(given, lengths_given, part.of, links)),
                "lengths": arrays.add(of_part),
                **of_all,
            }
            return _motions(self._ask("motions", head, arrays, part), len(of_part))

        return self._in_parts(len(counts), rows.nbytes + counts.nbytes, shape, ask)


def _motions(answer: QuestionAnswer, count: int) -> Motions:
    if answer.head.whole("motions") != count:
        raise BadAnswer(f"{answer.head.whole('motions')} motions were checked, not {count}")
    first_hits = answer.floats("first_hits", count)
    free = answer.head.whole("free_count")
    return Motions(
        Version.of(answer.head),
        answer.bits("free", count, free),
        free,
        np.where(np.isfinite(first_hits), first_hits, np.float32(np.nan)),
        answer.floats("clearances_m", count) if answer.head.has("clearances_m") else None,
    )


def lengths_of(lead: tuple[int, ...], lengths: ArrayLike | None) -> tuple[U32, tuple[int, ...]]:
    """How many configurations each motion has, and the shape of the motions; of no configuration they are none."""
    if lengths is not None:
        counts = counts_of(lengths, "lengths")
        configurations = int(np.prod(lead, dtype=np.int64))
        total = int(counts.sum(dtype=np.uint64))
        if total != configurations:
            raise ArgumentError("lengths", f"a sum of {total}", f"counts of all {configurations} configurations")
        return counts, counts.shape
    if not lead:
        raise ArgumentError("configurations", "one configuration", "motions of two configurations or more")
    if lead == (0,):
        return np.zeros(0, np.dtype("<u4")), lead
    shape = lead[:-1]
    return np.full(int(np.prod(shape, dtype=np.int64)), lead[-1], np.dtype("<u4")), shape
