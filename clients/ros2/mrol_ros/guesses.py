"""Where the next cloud may have been taken."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from typing import Any

import mrol
import numpy as np
from mrol import Pose
from numpy.typing import NDArray

from .clouds import StampedCloud
from .correction import guess_covariance, moved_covariance
from .gravity import GravityWindow
from .odometry import Odometry, SensorPlace
from .options import Options

FIRST_DISTANCE_MAX_M = 1000.0
"""Odometry farther from its origin says nothing of where a map begins."""

INITIAL_POSE_TRIES = 10
"""An initial pose counts until a cloud is accepted, or so many were refused at it."""


@dataclass(frozen=True, eq=False)
class InitialPose:
    """Where the robot is in the map, as somebody says: `map_from_base`, with its covariance, shape (6, 6), if it is known."""

    map_from_base: Pose
    covariance: NDArray[np.float64] | None = None
    stamp_ns: int = 0
    """When that was so, by the robot's clock; 0: now."""


class Guesses:
    """What is known of where the robot is, from the clouds before, from odometry and from people. Threads may share it."""

    def __init__(self, options: Options, odometry: Odometry, robot: str) -> None:
        """`robot` is its name on the server."""
        self.gravity = GravityWindow()
        self.imu_frame = ""
        """The frame of the accelerometer; empty before it was heard of."""
        self._odometry = odometry
        self._robot = robot
        self._lock = Lock()
        self._beginning = InitialPose(Pose.of(list(options.initial_pose))) if options.initial_pose else None
        self._initial: InitialPose | None = self._beginning
        self._initial_tries = 0
        self._last_odom_from_sensor: Pose | None = None
        self._map_from_odom: Pose | None = None
        self._has_accepted = False

    def begin_at(self, pose: InitialPose) -> None:
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

    def clock_was_set_back(self) -> None:
        """Forgets odometry, which is of other times."""
        with self._lock:
            self._last_odom_from_sensor = self._map_from_odom = None

    def accepted(self, map_from_sensor: Pose, place: SensorPlace) -> None:
        """Takes where an accepted cloud was taken."""
        with self._lock:
            self._has_accepted, self._last_odom_from_sensor = True, place.odom_from_sensor
            if place.odom_from_sensor is not None:
                self._map_from_odom = map_from_sensor @ place.odom_from_sensor.inverse()
            self._initial = None

    def refused(self) -> bool:
        """Takes note of a refused cloud. Whether the initial pose counts no more, since so many were refused at it."""
        with self._lock:
            self._initial_tries += self._initial is not None
            if self._initial_tries < INITIAL_POSE_TRIES:
                return False
            self._initial, self._initial_tries = None, 0
            return True

    def of(self, m: mrol.Map, cloud: StampedCloud, place: SensorPlace) -> dict[str, Any]:
        """Where a cloud may have been taken, as arguments of `insert`."""
        with self._lock:
            initial, last, has_accepted = self._initial, self._last_odom_from_sensor, self._has_accepted
            map_from_odom = self._map_from_odom
        now = place.odom_from_sensor
        # A robot that the server knows may have been started again far from where it began.
        if initial is not None and not (initial is self._beginning and self._robot in m.describe().robots):
            return self._of_initial(initial, place)
        if last is not None and now is not None:
            return {"motion": last.inverse() @ now}
        if map_from_odom is not None and now is not None:
            # The last accepted cloud had no odometry, and one before it had.
            return {"guess": map_from_odom @ now}
        if has_accepted:
            return {"constant_velocity": True}
        down = self.down(cloud)
        told: dict[str, Any] = {} if down is None else {"gravity_in_sensor": down}
        if m.describe().scans == 0:
            # The map lies as the odometry's frame, or as the robot that stands level.
            first = now if now is not None and np.abs(now.translation_m).max() < FIRST_DISTANCE_MAX_M else place.base_from_sensor
            return told if first is None else told | {"guess": first}
        return told

    def down(self, cloud: StampedCloud) -> NDArray[np.float64] | None:
        """What is down in the sensor's frame, by the accelerometer."""
        if not self.imu_frame:
            return None
        time_ns = self._odometry.time_of(cloud.stamp_ns)
        sensor_from_imu = self._odometry.sensor_from(cloud.frame, self.imu_frame, time_ns)
        return None if sensor_from_imu is None else self.gravity.at(time_ns, sensor_from_imu)

    def _of_initial(self, initial: InitialPose, place: SensorPlace) -> dict[str, Any]:
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
