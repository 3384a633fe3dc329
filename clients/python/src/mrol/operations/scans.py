"""Scans: aligned, and added to the map where they fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._arguments import flag_of, level_of, text_of, word_of
from .._arrays import F64, Bools, as_floats, as_numbers, number_of, numbers_text, raw, rows_of, vector_of, whole_of
from .._fields import Fields, fields_of, reading
from .._option_docs import documents
from .._transport.request import Answer, Parameter
from ..errors import ArgumentError, MrolError, is_outcome_unknown
from ..pose import Pose, PoseLike, pose_in
from ..questions.occupancy import POINTS
from ..shapes import Box, BoxLike
from ..version import Version, Versioned
from .handle import MapHandle
from .scan_options import SCAN_OPTIONS

Method = Literal["refined", "overlap"]

TIMES = "one time in seconds for each point, shape (n,)"


@dataclass(frozen=True, eq=False)
class OpenDirection:
    """A direction of a pose that the map leaves open.

    `direction` has six numbers: x y z along the map's axes, then turns about them, each times the root mean square range of the
    scan. `std_m` is the standard deviation along it, meters; infinite where nothing holds the pose.
    """

    direction: F64
    std_m: float


@dataclass(frozen=True)
class RayCounts:
    """What rays of one side say of a pose."""

    asked: int
    """Points that were looked for."""
    agree: int
    """Those where the other side met something, too."""
    contradicted: int
    """Those through which the other side saw."""

    @property
    def share(self) -> float:
        """The share of points that agree, of those of which anything is known."""
        return self.agree / max(1, self.agree + self.contradicted)

    @property
    def evidence(self) -> float:
        """The share of points that agree, of all."""
        return self.agree / max(1, self.asked)


@dataclass(frozen=True)
class RayAgreement:
    """How the rays of a scan at a pose and those of earlier scans agree."""

    of_scan: RayCounts
    """The scan's points, in what earlier scans saw."""
    of_map: RayCounts
    """What earlier scans met, in what the scan saw."""


@dataclass(frozen=True)
class Rival:
    """A pose that a scan may have been taken at as well."""

    map_from_sensor: Pose
    rays: RayAgreement


@dataclass(frozen=True, eq=False)
class ScanAnswer(Versioned):
    """What became of a scan. One that does not fit is an answer: `accepted` is False, and the map is untouched."""

    accepted: bool
    """Whether it fits and was added, or would be."""
    verdict: str
    """`accepted`, `low_overlap`, `undetermined`, `ambiguous` or `contradicted`."""
    reason: str
    """Why, in a sentence with figures."""
    map_from_sensor: Pose
    """Where it was found."""
    overlap: float
    """The share of its points that fall in occupied voxels of level 0, before it is added."""
    level_overlaps: F64
    """The same at each level, finest first."""
    inliers: float
    """The share of a sample of its points that lie on the map's surfaces."""
    fitness: float
    """How closely they do, 0 to 1."""
    information: F64 | None
    """The inverse covariance of the pose, shape (6, 6): x y z in meters, then turns in radians. None in a replayed answer."""
    undetermined: tuple[OpenDirection, ...]
    """Directions that the map leaves open."""
    rays: RayAgreement | None
    """How rays agree at the pose. None where the caller told it, and in a replayed answer."""
    rivals: tuple[Rival, ...]
    """Poses that it may have been taken at as well: why it is ambiguous."""
    iterations: int
    """Steps that moved the pose."""
    align_ms: float
    """The time of the alignment."""
    new_voxels: int
    """Voxels of level 0 that it added."""
    carved_voxels: int
    """Voxels of level 0 that it saw through and took out."""
    points_skipped: int
    """Points not finite, out of range, or on the robot's body."""
    replayed: bool
    """Whether it was accepted before under its id; this is that answer."""
    stationary: bool
    """Whether the robot stands and sees nothing new: accepted, and not kept."""
    recovered: str | None
    """How the robot, which was lost, was found again."""
    foreground: Bools | None
    """Of an alignment that asked: which points fall in no occupied voxel, in the shape of the points."""
    robot: str
    """The robot in whose name it was sent."""
    session: str
    """The session of its id."""
    scan_id: int | None
    """Its id; None of an alignment without one."""


