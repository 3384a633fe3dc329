"""Whether a body fits at poses, and whether spheres meet anything."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import F32, Bools, counts_of, number_of, rows_of
from .._question import I32, Arrays, Names, QuestionAnswer
from ..body import Body, BodyLike, ConfigurationsLike, configurations_of
from ..errors import ArgumentError, BadAnswer, excerpt
from ..shapes import Box, OrientedBox, Shape, Sphere, shape_json
from ..version import Version, Versioned
from .handle import MapHandle, asked, word_of

Told = Literal["colliding", "first_hit", "clearance"]
Unknown = Literal["free", "occupied"]

I64 = NDArray[np.int64]


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
class Collisions(Versioned):
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


class CheckOperations(MapHandle):
    """Checks of poses and spheres."""

    def check_poses(
        self,
        body: BodyLike,
        configurations: ConfigurationsLike,
        *,
        answer: Told = "colliding",
        clearance_max_m: float | None = None,
        ignored: Sequence[Shape] = (),
        unknown: Unknown = "free",
        level: int = 0,
        ignore_keep_outs: bool = False,
        min_revision: int | None = None,
        map_uuid: str | None = None,
    ) -> Collisions:
        """Whether a body fits at each of many configurations.

        `body` is a `Body`, or the spheres x y z r of one link, shape (n, 4). Configurations are poses of its links in the map
        frame: shape (..., 4, 4), (..., 7) or, for a body that does not turn, (..., 3); with an axis for the links where there
        are several. `answer="first_hit"` tells what is met, `"clearance"` how far the nearest obstacle is, up to
        `clearance_max_m` (64 voxels at most). Voxels in `ignored` (`Box`, `Sphere`, `OrientedBox`) do not count. With
        `unknown="occupied"` voxels are met that no scan saw through.

        Raises `InvalidArgument` (`bad_check`, `batch_too_large`, `point_out_of_range`), naming which.
        """
        arrays = Arrays()
        checked = Body.of(body)
        rows, shape = configurations_of(configurations, len(checked.links), "configurations", self._request_bytes_max)
        head = {
            "body": checked.json(arrays, self._request_bytes_max),
            "configurations": arrays.add(rows),
            **_check_of(answer, clearance_max_m),
            **obstacles_of(ignored, unknown),
            **asked(level, ignore_keep_outs, min_revision, map_uuid),
        }
        return _collisions(self._ask("poses", head, arrays), answer, shape)

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
        level: int = 0,
        ignore_keep_outs: bool = False,
        min_revision: int | None = None,
        map_uuid: str | None = None,
    ) -> Collisions:
        """Whether spheres meet anything: x y z r in the map frame, meters, shape (..., 4).

        With `sizes` (shape (g,)) they are g groups of so many spheres each, and there is an answer for each group. The other
        arguments are those of `check_poses`.
        """
        arrays = Arrays()
        rows, shape = rows_of(spheres, 4, "spheres", "spheres x y z r, shape (..., 4)", self._request_bytes_max)
        head: dict[str, Any] = {"spheres": arrays.add(rows), "padding_m": number_of(padding_m, "padding_m")}
        if sizes is not None:
            counts = counts_of(sizes, "sizes")
            if int(counts.sum(dtype=np.uint64)) != len(rows):
                raise ArgumentError("sizes", f"a sum of {counts.sum(dtype=np.uint64)}", f"counts of all {len(rows)} spheres")
            head["sizes"], shape = arrays.add(counts), counts.shape
        head |= {
            **_check_of(answer, clearance_max_m),
            **obstacles_of(ignored, unknown),
            **asked(level, ignore_keep_outs, min_revision, map_uuid),
        }
        return _collisions(self._ask("spheres", head, arrays), answer, shape)


def obstacles_of(ignored: Sequence[Shape], unknown: str) -> dict[str, Any]:
    """What counts as an obstacle, as the head of a question has it."""
    kinds = (Box, Sphere, OrientedBox)
    kinds = (Box, Sphere, OrientedBox)
    shapes = [shape_json(shape, f"ignored[{number}]", kinds) for number, shape in enumerate(ignored_shapes(ignored))]
    return {"ignored": shapes or None, "unknown": word_of(unknown, "unknown")}


def ignored_shapes(ignored: object) -> Sequence[Any]:
    """The shapes of the argument `ignored`: a sequence of them, or one alone."""
    if isinstance(ignored, Box | Sphere | OrientedBox):
        return [ignored]
    if not isinstance(ignored, Sequence) or isinstance(ignored, str | bytes):
        raise ArgumentError("ignored", excerpt(ignored), "a sequence of Box, Sphere and OrientedBox")
    return ignored


def _check_of(answer: str, clearance_max_m: float | None) -> dict[str, Any]:
    return {
        "answer": word_of(answer, "answer"),
        "clearance_max_m": None if clearance_max_m is None else number_of(clearance_max_m, "clearance_max_m"),
    }


def _collisions(answer: QuestionAnswer, told: str, shape: tuple[int, ...]) -> Collisions:
    count = int(np.prod(shape, dtype=np.int64))
    head = answer.head
    if head.whole("checked") != count:
        raise BadAnswer(f"{head.whole('checked')} configurations were checked, not {count}")
    hits = clearances = None
    if told == "first_hit":
        links = answer.numbers("hit_links", count)
        parts = np.where(links < 0, -1, answer.numbers("hit_parts", count))
        hits = FirstHits(
            links.reshape(shape),
            parts.reshape(shape),
            answer.voxels("hit_voxels", count).reshape(*shape, 3),
            answer.names("hit_keep_outs", count).reshape(shape),
        )
    elif told == "clearance":
        clearances = Clearances(
            answer.floats("clearances_m", count).reshape(shape), answer.numbers("nearest_links", count).reshape(shape)
        )
    colliding_count = head.whole("colliding_count")
    colliding = answer.bits("colliding", count, colliding_count).reshape(shape)
    return Collisions(Version.of(head), colliding, colliding_count, hits, clearances)
