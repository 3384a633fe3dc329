"""A map without a server."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arguments import flag_of, text_of
from .._arrays import as_floats, as_numbers, number_of, rows_of, vector_of, whole_of
from .._files import File, open_regular, path_of_file, replacing
from ..errors import ArgumentError, excerpt
from ..operations.deletions import Deletion
from ..operations.localization import Candidate, Localization
from ..operations.scans import Method, OpenDirection, RayAgreement, RayCounts, Rival, ScanAnswer
from ..operations.voxels import Voxels
from ..pose import Pose, PoseLike
from ..questions.occupancy import POINTS
from ..shapes import REGIONS, Box, BoxLike, OrientedBox, Shape, shape_json
from ..version import Version
from .body import BYTES_MAX
from .clock import seconds_of
from .in_process import InProcessMap
from .native import mrol_native

ROBOT = "python"
"""The robot of scans whose robot is not given."""

LEVELS = 6

TIMES = "one time in seconds for each point, shape (n,)"


class LocalMap(InProcessMap):
    """A map in this process, without any server: what a server does with a scan or a question, this does, by the same code.

    `resolution` is the side of a voxel, meters; `levels` halve it each. Maps that are only asked need no `bloom` (the filter in
    front of each level) and no `moments` (which alignments are refined on). It lives in memory; `save` and `load` keep it as a
    map file, which a server restores and downloads.

        m = LocalMap(resolution=0.05)
        for points in scans:
            answer = m.insert(points)          # aligned from the last pose, and added where it fits
            print(answer.accepted, answer.map_from_sensor.translation_m)
        m.save("floor1.mrol")
    """

    def __init__(self, resolution: float, *, levels: int = LEVELS, bloom: bool = True, moments: bool = True) -> None:
        side_m, count = number_of(resolution, "resolution"), whole_of(levels, "levels", 0, (1 << 32) - 1)
        self._take(mrol_native.NativeLocalMap(side_m, count, flag_of(bloom, "bloom"), flag_of(moments, "moments")))

    @classmethod
    def load(cls, file: File) -> LocalMap:
        """The map of a map file.

        Raises `InvalidArgument` for what is none, and `OSError` where it cannot be read: of pipes and devices too, which may have
        no end.
        """
        with open_regular(path_of_file(file, "file")) as opened:
            whole = opened.read() or b""
        loaded = cls.__new__(cls)
        loaded._take(mrol_native.NativeLocalMap.of_file(whole))  # noqa: SLF001
        return loaded

    def save(self, file: File) -> None:
        """Writes the map as a map file, which is on the disk when the call returns.

        A file that is there is replaced, whole or not at all, and its mode and owner stay. Of a symbolic link that is replaced
        which it leads to.
        """
        path = path_of_file(file, "file")
        whole = self._made.to_file()
        with replacing(path, "file") as written:
            written.write(whole)

    def _take(self, made: mrol_native.NativeLocalMap) -> None:
        super().__init__(made)
        self._made = made

    def insert(
        self,
        points: ArrayLike,
        *,
        guess: PoseLike | None = None,
        motion: PoseLike | None = None,
        constant_velocity: bool = False,
        align: bool = True,
        robot: str = ROBOT,
        timestamp_ns: int | None = None,
        point_times: ArrayLike | None = None,
        point_times_from_sweep_start: bool = False,
        gravity_in_sensor: ArrayLike | None = None,
        guess_covariance: ArrayLike | None = None,
        recover: bool | None = None,
        carve: bool | None = None,
        force: bool = False,
        method: Method | None = None,
        range_min_m: float | None = None,
        range_max_m: float | None = None,
        body_m: BoxLike | None = None,
        sensor: str | None = None,
        strict: bool = False,
    ) -> ScanAnswer:
        """Aligns a scan and adds it where it fits: see `mrol.Map.insert`. A scan that does not fit is an answer."""
        fields = _fields(locals(), foreground_level=None)
        return self._map_scan(points, fields, is_inserted=True)

    def align(
        self,
        points: ArrayLike,
        *,
        guess: PoseLike | None = None,
        motion: PoseLike | None = None,
        constant_velocity: bool = False,
        robot: str = ROBOT,
        timestamp_ns: int | None = None,
        point_times: ArrayLike | None = None,
        point_times_from_sweep_start: bool = False,
        gravity_in_sensor: ArrayLike | None = None,
        guess_covariance: ArrayLike | None = None,
        method: Method | None = None,
        range_min_m: float | None = None,
        range_max_m: float | None = None,
        body_m: BoxLike | None = None,
        sensor: str | None = None,
        strict: bool = False,
        foreground_level: int | None = None,
    ) -> ScanAnswer:
        """What inserting a scan would do; the map stays as it is: see `mrol.Map.align`."""
        fields = _fields(locals(), align=True, recover=None, carve=None, force=False)
        return self._map_scan(points, fields, is_inserted=False)

    def localize(
        self,
        points: ArrayLike,
        *,
        gravity_in_sensor: ArrayLike | None = None,
        gravity_in_map: ArrayLike | None = None,
        search_box: BoxLike | None = None,
        time_limit_s: float | None = None,
        candidates: int | None = None,
        seed: int = 0,
    ) -> Localization:
        """Searches all poses for the one from which a scan was taken: see `mrol.Map.localize`."""
        rows, _ = rows_of(points, 3, "points", POINTS, BYTES_MAX)
        if gravity_in_map is not None and gravity_in_sensor is None:
            raise ArgumentError("gravity_in_map", "no gravity_in_sensor", "given with gravity_in_sensor")
        found = self._made.localize(
            rows,
            None if gravity_in_sensor is None else vector_of(gravity_in_sensor, 3, "gravity_in_sensor", is_finite=True),
            None if gravity_in_map is None else vector_of(gravity_in_map, 3, "gravity_in_map", is_finite=True),
            None if search_box is None else Box.of(search_box, "search_box").corners("search_box"),
            None if time_limit_s is None else seconds_of(time_limit_s, "time_limit_s"),
            0 if candidates is None else whole_of(candidates, "candidates", 1, (1 << 32) - 1),
            whole_of(seed, "seed"),
        )
        of_place = [
            Candidate(Pose.of(pose), overlap, inliers, None if sides is None else _rays(sides))
            for pose, overlap, inliers, sides in found.pop("candidates")
        ]
        rivals = tuple(_rival(*of) for of in found.pop("rivals"))
        accepted = found["verdict"] == "accepted"
        version = Version(*found.pop("version"))
        return Localization(version=version, accepted=accepted, candidates=tuple(of_place), rivals=rivals, **found)

    def voxels(self, level: int = 0, *, box: BoxLike | OrientedBox | None = None) -> Voxels:
        """The occupied voxels of a level: all, or those with their centers in a box: see `mrol.Map.voxels`."""
        number = whole_of(level, "level", 0, (1 << 32) - 1)
        region = None
        if box is not None:
            region = shape_json(box if isinstance(box, OrientedBox) else Box.of(box, "box"), "box", REGIONS)
        indices, resolution_m, version = self._made.voxels(number, region)
        return Voxels(Version(*version), indices, number, resolution_m)

    def delete(self, shape: Shape, *, level: int = 0) -> Deletion:
        """Deletes the voxels of a level whose centers lie in a `Box`, a `Sphere` or an `OrientedBox`, with all below them."""
        removed, version = self._made.delete(shape_json(shape, "shape", REGIONS), whole_of(level, "level", 0, (1 << 32) - 1))
        return Deletion(Version(*version), removed, False)

    def _map_scan(self, points: ArrayLike, fields: dict[str, Any], *, is_inserted: bool) -> ScanAnswer:
        rows, shape = rows_of(points, 3, "points", POINTS, BYTES_MAX)
        robot = fields["robot"]
        told = self._made.map_scan(rows, fields, is_inserted)
        information, foreground = told["information"], told["foreground"]
        told |= {
            "version": Version(*told["version"]),
            "map_from_sensor": Pose.of(told["map_from_sensor"]),
            "level_overlaps": np.array(told["level_overlaps"]),
            "information": None if information is None else np.array(information),
            "undetermined": tuple(OpenDirection(np.array(direction), std_m) for direction, std_m in told["undetermined"]),
            "rays": None if told["rays"] is None else _rays(told["rays"]),
            "rivals": tuple(_rival(*of) for of in told["rivals"]),
            "foreground": None if foreground is None else foreground.reshape(shape),
        }
        return ScanAnswer(replayed=False, robot=robot, session="", scan_id=None, **told)

    def __repr__(self) -> str:
        return "<mrol map of this process>"


def _rays(sides: list[list[int]]) -> RayAgreement:
    of_scan, of_map = (RayCounts(*side) for side in sides)
    return RayAgreement(of_scan, of_map)


def _rival(pose: list[float], sides: list[list[int]]) -> Rival:
    return Rival(Pose.of(pose), _rays(sides))


def _fields(given: dict[str, Any], **fixed: Any) -> dict[str, Any]:
    """The arguments of a scan as the extension takes them."""
    given = {name: value for name, value in given.items() if name not in ("self", "points")} | fixed
    for name, value in given.items():
        if value is not None or name in REQUIRED:
            given[name] = TAKEN_AS[name](value, name)
    if sum((given["guess"] is not None, given["motion"] is not None, given["constant_velocity"])) > 1:
        raise ArgumentError("guess", "several of guess, motion and constant_velocity", "the only one of them")
    method = given.pop("method")
    return {**given, "overlap_alone": None if method is None else method == "overlap"}


def _method(value: object, argument: str) -> str:
    if not isinstance(value, str) or value not in ("refined", "overlap"):
        raise ArgumentError(argument, excerpt(value), "'refined' or 'overlap'")
    return value


def _times(value: ArrayLike, argument: str) -> NDArray[np.float32]:
    return as_floats(as_numbers(value, argument, TIMES), argument, TIMES, BYTES_MAX).reshape(-1)


def _covariance(value: ArrayLike, argument: str) -> list[float]:
    expected = "numbers of shape (6, 6): x y z in meters, then turns in radians"
    covariance = as_numbers(value, argument, expected)
    if covariance.shape not in ((6, 6), (36,)):
        raise ArgumentError(argument, f"shape {covariance.shape}", expected)
    return vector_of(covariance.reshape(36), 36, argument, is_finite=True)


REQUIRED = {"robot", "constant_velocity", "align", "point_times_from_sweep_start", "force", "strict"}
"""What has no value that stands for none."""

TAKEN_AS: dict[str, Callable[[Any, str], Any]] = {
    "robot": text_of,
    "guess": lambda value, name: Pose.of(value, name).seven(),
    "motion": lambda value, name: Pose.of(value, name).seven(),
    "constant_velocity": flag_of,
    "align": flag_of,
    "timestamp_ns": lambda value, name: whole_of(value, name, -(1 << 63), (1 << 63) - 1),
    "point_times": _times,
    "point_times_from_sweep_start": flag_of,
    "gravity_in_sensor": lambda value, name: vector_of(value, 3, name, is_finite=True),
    "guess_covariance": _covariance,
    "recover": flag_of,
    "carve": flag_of,
    "force": flag_of,
    "method": _method,
    "range_min_m": number_of,
    "range_max_m": number_of,
    "body_m": lambda value, name: Box.of(value, name).corners(name),
    "sensor": text_of,
    "strict": flag_of,
    "foreground_level": lambda value, name: whole_of(value, name, 0, (1 << 32) - 1),
}
"""How each argument of a scan is taken, by its name."""
