"""Whether a body fits at poses, and whether spheres meet anything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from .._arguments import choice_of
from .._arrays import F32, U32, Bools, counts_of, number_of
from ..body import Body, BodyLike, ConfigurationsLike, configurations_of
from ..errors import ArgumentError, excerpt
from ..shapes import REGIONS, Shape, shape_json
from ..version import InParts
from .backend import I32, I64, Answer, Names
from .group import QuestionGroup
from .parts import beginning_of
from .scope import QUESTION, QuestionScope, Scope

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._transport.deadline import Deadline

Told = Literal["colliding", "first_hit", "clearance"]
Unknown = Literal["free", "occupied"]
ANSWERS, UNKNOWNS = get_args(Told), get_args(Unknown)

ONE: U32 = np.ones(1, "<u4")
A_SPHERE: F32 = np.array([[0, 0, 0, 0.01]], "<f4")
"""What is asked about where there is no sphere."""


@dataclass(frozen=True, eq=False)
class FirstHits:
    """What each configuration that collides meets first. Arrays have the shape of the configurations."""

    links: I64
    """The link of the body; -1 where nothing is met."""
    parts: I64
    """The sphere of the link or, after all spheres, the point; -1 where nothing is met."""
    voxels: I32
    """The voxel, indices i j k of the level, shape (..., 3): where a voxel is met."""
    keep_outs: Names
    """The name of the keep-out that is met in the place of a voxel, or None."""


@dataclass(frozen=True, eq=False)
class Clearances:
    """How much space is around each configuration. Arrays have the shape of the configurations."""

    clearances_m: F32
    """The distance to what is nearest, meters, `clearance_max_m` at most; 0 or less of what collides."""
    nearest_links: I64
    """The link that is nearest; -1 where nothing is within `clearance_max_m`."""


@dataclass(frozen=True, eq=False)
class Collisions(InParts):
    """Which configurations meet an occupied voxel or a keep-out.

    `colliding` has the shape of the configurations, `count` says how many of them collide. `first_hits` and `clearances` are there
    where they were asked for.
    """

    colliding: Bools
    count: int
    first_hits: FirstHits | None = None
    clearances: Clearances | None = None

    @property
    def fits(self) -> Bools:
        """The opposite of `colliding`."""
        return np.logical_not(self.colliding)


class CheckQuestions(QuestionGroup):
    """Checks of poses and spheres."""

    @QUESTION.documented
    def check_poses(
        self,
        body: BodyLike,
        configurations: ConfigurationsLike,
        *,
        answer: Told = "colliding",
        clearance_max_m: float | None = None,
        ignored: Sequence[Shape] = (),
        unknown: Unknown = "free",
        **scope: Unpack[QuestionScope],
    ) -> Collisions:
        """Whether a body fits at each of many configurations.

        `body` is a `Body`, or the spheres x y z r of one link, shape (n, 4). `configurations` are poses of its links in the map
        frame: shape (..., 4, 4), (..., 7) or, for a body that does not turn, (..., 3); with an axis for the links where there
        are several. `answer="first_hit"` tells what is met, `"clearance"` how far the nearest obstacle is, up to
        `clearance_max_m` (64 voxels at most). Voxels in `ignored` (`Box`, `Sphere`, `OrientedBox`) do not count. With
        `unknown="occupied"` voxels are met that no scan saw through.

        More configurations than are taken at once are asked about in parts (see `query`).

        Raises `InvalidArgument` (`bad_check`, `batch_too_large`, `point_out_of_range`), naming which.
        """
        checked = Body.of(body)
        links = len(checked.links)
        rows, shape = configurations_of(configurations, links, "configurations", self._backend.bytes_max)
        fields = {
            "body": self._backend.body_of(checked),
            **_check_of(answer, clearance_max_m),
            **obstacles_of(ignored, unknown),
        }
        given = rows if len(rows) else stand_in_poses(links)

        def ask(part: slice, options: Scope, deadline: Deadline | None) -> Collisions:
            of_part = given[part.start * links : part.stop * links]
            told = self._backend.ask("poses", {"configurations": of_part, **fields}, options, deadline)
            return _collisions(told, answer, len(of_part) // links)

        return self._in_parts(ask, QUESTION.checked(scope, "check_poses"), len(rows) // links, rows.nbytes, shape)

    @QUESTION.documented
    def check_spheres(
        self,
        spheres: ArrayLike,
        *,
        sizes: ArrayLike | None = None,
        padding_m: float = 0.0,
        answer: Told = "colliding",
        clearance_max_m: float | None = None,
        ignored: Sequence[Shape] = (),
        unknown: Unknown = "free",
        **scope: Unpack[QuestionScope],
    ) -> Collisions:
        """Whether `spheres` meet anything: x y z r in the map frame, meters, shape (..., 4).

        With `sizes` (shape (g,)) they are g groups of so many spheres each, and there is an answer for each group. `padding_m` is
        added to all radii. `answer`, `clearance_max_m`, `ignored` and `unknown` are as of `check_poses`.
        """
        rows, shape = self._rows(spheres, 4, "spheres", "spheres x y z r, shape (..., 4)")
        counts = np.ones(len(rows), np.dtype("<u4"))
        if sizes is not None:
            counts = counts_of(sizes, "sizes")
            if int(counts.sum(dtype=np.uint64)) != len(rows):
                raise ArgumentError("sizes", f"a sum of {counts.sum(dtype=np.uint64)}", f"counts of all {len(rows)} spheres")
            shape = counts.shape
        fields = {
            "padding_m": number_of(padding_m, "padding_m"),
            **_check_of(answer, clearance_max_m),
            **obstacles_of(ignored, unknown),
        }
        given, sizes_given = (rows, counts) if len(counts) else (A_SPHERE, ONE)

        def ask(part: slice, options: Scope, deadline: Deadline | None) -> Collisions:
            of_part, sizes_of_part = rows_of_groups(given, sizes_given, part), sizes_given[part]
            count = len(sizes_of_part)
            if not len(of_part):
                # Groups of no sphere: one more, of one, since no question is taken without a sphere.
                of_part, sizes_of_part = A_SPHERE, np.concatenate([sizes_of_part, ONE])
            of_spheres = {"spheres": of_part, "sizes": None if sizes is None else sizes_of_part}
            told = self._backend.ask("spheres", {**of_spheres, **fields}, options, deadline)
            found = _collisions(told, answer, len(sizes_of_part))
            return found if len(sizes_of_part) == count else beginning_of(found, count)

        return self._in_parts(ask, QUESTION.checked(scope, "check_spheres"), len(counts), rows.nbytes + counts.nbytes, shape)


def stand_in_poses(count: int) -> F32:
    """Poses that are asked about where there are none, x y z qx qy qz qw: all else is checked, and the version told."""
    poses = np.zeros((count, 7), np.dtype("<f4"))
    poses[:, 6] = 1
    return poses


def rows_of_groups(rows: F32, counts: U32, part: slice, rows_each: int = 1) -> F32:
    """The rows of a part of groups, each of so many rows, or of so many times as many."""
    if part.stop - part.start == len(counts):
        return rows
    begin, inside = (int(counts[of].sum(dtype=np.int64)) * rows_each for of in (slice(0, part.start), part))
    return rows[begin : begin + inside]


def obstacles_of(ignored: Sequence[Shape], unknown: str) -> dict[str, Any]:
    """What counts as an obstacle, as fields of a question."""
    shapes = [shape_json(shape, f"ignored[{number}]", REGIONS) for number, shape in enumerate(_ignored_shapes(ignored))]
    return {"ignored": shapes or None, "unknown": choice_of(unknown, "unknown", UNKNOWNS)}


def _ignored_shapes(ignored: object) -> Sequence[Any]:
    """The shapes of the argument `ignored`: a sequence of them, or one alone."""
    if isinstance(ignored, REGIONS):
        return [ignored]
    if not isinstance(ignored, tuple | list) and (not isinstance(ignored, Sequence) or isinstance(ignored, str | bytes)):
        raise ArgumentError("ignored", excerpt(ignored), "a sequence of Box, Sphere and OrientedBox")
    return ignored


def _check_of(answer: str, clearance_max_m: float | None) -> dict[str, Any]:
    return {
        "answer": choice_of(answer, "answer", ANSWERS),
        "clearance_max_m": None if clearance_max_m is None else number_of(clearance_max_m, "clearance_max_m"),
    }


def _collisions(answer: Answer, told: str, count: int) -> Collisions:
    answer.check_count("checked", count)
    hits = clearances = None
    if told == "first_hit":
        links = answer.numbers("hit_links", count)
        parts = np.where(links < 0, -1, answer.numbers("hit_parts", count))
        hits = FirstHits(links, parts, answer.voxels("hit_voxels", count), answer.names("hit_keep_outs", count))
    elif told == "clearance":
        clearances = Clearances(answer.floats("clearances_m", count), answer.numbers("nearest_links", count))
    colliding_count = answer.head.whole("colliding_count")
    return Collisions(answer.version, answer.bits("colliding", count, colliding_count), colliding_count, hits, clearances)
