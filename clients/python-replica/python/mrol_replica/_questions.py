"""The questions of planners, answered in this process. Arguments and answers are those of `mrol.Map`."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Union

import numpy as np
from mrol import (
    Body,
    Box,
    Classification,
    Clearances,
    Collisions,
    FirstHits,
    Motions,
    Nearest,
    Occupancy,
    OrientedBox,
    Pose,
    Rays,
    Sphere,
    Version,
)
from mrol._arrays import counts_of, number_of, rows_of, vector_of, whole_of
from mrol._question import Names
from mrol.body import BodyLike, ConfigurationsLike, configurations_of
from mrol.errors import ArgumentError, excerpt
from mrol.operations.checks import A_SPHERE, ONE, Told, Unknown, ignored_shapes, rows_of_groups, stand_in_poses
from mrol.operations.handle import flag_of
from mrol.operations.motions import lengths_of
from mrol.operations.nearest import MeasuredTo
from mrol.operations.occupancy import POINTS, STAND_IN, Lookup
from mrol.operations.parts import beginning_of
from mrol.operations.rays import AHEAD
from mrol.pose import PoseLike
from mrol.shapes import Shape
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._parts import answered

if TYPE_CHECKING:
    from types import TracebackType

BYTES_MAX = 1 << 34
"""Bytes of an array; what fits into the memory of this process is for it to know."""

_F32 = np.dtype("<f4")

LEVEL_MAX = (1 << 32) - 1
SECONDS_MAX = 1e9

Words = dict[str, tuple[str, ...]]
WORDS: Words = {
    "answer": ("colliding", "first_hit", "clearance"),
    "unknown": ("free", "occupied"),
    "lookup": ("exact", "bloom"),
    "to": ("cubes", "centers"),
}


class PreparedBody(_native.NativeBody):
    """A body that is made once and asked about often: a question about it copies nothing of it.

    It takes what `mrol.Body.of` takes. All questions take it in the place of a body; `motion_is_free` takes nothing else.
    """

    def __new__(cls, body: "BodyLike") -> "PreparedBody":
        links = []
        for number, link in enumerate(Body.of(body).links):
            name = f"body.links[{number}]"
            spheres, _ = rows_of(link.spheres, 4, f"{name}.spheres", "spheres x y z r, shape (n, 4)", BYTES_MAX)
            points, _ = rows_of(link.points, 3, f"{name}.points", "points x y z, shape (n, 3)", BYTES_MAX)
            links.append((spheres, points, number_of(link.padding_m, f"{name}.padding_m")))
        return super().__new__(cls, links)


AnyBody = Union[PreparedBody, BodyLike]


class Questions:
    """What can be asked of a map inside this process.

    Threads may share it: questions run beside each other, without the lock of the interpreter. It stays with the process that
    opened it; a child that was forked gets an error. Arrays may be changed again as soon as a call returns. More elements than
    2,000,000 are asked about in parts, between which a map may change: `first_version` and `version` of the answer tell.
    """

    def __init__(self, inside: _native.Questions) -> None:
        self._inside = inside
        self.motion_is_free = inside.motion_is_free
        """`motion_is_free(body, configurations, *, level=0, unknown_is_occupied=False, ignore_keep_outs=False)`: whether one
        motion is free, as a `bool`, for the innermost loop of a planner. `body` is a `PreparedBody`, `configurations` contiguous
        and aligned float32 with two or more rows of x y z qx qy qz qw for each link: nothing is converted, and anything else is
        refused."""

    def close(self) -> None:
        """Gives its memory back, once the last call that uses it returns. Every later call is an error."""
        self._inside.close()

    def __enter__(self) -> "Questions":
        return self

    def __exit__(
        self, kind: "type[BaseException] | None", value: "BaseException | None", traceback: "TracebackType | None"
    ) -> None:
        self.close()

    def __reduce__(self) -> "tuple[object, ...]":
        raise ArgumentError("the map", excerpt(self), "opened anew in each process")

    def query(
        self,
        points: ArrayLike,
        *,
        map_from_points: "PoseLike | None" = None,
        level: int = 0,
        lookup: Lookup = "exact",
        keep_out: bool = False,
    ) -> Occupancy:
        """Whether points lie in occupied voxels: see `mrol.Map.query`.

        `points` has shape (..., 3), meters. Of a replica without filters `lookup="bloom"` asks the exact set.
        """
        rows, shape = _points_of(points)
        pose = None if map_from_points is None else Pose.of(map_from_points, "map_from_points").seven()
        bloom = _word(lookup, "lookup") == "bloom"
        options = pose, _level(level), bloom, flag_of(keep_out, "keep_out")
        given = rows if len(rows) else STAND_IN

        def ask(part: slice) -> Occupancy:
            occupied, count, version = self._inside.query(given[part], *options)
            return Occupancy(version_of(version), occupied, count)

        return answered(len(rows), rows, shape, ask)

    def check_poses(
        self,
        body: AnyBody,
        configurations: ConfigurationsLike,
        *,
        answer: Told = "colliding",
        clearance_max_m: "float | None" = None,
        ignored: Sequence[Shape] = (),
        unknown: Unknown = "free",
        level: int = 0,
        ignore_keep_outs: bool = False,
    ) -> Collisions:
        """Whether a body fits at each of many configurations: see `mrol.Map.check_poses`."""
        native = _prepared(body)
        links = native.links
        rows, shape = configurations_of(configurations, links, "configurations", BYTES_MAX)
        options = (
            _word(answer, "answer"),
            None if clearance_max_m is None else number_of(clearance_max_m, "clearance_max_m"),
            _regions(ignored, "ignored"),
            _word(unknown, "unknown") == "occupied",
            _level(level),
            flag_of(ignore_keep_outs, "ignore_keep_outs"),
        )
        given = rows if len(rows) else stand_in_poses(links)

        def ask(part: slice) -> Collisions:
            return _collisions(self._inside.check_poses(native, given[part.start * links : part.stop * links], *options))

        return answered(len(rows) // links, rows, shape, ask)

    def check_spheres(
        self,
        spheres: ArrayLike,
        *,
        sizes: "ArrayLike | None" = None,
        padding_m: float = 0.0,
        answer: Told = "colliding",
        clearance_max_m: "float | None" = None,
        ignored: Sequence[Shape] = (),
        unknown: Unknown = "free",
        level: int = 0,
        ignore_keep_outs: bool = False,
    ) -> Collisions:
        """Whether spheres meet anything: see `mrol.Map.check_spheres`."""
        rows, shape = rows_of(spheres, 4, "spheres", "spheres x y z r, shape (..., 4)", BYTES_MAX)
        counts = np.ones(len(rows), np.uint32)
        if sizes is not None:
            counts = counts_of(sizes, "sizes")
            if int(counts.sum(dtype=np.uint64)) != len(rows):
                raise ArgumentError("sizes", f"a sum of {counts.sum(dtype=np.uint64)}", f"counts of all {len(rows)} spheres")
            shape = counts.shape
        options = (
            number_of(padding_m, "padding_m"),
            _word(answer, "answer"),
            None if clearance_max_m is None else number_of(clearance_max_m, "clearance_max_m"),
            _regions(ignored, "ignored"),
            _word(unknown, "unknown") == "occupied",
            _level(level),
            flag_of(ignore_keep_outs, "ignore_keep_outs"),
        )
        given, groups = (rows, counts) if len(counts) else (A_SPHERE, ONE)

        def ask(part: slice) -> Collisions:
            of_part, sizes_of_part = rows_of_groups(given, groups, part), groups[part]
            if len(of_part):
                return _collisions(self._inside.check_spheres(of_part, sizes_of_part, *options))
            # Groups of no sphere: one more, of one, since no question is taken without a sphere.
            more = np.concatenate([sizes_of_part, ONE])
            return beginning_of(_collisions(self._inside.check_spheres(A_SPHERE, more, *options)), len(sizes_of_part))

        return answered(len(counts), rows, shape, ask)

    def check_motions(
        self,
        body: AnyBody,
        configurations: ConfigurationsLike,
        *,
        lengths: "ArrayLike | None" = None,
        step_m: "float | None" = None,
        clearance_max_m: "float | None" = None,
        ignored: Sequence[Shape] = (),
        unknown: Unknown = "free",
        level: int = 0,
        ignore_keep_outs: bool = False,
    ) -> Motions:
        """Whether a body fits all along each of many motions: see `mrol.Map.check_motions`."""
        native = _prepared(body)
        rows, lead = configurations_of(configurations, native.links, "configurations", BYTES_MAX)
        counts, shape = lengths_of(lead, lengths)
        links = native.links
        options = (
            None if step_m is None else number_of(step_m, "step_m"),
            None if clearance_max_m is None else number_of(clearance_max_m, "clearance_max_m"),
            _regions(ignored, "ignored"),
            _word(unknown, "unknown") == "occupied",
            _level(level),
            flag_of(ignore_keep_outs, "ignore_keep_outs"),
        )
        given, lengths_given = (rows, counts) if len(counts) else (stand_in_poses(2 * links), 2 * ONE)

        def ask(part: slice) -> Motions:
            of_part = rows_of_groups(given, lengths_given, part, links)
            told = self._inside.check_motions(native, of_part, lengths_given[part], *options)
            free, count, first_hits, clearances_m, version = told
            return Motions(version_of(version), free, count, first_hits, clearances_m)

        return answered(len(counts), rows, shape, ask)

    def cast_rays(
        self,
        origins: ArrayLike,
        directions: "ArrayLike | None" = None,
        *,
        range_m: "float | None" = None,
        ends: "ArrayLike | None" = None,
        unknown: Unknown = "free",
        level: int = 0,
        ignore_keep_outs: bool = False,
    ) -> Rays:
        """What each ray meets first: see `mrol.Map.cast_rays`."""
        if (directions is None) == (ends is None):
            raise ArgumentError("directions", "both or neither of directions and ends", "the only one of them")
        name, towards = ("ends", ends) if directions is None else ("directions", directions)
        assert towards is not None
        rows, shape = rows_of(towards, 3, name, f"{name} x y z, shape (..., 3)", BYTES_MAX)
        of_origins = "origins x y z, one for each ray or one of shape (3,) for all"
        starts, start_shape = rows_of(origins, 3, "origins", of_origins, BYTES_MAX)
        if start_shape not in (shape, (), (1,)):
            raise ArgumentError("origins", f"shape {(*start_shape, 3)} for rays of shape {(*shape, 3)}", of_origins)
        options = (
            directions is None,
            None if range_m is None else number_of(range_m, "range_m"),
            _word(unknown, "unknown") == "occupied",
            _level(level),
            flag_of(ignore_keep_outs, "ignore_keep_outs"),
        )
        given, begins = (rows, starts) if len(rows) else (AHEAD, STAND_IN)
        has_own = len(starts) == len(rows)

        def ask(part: slice) -> Rays:
            towards_of_part = given[part]
            hit, count, distances_m, voxels, keep_outs, version = self._inside.cast_rays(
                begins[part] if has_own else begins, towards_of_part, *options
            )
            names = _names(keep_outs, len(towards_of_part))
            return Rays(version_of(version), hit, count, distances_m, voxels.reshape(-1, 3), names)

        return answered(len(rows), rows, shape, ask)

    def nearest(
        self,
        points: ArrayLike,
        radius_m: float,
        *,
        to: MeasuredTo = "cubes",
        level: int = 0,
        ignore_keep_outs: bool = False,
    ) -> Nearest:
        """The occupied voxel or the keep-out nearest to each point: see `mrol.Map.nearest`."""
        rows, shape = rows_of(points, 3, "points", POINTS, BYTES_MAX)
        options = (
            number_of(radius_m, "radius_m"),
            _word(to, "to") == "centers",
            _level(level),
            flag_of(ignore_keep_outs, "ignore_keep_outs"),
        )
        given = rows if len(rows) else STAND_IN

        def ask(part: slice) -> Nearest:
            of_part = given[part]
            found, distances_m, voxels, away, keep_outs, version = self._inside.nearest(of_part, *options)
            names = _names(keep_outs, len(of_part))
            return Nearest(version_of(version), found, distances_m, voxels.reshape(-1, 3), away.reshape(-1, 3), names)

        return answered(len(rows), rows, shape, ask)

    def classify(self, points: ArrayLike, *, level: int = 0, ignore_keep_outs: bool = False) -> Classification:
        """Whether points are occupied, free or unknown: see `mrol.Map.classify`."""
        rows, shape = rows_of(points, 3, "points", POINTS, BYTES_MAX)
        options = _level(level), flag_of(ignore_keep_outs, "ignore_keep_outs")
        given = rows if len(rows) else STAND_IN

        def ask(part: slice) -> Classification:
            occupied, free, version = self._inside.classify(given[part], *options)
            return Classification(version_of(version), occupied, free)

        return answered(len(rows), rows, shape, ask)


def region_of(shape: Shape, argument: str) -> tuple[str, list[float]]:
    """A region as the extension takes it: the word for its kind, and its numbers."""
    if isinstance(shape, Box):
        min_m, max_m = shape.corners(argument)
        return "box", [*min_m, *max_m]
    if isinstance(shape, Sphere):
        center_m = vector_of(shape.center_m, 3, f"{argument}.center_m")
        return "sphere", [*center_m, number_of(shape.radius_m, f"{argument}.radius_m")]
    if isinstance(shape, OrientedBox):
        pose = Pose.of(shape.map_from_box, f"{argument}.map_from_box").seven()
        return "oriented_box", [*pose, *vector_of(shape.size_m, 3, f"{argument}.size_m")]
    raise ArgumentError(argument, excerpt(shape), "a Box or a Sphere or an OrientedBox")


def seconds_of(value: float, argument: str) -> float:
    """A time that the extension's clocks can count."""
    seconds = number_of(value, argument)
    if not 0 <= seconds <= SECONDS_MAX:
        raise ArgumentError(argument, excerpt(value), f"seconds, 0 to {SECONDS_MAX:g}")
    return seconds


