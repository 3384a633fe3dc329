"""Where the sensor is by the robot's own odometry."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Condition

from mrol import Pose

from .frames import EXTRAPOLATION_MAX_NS, FrameTree, NoTransform, Track, checked_transform, jumping, plain_frame
from .options import Options

WAIT_S = 1.0
"""How long a cloud waits for its transforms, and how long after the start for the first of all."""


@dataclass(frozen=True, eq=False)
class SensorPlace:
    """Where the sensor was at a time."""

    odom_from_sensor: Pose | None
    """None where odometry does not tell; then `missing` says why."""
    base_from_sensor: Pose | None
    """None where nobody says where the sensor is on the robot."""
    missing: str = ""


class Odometry:
    """The frames that the robot publishes, and a topic of `nav_msgs/Odometry` where one is used. Threads may share it."""

    def __init__(self, options: Options, now_s: Callable[[], float] = time.monotonic) -> None:
        self._options = options
        self._offset_ns = round(options.time_offset_s * 1e9)
        self._now_s = now_s
        self._began_s: float | None = None
        self._changed = Condition()
        self._frames = FrameTree()
        self._track = Track()
        self._odom, self._moving = options.odom, options.base

    @property
    def odom_frame(self) -> str:
        """The frame in which odometry tells where the robot is."""
        return self._odom

    def time_of(self, stamp_ns: int) -> int:
        """The time by the robot's clock at which a cloud of a stamp was taken."""
        return stamp_ns + self._offset_ns

    def contradictions(self, sensor: str) -> list[str]:
        """What publishers say against each other of the frames that a sensor's place is made of, a sentence each."""
        with self._changed:
            own = self._frames.contradictions(sensor)
            if self._track.is_torn:
                own.append(jumping(self._odom, self._moving))
            return own + [of for of in self._frames.contradictions(self._moving) if of not in own]

    def note_transform(self, parent: str, child: str, stamp_ns: int, seven: Sequence[float], *, is_static: bool) -> None:
        """Takes a transform, x y z qx qy qz qw of `parent_from_child`.

        Raises `BadTransform`.
        """
        parent, child = plain_frame(parent), plain_frame(child)
        with self._changed:
            if is_static:
                self._frames.fix(parent, child, seven)
            else:
                self._frames.note(parent, child, stamp_ns, seven)
            self._changed.notify_all()

    def note_pose(self, frame: str, child: str, stamp_ns: int, seven: Sequence[float]) -> None:
        """Takes a pose of `nav_msgs/Odometry`.

        Raises `BadTransform`.
        """
        with self._changed:
            self._odom, self._moving = plain_frame(frame), plain_frame(child)
            self._track.insert(stamp_ns, checked_transform(self._odom, self._moving, seven))
            self._changed.notify_all()

    def clock_was_set_back(self) -> None:
        """Forgets where things were."""
        with self._changed:
            self._track = Track()
            self._frames.forget_motions()

    def place(self, sensor: str, stamp_ns: int, wait_s: float = WAIT_S) -> SensorPlace:
        """Where the sensor was at a cloud's stamp, for which transforms are waited as long as some are likely to come."""
        stamp_ns = self.time_of(stamp_ns)
        begin_s = self._now_s()
        self._began_s = begin_s if self._began_s is None else self._began_s
        with self._changed:
            while True:
                try:
                    return SensorPlace(self._odom_from_sensor(sensor, stamp_ns, 0), self._base_from_sensor(sensor, stamp_ns))
                except NoTransform as error:
                    left_s = wait_s - (self._now_s() - begin_s)
                    is_at_start = begin_s - self._began_s < WAIT_S
                    if left_s <= 0 or not (error.may_come or is_at_start) or not self._changed.wait(left_s):
                        break
            base_from_sensor = self._base_from_sensor(sensor, stamp_ns)
            try:
                return SensorPlace(self._odom_from_sensor(sensor, stamp_ns, EXTRAPOLATION_MAX_NS), base_from_sensor)
            except NoTransform as error:
                return SensorPlace(None, base_from_sensor, str(error))

    def odom_from_base(self, time_ns: int) -> Pose | None:
        """Where the robot was at a time by its own clock, by its odometry."""
        with self._changed:
            try:
                return self._odom_from_moving(self._options.base, time_ns, EXTRAPOLATION_MAX_NS)
            except NoTransform:
                return None

    def _odom_from_sensor(self, sensor: str, stamp_ns: int, beyond_ns: int) -> Pose:
        given = self._options.base_from_sensor
        if given is not None:
            return self._odom_from_moving(self._moving, stamp_ns, beyond_ns) @ given
        return self._odom_from_moving(sensor, stamp_ns, beyond_ns)

    def _odom_from_moving(self, frame: str, stamp_ns: int, beyond_ns: int) -> Pose:
        if not self._options.odometry_topic:
            return self._frames.transform(self._odom, frame, stamp_ns, beyond_ns)
        try:
            pose = self._track.at(stamp_ns, beyond_ns)
        except NoTransform as error:
            told = NoTransform(f"where {self._moving!r} is by {self._options.odometry_topic} {error}")
            told.may_come = error.may_come
            raise told from None
        return pose if frame == self._moving else pose @ self._frames.transform(self._moving, frame, stamp_ns, beyond_ns)

    def _base_from_sensor(self, sensor: str, stamp_ns: int) -> Pose | None:
        given = self._options.base_from_sensor
        if given is not None:
            return given
        try:
            return self._frames.transform(self._options.base, sensor, stamp_ns, EXTRAPOLATION_MAX_NS)
        except NoTransform:
            return None

    def sensor_from(self, sensor: str, frame: str, time_ns: int) -> Pose | None:
        """Where another frame is on the sensor, such as that of an accelerometer, at a time by the robot's own clock."""
        with self._changed:
            try:
                return self._frames.transform(sensor, plain_frame(frame), time_ns, EXTRAPOLATION_MAX_NS)
            except NoTransform:
                return None

    def frames_listed(self) -> str:
        """The frames that are known, for people."""
        with self._changed:
            return self._frames.listed()