class ScanOperations(MapHandle):
    """Insertion and alignment of scans."""

    @documents(SCAN_OPTIONS)
    def insert(
        self,
        points: ArrayLike,
        *,
        guess: PoseLike | None = None,
        motion: PoseLike | None = None,
        constant_velocity: bool = False,
        align: bool = True,
        robot: str | None = None,
        scan_id: int | None = None,
        session: str | None = None,
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
        """Aligns a scan and, where it fits, adds it to the map: once, however often it has to be sent.

        `points` has shape (..., 3), meters, in the sensor frame; NaN and infinity mean "no return". A pose is a `Pose`, a 4 x 4
        matrix, `(t, q)` or seven numbers x y z qx qy qz qw.

        Without `scan_id` the scan gets the next id of this process' session, and of a `scan_id` without `session` ids go on.
        After an error with `repeat_with` (`ConnectionLost`, `TimedOut`, ...) it is not known whether the scan is in the map: send
        it again with `**error.repeat_with`. Nor is it after Ctrl-C: who ends programs so gives scans ids.

        Raises `FailedPrecondition` (`guess_required`: the robot has no pose in a map that is not empty), `Conflict`
        (`scan_id_taken`), `InvalidArgument`; `ArgumentError` for a scan without `scan_id` after 2**64 - 1 was given as one, since
        this session has no id behind it: give `session` and `scan_id`, or connect anew.
        """
        of_robot = self._robot if robot is None else word_of(robot, "robot")
        parameters: dict[str, Parameter] = {
            "robot": of_robot,
            "recover": None if recover is None else flag_of(recover, "recover"),
            "carve": None if carve is None else flag_of(carve, "carve"),
            "force": flag_of(force, "force"),
            **_guesses(guess, motion, constant_velocity, align),
            **_knowledge(timestamp_ns, gravity_in_sensor, guess_covariance),
            **_treatment(method, range_min_m, range_max_m, body_m, sensor, strict=strict),
        }
        pieces, shape = self._scan(points, point_times, point_times_from_sweep_start, parameters)
        # Last, so that a scan which is refused here uses no id up.
        of_session, number = self._identity(of_robot, session, scan_id)
        parameters |= {"session": of_session, "scan_id": number}
        try:
            answer = self._send_bytes("scans", pieces, parameters)
        except MrolError as error:
            if is_outcome_unknown(error):
                error.repeat_with = {"session": of_session, "scan_id": number}
            raise
        return self._noted(_scan_answer(answer, shape, of_robot, of_session, number))

    @documents(SCAN_OPTIONS)
    def align(
        self,
        points: ArrayLike,
        *,
        guess: PoseLike | None = None,
        motion: PoseLike | None = None,
        constant_velocity: bool = False,
        robot: str | None = None,
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
        """What inserting a scan would do; the map stays as it is.

        `points` are as of `insert`.
        """
        of_robot = self._robot if robot is None else word_of(robot, "robot")
        parameters: dict[str, Parameter] = {
            "robot": of_robot,
            "foreground_level": None if foreground_level is None else level_of(foreground_level, "foreground_level"),
            **_guesses(guess, motion, constant_velocity, True),
            **_knowledge(timestamp_ns, gravity_in_sensor, guess_covariance),
            **_treatment(method, range_min_m, range_max_m, body_m, sensor, strict=strict),
        }
        pieces, shape = self._scan(points, point_times, point_times_from_sweep_start, parameters)
        answer = self._send_bytes("alignment", pieces, parameters)
        return self._noted(_scan_answer(answer, shape, of_robot, "", None))

    def _identity(self, robot: str, session: str | None, scan_id: int | None) -> tuple[str, int]:
        """The session and the id of a scan: those given, or the next of this process."""
        if session is not None:
            if scan_id is None:
                raise ArgumentError("session", "a session without a scan_id", "given with the id of the scan in it")
            # The empty session is one, too.
            return text_of(session, "session"), whole_of(scan_id, "scan_id")
        own = self._sessions.current()
        given = None if scan_id is None else whole_of(scan_id, "scan_id")
        return own.name, own.next_id(self._name, robot, given)

    def _scan(
        self, points: ArrayLike, times: ArrayLike | None, from_sweep_start: bool, parameters: dict[str, Parameter]
    ) -> tuple[list[memoryview], tuple[int, ...]]:
        """The bytes of a scan, and the shape in which its points were given."""
        rows, shape = rows_of(points, 3, "points", POINTS, self._request_bytes_max)
        if times is None:
            return [raw(rows)], shape
        given = as_numbers(times, "point_times", TIMES)
        if given.size != len(rows):
            raise ArgumentError("point_times", f"{given.size} times of {len(rows)} points", TIMES)
        parameters["point_times"] = True
        parameters["point_times_from_sweep_start"] = flag_of(from_sweep_start, "point_times_from_sweep_start")
        return [raw(rows), raw(as_floats(given, "point_times", TIMES, self._request_bytes_max))], shape


def _guesses(guess: PoseLike | None, motion: PoseLike | None, constant_velocity: bool, align: bool) -> dict[str, Parameter]:
    given = [guess is not None, motion is not None, flag_of(constant_velocity, "constant_velocity")]
    if sum(given) > 1:
        raise ArgumentError("guess", "several of guess, motion and constant_velocity", "the only one of them")
    return {
        "guess": None if guess is None else numbers_text(Pose.of(guess, "guess").seven()),
        "motion": None if motion is None else numbers_text(Pose.of(motion, "motion").seven()),
        "constant_velocity": constant_velocity,
        "align": flag_of(align, "align"),
    }


def _knowledge(timestamp_ns: int | None, gravity: ArrayLike | None, covariance: ArrayLike | None) -> dict[str, Parameter]:
    return {
        "timestamp_ns": None if timestamp_ns is None else whole_of(timestamp_ns, "timestamp_ns", -(1 << 63), (1 << 63) - 1),
        "gravity_in_sensor": None if gravity is None else numbers_text(vector_of(gravity, 3, "gravity_in_sensor", is_finite=True)),
        "guess_covariance": None if covariance is None else _covariance_text(covariance),
    }


def _covariance_text(covariance: ArrayLike) -> str:
    expected = "numbers of shape (6, 6): x y z in meters, then turns in radians"
    array = as_numbers(covariance, "guess_covariance", expected)
    if array.shape not in ((6, 6), (36,)):
        raise ArgumentError("guess_covariance", f"shape {array.shape}", expected)
    return numbers_text(vector_of(array.reshape(36), 36, "guess_covariance", is_finite=True))


def _treatment(
    method: Method | None,
    range_min_m: float | None,
    range_max_m: float | None,
    body_m: BoxLike | None,
    sensor: str | None,
    *,
    strict: bool,
) -> dict[str, Parameter]:
    corners = None if body_m is None else Box.of(body_m, "body_m").corners("body_m")
    return {
        "method": None if method is None else word_of(method, "method"),
        "range_min_m": None if range_min_m is None else number_of(range_min_m, "range_min_m"),
        "range_max_m": None if range_max_m is None else number_of(range_max_m, "range_max_m"),
        "body_m": None if corners is None else numbers_text([*corners[0], *corners[1]]),
        "sensor": None if sensor is None else text_of(sensor, "sensor"),
        "strict": flag_of(strict, "strict"),
    }


def _scan_answer(answer: Answer, shape: tuple[int, ...], robot: str, session: str, scan_id: int | None) -> ScanAnswer:
    return answer_in(fields_of(answer.body), shape, robot, session, scan_id)


def answer_in(fields: Fields, shape: tuple[int, ...], robot: str, session: str, scan_id: int | None) -> ScanAnswer:
    """The answer to a scan that fields tell."""
    return ScanAnswer(
        version=Version.of(fields),
        accepted=fields.flag("accepted"),
        verdict=fields.text("verdict"),
        reason=fields.text("reason"),
        map_from_sensor=pose_in(fields, "map_from_sensor"),
        overlap=fields.number("overlap"),
        level_overlaps=fields.numbers("level_overlaps", (-1,)),
        inliers=fields.number("inliers"),
        fitness=fields.number("fitness"),
        information=fields.optional("information", lambda name: fields.numbers(name, (6, 6))),
        undetermined=tuple(_open_direction(of) for of in fields.objects("undetermined")),
        rays=fields.optional("rays", lambda name: rays_in(fields.object(name))),
        rivals=rivals_in(fields),
        iterations=fields.whole("iterations"),
        align_ms=fields.number("align_ms"),
        new_voxels=fields.whole("new_voxels"),
        carved_voxels=fields.whole("carved_voxels"),
        points_skipped=fields.whole("points_skipped"),
        replayed=fields.flag("replayed"),
        stationary=fields.flag("stationary"),
        recovered=fields.optional("recovered", fields.text),
        foreground=_foreground(fields, shape),
        robot=robot,
        session=session,
        scan_id=scan_id,
    )


def rivals_in(fields: Fields) -> tuple[Rival, ...]:
    """The rivals of an answer."""
    return tuple(Rival(pose_in(of, "map_from_sensor"), rays_in(of.object("rays"))) for of in fields.objects("rivals"))


def rays_in(fields: Fields) -> RayAgreement:
    """The agreement of rays that fields tell."""
    of_scan, of_map = (fields.object(side) for side in ("of_scan", "of_map"))
    return RayAgreement(_counts(of_scan), _counts(of_map))


def _counts(fields: Fields) -> RayCounts:
    return RayCounts(fields.whole("asked"), fields.whole("agree"), fields.whole("contradicted"))


def _open_direction(fields: Fields) -> OpenDirection:
    std_m = fields.optional("std_m", fields.number)
    return OpenDirection(fields.numbers("direction", (6,)), np.inf if std_m is None else std_m)


def _foreground(fields: Fields, shape: tuple[int, ...]) -> Bools | None:
    places = fields.optional("foreground", lambda name: fields.numbers(name, (-1,)))
    if places is None:
        return None
    mask: Bools = np.zeros(shape, np.bool_)
    with reading("foreground"):
        numbers = places.astype(np.int64)
        if numbers.size and numbers.min() < 0:
            raise ValueError(f"point {numbers.min()}")
        mask.reshape(-1)[numbers] = True
    mask.setflags(write=False)
    return mask
