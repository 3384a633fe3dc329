"""The way of a cloud: its transforms, its guess, the request, and what is made of the answer."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event
from typing import Any

import mrol
import numpy as np
from mrol import Pose, ScanAnswer
from numpy.typing import NDArray

from .clouds import CloudError, StampedCloud, read_cloud
from .frames import is_frame_name
from .guesses import INITIAL_POSE_TRIES, Guesses, InitialPose
from .lost import LostClouds
from .mapper_state import MapperState
from .newest import NewestQueue
from .odometry import Odometry, SensorPlace
from .options import Options
from .own_scans import OwnScans
from .point_times import NoTimes, TimesRule, find_rule, times_s
from .server_link import ServerLink
from .stamps import CloudStamps
from .texts import shown

PAUSE_S = 0.3
"""How long nothing is sent after the server was not reached."""

RETRY_AFTER_MAX_S = 5.0

NOTED_MAX = 50
"""Kinds of oddities that are noted, at most: a server may give any number of reasons."""

TRACE_MAX = 2000
"""Characters of a defect's traceback that are logged, the last ones."""

KIND_MAX = 64
"""Characters of a kind that count."""

GUESS_REASONS = ("bad_pose", "bad_covariance", "scan_out_of_range")
"""Reasons of the server for which the guess is to blame."""


@dataclass(frozen=True, eq=False)
class MappedCloud:
    """A cloud with its answer."""

    stamp_ns: int
    frame: str
    answer: ScanAnswer
    place: SensorPlace


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
        own_scans: OwnScans | None = None,
    ) -> None:
        """`note` is told what a person should know, each kind of it once; `on_mapped` of each answer.

        `robot` is its name on the server; `own_scans` is told of each scan that is sent.
        """
        self.queue: NewestQueue[StampedCloud] = NewestQueue()
        self.lost = LostClouds()
        self.state = MapperState()
        self.guesses = Guesses(options, odometry, robot)
        self.own_scans = own_scans or OwnScans(robot)
        self.is_paused = False
        self._options = options
        self._link = link
        self._odometry = odometry
        self._on_mapped = on_mapped
        self._note = note
        self._noted: set[str] = set()
        self._stamps = CloudStamps(options.session, is_simulated=is_simulated)
        self._closing = Event()
        given = options.times_rule
        self._times_field: str | None = given[0] if given else None
        self._rule: TimesRule | None = given[1] if given else None
        self.last_cloud: StampedCloud | None = None

    def run(self) -> None:
        """Sends clouds until it is closed."""
        while not self._closing.is_set():
            cloud = self.queue.take(0.5)
            if cloud is None:
                continue
            try:
                self.step(cloud)
            except Exception as error:
                # A defect at one cloud ends no mapping.
                self.state.counts.failed += 1
                self.state.left_out = shown(f"the node failed at a cloud: {error!r}")
                self._note_once("defect", f"{self.state.left_out}; please report this:\n{traceback.format_exc()[-TRACE_MAX:]}")

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
            self._unreadable("frame", f"its header must name a frame, got {cloud.frame[:40]!r}")
            return
        verdict = self._stamps.judge(cloud.stamp_ns)
        if verdict.oddity:
            self._note_once(verdict.oddity, verdict.text)
        if not verdict.is_later:
            counts.late += 1
            return
        if verdict.is_set_back:
            self.guesses.clock_was_set_back()
        self.last_cloud = cloud
        place = self._odometry.place(cloud.frame, cloud.stamp_ns)
        self.state.missing = place.missing
        if place.odom_from_sensor is None:
            counts.without_odometry += 1
            self._note_once("odometry", f"no motion by odometry: {place.missing}")
        try:
            points, seconds = self._points(cloud)
        except CloudError as error:
            self._unreadable("cloud", str(error))
            return
        arguments: dict[str, Any] = {
            "scan_id": cloud.stamp_ns,
            "session": self._stamps.session_of(cloud.stamp_ns),
            "timestamp_ns": cloud.stamp_ns,
            "point_times": seconds,
            "range_min_m": self._options.range_min_m or None,
            "range_max_m": self._options.range_max_m or None,
            "body_m": np.reshape(self._options.body_m, (2, 3)) if self._options.body_m else None,
        }
        answer = self._sent(points, arguments, cloud, place)
        if answer is not None:
            self._take(cloud, place, answer)

    def _unreadable(self, kind: str, why: str) -> None:
        self.state.counts.unreadable += 1
        self.state.left_out = shown(why)
        self._note_once(kind, f"a cloud is left out: {why}")

    def _take(self, cloud: StampedCloud, place: SensorPlace, answer: ScanAnswer) -> None:
        state = self.state
        state.verdict, state.reason, state.needs_pose = shown(answer.verdict), shown(answer.reason), False
        if answer.accepted:
            state.counts.accepted += 1
            self.guesses.accepted(answer.map_from_sensor, place)
        else:
            state.counts.refused += 1
            self._refused_at_guess(state.reason)
        self._on_mapped(MappedCloud(cloud.stamp_ns, cloud.frame, answer, place))

    def _refused_at_guess(self, reason: str) -> None:
        if self.guesses.refused():
            self._note(f"{INITIAL_POSE_TRIES} clouds were refused at the initial pose, which counts no more: {reason}")

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
                    guess = self.guesses.of(m, cloud, place)
                self.own_scans.sent(arguments["session"], arguments["scan_id"])
                answer = m.insert(points, **arguments, **guess)
            except mrol.MrolError as error:
                self.state.server_error = shown(str(error))
                is_uncertain = is_uncertain or (bool(error.repeat_with) and not isinstance(error, mrol.ConnectFailed))
                if isinstance(error, mrol.ServerError) and not error.repeat_with and not _is_passing(error):
                    self._refused(error)
                    return None
                if not is_uncertain:
                    self.state.counts.not_sent += 1
                    self.state.left_out = self.state.server_error
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
        self.state.left_out = shown(str(error))
        if error.reason in GUESS_REASONS:
            self._refused_at_guess(self.state.left_out)
        elif error.reason in ("scan_id_taken", "scan_withdrawn", "scan_id_too_old"):
            # An earlier run has sent a cloud of this stamp.
            self.state.server_error = ""
        elif isinstance(error, mrol.NotFound):
            self._link.forget_map()
            self.guesses.forget()
        self._note_once(error.reason[:KIND_MAX], f"the server does not take a cloud: {self.state.left_out}")

    def _pause(self, error: mrol.MrolError) -> None:
        wished = error.retry_after_s if isinstance(error, mrol.ServerError) else None
        self._closing.wait(min(max(wished or 0.0, PAUSE_S), RETRY_AFTER_MAX_S))

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
                .localize(points, gravity_in_sensor=self.guesses.down(cloud))
            )
        except (CloudError, mrol.MrolError) as error:
            return False, str(error)
        if found.map_from_sensor is None:
            return False, f"{found.verdict}: {found.reason}"
        base_from_sensor = place.base_from_sensor or Pose.identity()
        map_from_base = found.map_from_sensor @ base_from_sensor.inverse()
        self.guesses.begin_at(InitialPose(map_from_base, None, self._odometry.time_of(cloud.stamp_ns)))
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

    def _note_once(self, kind: str, text: str) -> None:
        if kind not in self._noted and len(self._noted) < NOTED_MAX:
            self._noted.add(kind)
            self._note(text)


def _is_passing(error: mrol.ServerError) -> bool:
    """Whether the same request may succeed later."""
    return isinstance(error, mrol.Unavailable | mrol.ResourceExhausted | mrol.DeadlineExceeded | mrol.Internal)