def version_of(version: "_native.Told") -> Version:
    """A version as `mrol` has it."""
    revision, uuid, content_hash = version
    return Version(revision, uuid, None if content_hash is None else int(content_hash, 16))


def _points_of(points: ArrayLike) -> tuple[NDArray[np.float32], tuple[int, ...]]:
    """Points as rows, and the shape in which they were given.

    What is that already goes a short way: `rows_of` takes as long as some hundred look-ups. Of fields of packed records, and of
    what begins at an odd byte, the extension makes a copy.
    """
    if type(points) is np.ndarray and points.dtype == _F32 and points.ndim == 2 and points.shape[1] == 3:
        return points, points.shape[:1]
    return rows_of(points, 3, "points", POINTS, BYTES_MAX)


def _prepared(body: AnyBody) -> PreparedBody:
    return body if isinstance(body, PreparedBody) else PreparedBody(body)


def _regions(shapes: Sequence[Shape], argument: str) -> list[tuple[str, list[float]]]:
    return [region_of(shape, f"{argument}[{number}]") for number, shape in enumerate(ignored_shapes(shapes))]


def _level(level: int) -> int:
    return whole_of(level, "level", 0, LEVEL_MAX)


def _word(word: str, argument: str) -> str:
    if not isinstance(word, str) or word not in WORDS[argument]:
        raise ArgumentError(argument, excerpt(word), " or ".join(map(repr, WORDS[argument])))
    return word


def _names(names: "list[str | None] | None", count: int) -> Names:
    found: NDArray[np.object_] = np.full(count, None, object)
    if names is not None:
        found[:] = names
    return found


def _collisions(told: "_native.Checked") -> Collisions:
    colliding, count, hits, room, version = told
    first_hits = clearances = None
    if hits is not None:
        links, parts, voxels, keep_outs = hits
        first_hits = FirstHits(links, parts, voxels.reshape(-1, 3), _names(keep_outs, len(links)))
    if room is not None:
        clearances = Clearances(*room)
    return Collisions(version_of(version), colliding, count, first_hits, clearances)
