"""The way of a cloud: its transforms, its guess, the request, and what is made of the answer."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event, Lock
from typing import Any

import mrol
import numpy as np
from mrol import Pose, ScanAnswer
from numpy.typing import NDArray

from .clouds import CloudError, CloudLayout, read_cloud
from .correction import guess_covariance, moved_covariance
from .frames import is_frame_name
from .gravity import GravityWindow
from .newest import NewestQueue
from .odometry import Odometry, SensorPlace
from .options import Options
from .point_times import NoTimes, TimesRule, find_rule, times_s
from .server_link import ServerLink

SET_BACK_NS = 1_000_000_000
"""A stamp farther than this before the last one is of a clock that was set back; a nearer one comes too late."""

REAL_CLOCK_NS = 946_684_800 * 1_000_000_000
"""Stamps before the year 2000 are of a clock that begins anew with each start."""

FIRST_DISTANCE_MAX_M = 1000.0
"""Odometry farther from its origin says nothing of where a map begins."""

INITIAL_POSE_TRIES = 10
"""An initial pose counts until a cloud is accepted, or so many were refused at it."""

PAUSE_S = 0.3
"""How long nothing is sent after the server was not reached."""

RETRY_AFTER_MAX_S = 5.0


@dataclass(frozen=True, eq=False)
class StampedCloud:
    """A message with points, as it came."""

    stamp_ns: int
    frame: str
    layout: CloudLayout
    data: Any
    """A buffer of bytes."""


@dataclass(frozen=True, eq=False)
class InitialPose:
    """Where the robot is in the map, as somebody says: `map_from_base`, with its covariance, shape (6, 6), if it is known."""

    map_from_base: Pose
    covariance: NDArray[np.float64] | None = None
    stamp_ns: int = 0
    """When that was so; 0: now."""


@dataclass(frozen=True, eq=False)
class MappedCloud:
    """A cloud with its answer."""

    stamp_ns: int
    frame: str
    answer: ScanAnswer
    place: SensorPlace


@dataclass
class Counts:
    """What became of the clouds so far."""

    accepted: int = 0
    refused: int = 0
    """Those that did not fit: the map is untouched."""
    unreadable: int = 0
    late: int = 0
    """Those whose stamp is not later than that of the one before."""
    not_sent: int = 0
    """Those that the server could not be reached for, or would not take."""
    repeated: int = 0
    """Requests that were sent again since their answer was lost."""
    paused: int = 0
    without_odometry: int = 0
    without_times: int = 0


@dataclass
class MapperState:
    """What diagnostics tell of the mapper."""

    counts: Counts = field(default_factory=Counts)
    verdict: str = ""
    """Of the last answer."""
    reason: str = ""
    server_error: str = ""
    """Why the last request had no answer; empty while the server answers."""
    missing: str = ""
    """What is missing for a better guess."""
    needs_pose: bool = False
    """The server knows no pose of the robot in a map that is not empty."""
    times: str = ""
    """How times of points are read, or why there are none."""


class Mapper:
    """Sends the newest cloud, one after the other.

    A request whose answer was lost is sent again, with the same number, until there is an answer: so it is in the map once, and the
    motion of the next one counts from the right place. Meanwhile newer clouds take each other's place in the queue.
    """

    def __init__(
        self,
        options: Options,
        link: ServerLink,
        odometry: Odometry,
        on_mapped: Callable[[MappedCloud], None],
        note: Callable[[str], None],
        *,
        robot: str = "",
        is_simulated: bool = False,
    ) -> None:
        """`note` is told what a person should know, each kind of it once; `on_mapped` of each answer.

        `robot` is its name on the server.
        """
        self.queue: NewestQueue[StampedCloud] = NewestQueue()
        self.state = MapperState()
        self.gravity = GravityWindow()
        self.imu_frame = ""
        self.is_paused = False
        self._options = options
        self._link = link
        self._odometry = odometry
        self._on_mapped = on_mapped
        self._note = note
        self._noted: set[str] = set()
        self._session = options.session or (_own_session() if is_simulated else "")
        self._closing = Event()
        self._lock = Lock()
        self._robot = robot
        self._beginning = InitialPose(Pose.of(list(options.initial_pose))) if options.initial_pose else None
        self._initial: InitialPose | None = self._beginning
        self._initial_tries = 0
        self._last_odom_from_sensor: Pose | None = None
        self._map_from_odom: Pose | None = None
        self._has_accepted = False
        self._last_stamp_ns: int | None = None
        given = options.times_rule
        self._times_field: str | None = given[0] if given else None
        self._rule: TimesRule | None = given[1] if given else None
        self.last_cloud: StampedCloud | None = None

    def set_initial_pose(self, pose: InitialPose) -> None:
        """Takes where the robot is, as somebody says, for the next cloud.

        Raises `ValueError` for a covariance that is none.
        """
        if pose.covariance is not None:
            pose = InitialPose(pose.map_from_base, guess_covariance(pose.covariance), pose.stamp_ns)
        with self._lock:
            self._initial, self._initial_tries = pose, 0

    def forget(self) -> None:
        """Begins anew, as in a map that was made anew."""
        with self._lock:
            self._last_odom_from_sensor = self._map_from_odom = None
            self._has_accepted = False

    def run(self) -> None:
        """Sends clouds until it is closed."""
        while not self._closing.is_set():
            cloud = self.queue.take(0.5)
            if cloud is not None:
                self.step(cloud)

    def close(self) -> None:
        """Ends `run` after the request that is under way."""
        self._closing.set()
        self.queue.close()

    def step(self, cloud: StampedCloud) -> None:
        """Maps one cloud."""
        counts = self.state.counts
        if self.is_paused:
            counts.paused += 1
            return
        if not is_frame_name(cloud.frame):
            counts.unreadable += 1
            self._note_once("frame", f"a cloud is left out: its header must name a frame, got {cloud.frame[:40]!r}")
            return
        if not self._is_later(cloud.stamp_ns):
            counts.late += 1
            return
        self.last_cloud = cloud
        place = self._odometry.place(cloud.frame, cloud.stamp_ns)
        self.state.missing = place.missing
        if place.odom_from_sensor is None:
            counts.without_odometry += 1
            self._note_once("odometry", f"no motion by odometry: {place.missing}")
        try:
            points, seconds = self._points(cloud)
        except CloudError as error:
            counts.unreadable += 1
            self._note_once("cloud", f"a cloud is left out: {error}")
            return
        arguments: dict[str, Any] = {
            "scan_id": cloud.stamp_ns,
            "session": self._session_of(cloud.stamp_ns),
            "timestamp_ns": cloud.stamp_ns,
            "point_times": seconds,
            "range_min_m": self._options.range_min_m or None,
            "range_max_m": self._options.range_max_m or None,
            "body_m": np.reshape(self._options.body_m, (2, 3)) if self._options.body_m else None,
        }
        answer = self._sent(points, arguments, cloud, place)
        if answer is not None:
            self._take(cloud, place, answer)

    def _take(self, cloud: StampedCloud, place: SensorPlace, answer: ScanAnswer) -> None:
        state = self.state
        state.verdict, state.reason, state.needs_pose = answer.verdict, answer.reason, False
        with self._lock:
            if answer.accepted:
                state.counts.accepted += 1
                self._has_accepted, self._last_odom_from_sensor = True, place.odom_from_sensor
                if place.odom_from_sensor is not None:
                    self._map_from_odom = answer.map_from_sensor @ place.odom_from_sensor.inverse()
                self._initial = None
            else:
                state.counts.refused += 1
                self._initial_tries += self._initial is not None
                if self._initial_tries >= INITIAL_POSE_TRIES:
                    self._initial, self._initial_tries = None, 0
                    self._note(
                        f"{INITIAL_POSE_TRIES} clouds were refused at the initial pose, which counts no more: {answer.reason}"
                    )
        self._on_mapped(MappedCloud(cloud.stamp_ns, cloud.frame, answer, place))

    def _sent(
        self, points: NDArray[np.float32], arguments: dict[str, Any], cloud: StampedCloud, place: SensorPlace
    ) -> ScanAnswer | None:
        """The server's answer; None where the cloud was not taken, and is not in the map."""
        is_uncertain, guess = False, None
        while not self._closing.is_set():
            try:
                m = self._link.map()
                if guess is None:
                    # The same guess each time: with another one the scan would be another one.
                    guess = self._guess(m, cloud, place)
                answer = m.insert(points, **arguments, **guess)
            except mrol.MrolError as error:
                self.state.server_error = str(error)
                is_uncertain = is_uncertain or (bool(error.repeat_with) and not isinstance(error, mrol.ConnectFailed))
                if isinstance(error, mrol.ServerError) and not error.repeat_with and not _is_passing(error):
                    self._refused(error)
                    return None
                if not is_uncertain:
                    self.state.counts.not_sent += 1
                    self._pause(error)
                    return None
                self.state.counts.repeated += 1
                self._pause(error)
            else:
                self.state.server_error = ""
                return answer
        return None

    def _refused(self, error: mrol.ServerError) -> None:
        """Takes note of a refusal that the same request would meet again."""
        counts = self.state.counts
        if error.reason == "guess_required":
            counts.refused += 1
            self.state.server_error, self.state.needs_pose = "", True
            self._note_once(
                "pose", "the server does not know where the robot is: publish initialpose, or call the service localize"
            )
            return
        counts.not_sent += 1
        if error.reason in ("scan_id_taken", "scan_withdrawn", "scan_id_too_old"):
            # An earlier run has sent a cloud of this stamp.
            self.state.server_error = ""
        elif isinstance(error, mrol.NotFound):
            self._link.forget_map()
            self.forget()
        self._note_once(error.reason, f"the server does not take a cloud: {error}")

    def _pause(self, error: mrol.MrolError) -> None:
        wished = error.retry_after_s if isinstance(error, mrol.ServerError) else None
        self._closing.wait(min(max(wished or 0.0, PAUSE_S), RETRY_AFTER_MAX_S))

    def _guess(self, m: mrol.Map, cloud: StampedCloud, place: SensorPlace) -> dict[str, Any]:
        """Where the cloud may have been taken, as arguments of `insert`."""
        with self._lock:
            initial, last, has_accepted = self._initial, self._last_odom_from_sensor, self._has_accepted
            map_from_odom = self._map_from_odom
        now = place.odom_from_sensor
        # A robot that the server knows may have been started again far from where it began.
        if initial is not None and not (initial is self._beginning and self._robot in m.describe().robots):
            return self._initial_guess(initial, place)
        if last is not None and now is not None:
            return {"motion": last.inverse() @ now}
        if map_from_odom is not None and now is not None:
            # The last accepted cloud had no odometry, and one before it had.
            return {"guess": map_from_odom @ now}
        if has_accepted:
            return {"constant_velocity": True}
        down = self._down(cloud)
        told: dict[str, Any] = {} if down is None else {"gravity_in_sensor": down}
        if m.describe().scans == 0:
            # The map lies as the odometry's frame, or as the robot that stands level.
            first = now if now is not None and np.abs(now.translation_m).max() < FIRST_DISTANCE_MAX_M else place.base_from_sensor
            return told if first is None else told | {"guess": first}
        return told

    def _initial_guess(self, initial: InitialPose, place: SensorPlace) -> dict[str, Any]:
        base_from_sensor = place.base_from_sensor or Pose.identity()
        map_from_base = initial.map_from_base
        then = self._odometry.odom_from_base(initial.stamp_ns) if initial.stamp_ns else None
        if then is not None and place.odom_from_sensor is not None:
            # It has moved since.
            map_from_base = map_from_base @ then.inverse() @ place.odom_from_sensor @ base_from_sensor.inverse()
        guess = map_from_base @ base_from_sensor
        if initial.covariance is None:
            return {"guess": guess}
        lever_m = guess.translation_m - map_from_base.translation_m
        return {"guess": guess, "guess_covariance": moved_covariance(initial.covariance, lever_m)}

    def _down(self, cloud: StampedCloud) -> NDArray[np.float64] | None:
        """What is down in the sensor's frame, by the accelerometer."""
        if not self.imu_frame:
            return None
        sensor_from_imu = self._odometry.sensor_from(cloud.frame, self.imu_frame, cloud.stamp_ns)
        return None if sensor_from_imu is None else self.gravity.at(cloud.stamp_ns, sensor_from_imu)

    def localize(self) -> tuple[bool, str]:
        """Searches the map for where the last cloud was taken; if it is found, the next cloud is guessed from there.

        What is returned is whether it was found, and a sentence.
        """
        cloud = self.last_cloud
        if cloud is None:
            return False, "there was no cloud yet"
        try:
            points, _ = self._points(cloud)
            place = self._odometry.place(cloud.frame, cloud.stamp_ns, wait_s=0)
            found = (
                self._link.map()
                .with_timeout(max(self._options.request_timeout_s, 30.0))
                .localize(points, gravity_in_sensor=self._down(cloud))
            )
        except (CloudError, mrol.MrolError) as error:
            return False, str(error)
        if found.map_from_sensor is None:
            return False, f"{found.verdict}: {found.reason}"
        base_from_sensor = place.base_from_sensor or Pose.identity()
        map_from_base = found.map_from_sensor @ base_from_sensor.inverse()
        self.set_initial_pose(InitialPose(map_from_base, None, cloud.stamp_ns))
        x, y, z = map_from_base.translation_m
        return True, f"the robot was at {x:.3f} {y:.3f} {z:.3f} m in the map"

    def _points(self, cloud: StampedCloud) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        read = read_cloud(cloud.layout, cloud.data, self._times_field)
        try:
            if self._rule is None:
                self._rule, doubt = find_rule(read, cloud.stamp_ns)
                if doubt:
                    self._note_once("doubt", doubt)
            seconds = times_s(self._rule, read, cloud.stamp_ns)
        except NoTimes as error:
            self.state.counts.without_times += 1
            self.state.times = f"none: {error}"
            self._note_once("times", f"clouds are mapped as if all points of each were measured at once: {error}")
            return read.points, None
        self.state.times = f"{read.times_field}:{self._rule.unit}:{self._rule.origin}"
        return read.points, seconds

    def _is_later(self, stamp_ns: int) -> bool:
        """Whether a stamp is later than the last one, or of a clock that was set back."""
        if stamp_ns <= 0:
            self._note_once("stamp", f"a cloud with the stamp {stamp_ns} ns is left out: the driver has to stamp its clouds")
            return False
        last_ns = self._last_stamp_ns
        if last_ns is not None and stamp_ns <= last_ns:
            if last_ns - stamp_ns < SET_BACK_NS:
                return False
            self._note_once(
                "clock", f"the stamps of clouds went back by {(last_ns - stamp_ns) * 1e-9:.1f} s, as of a clock that was set"
            )
            with self._lock:
                self._last_odom_from_sensor = self._map_from_odom = None
            if not self._options.session and stamp_ns < REAL_CLOCK_NS:
                self._session = _own_session()
        self._last_stamp_ns = stamp_ns
        return True

    def _session_of(self, stamp_ns: int) -> str:
        """The session in which a stamp is unique."""
        if not self._session:
            self._session = "ros2" if stamp_ns >= REAL_CLOCK_NS else _own_session()
        return self._session

    def _note_once(self, kind: str, text: str) -> None:
        if kind not in self._noted:
            self._noted.add(kind)
            self._note(text)


def _own_session() -> str:
    return f"ros2-{uuid.uuid4().hex[:12]}"


def _is_passing(error: mrol.ServerError) -> bool:
    """Whether the same request may succeed later."""
    return isinstance(error, mrol.Unavailable | mrol.ResourceExhausted | mrol.DeadlineExceeded | mrol.Internal)


__all__ = ["Counts", "InitialPose", "MappedCloud", "Mapper", "MapperState", "StampedCloud"]
