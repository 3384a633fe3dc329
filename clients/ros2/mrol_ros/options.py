"""What a user may set: the parameters of the node, without ROS."""

from __future__ import annotations

import math
import re
import socket
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import mrol
from mrol import Pose

from .frames import NAME_BYTES_MAX, is_frame_name, plain_frame
from .point_times import TimesRule, parse_times
from .texts import shown

DESCRIPTIONS = {
    "server": "address of the server's HTTP: host:port, https://host:port or unix:/path",
    "key_file": "file with the key; empty: the variables MROL_KEY and MROL_KEY_FILE",
    "ca": "file of the authorities that may sign the server's certificate; empty: those of the system",
    "map": "name of the map on the server",
    "robot": "name of the robot on the server; empty: the node's namespace, or the host's name where there is none",
    "session": "the run in which scans are numbered by stamps; empty: 'ros2', or of each start where the clock is simulated",
    "resolution": "side of a voxel, m: of the map if it is made, and of what is published; 0: the map has to be there",
    "frame_id": "the map's frame",
    "odom_frame": "the frame in which odometry tells where the robot is",
    "base_frame_id": "the robot's frame",
    "frame_prefix": "stands before the names of the odometry's and the robot's frame, such as 'r1/'",
    "clouds_reliable": "subscribe to clouds reliably: better for clouds above 0.5 MB, where the driver publishes so",
    "odometry_topic": "topic of nav_msgs/Odometry to use in place of transforms; empty: transforms",
    "imu_topic": "topic of sensor_msgs/Imu that tells what is down in the first cloud; empty: none",
    "times": "how times of points are read, FIELD:UNIT:FROM; empty: found out",
    "time_offset_s": "is added to a cloud's stamp to have the time of its odometry, s",
    "extrinsics": "where the sensor is on the robot, x y z qx qy qz qw of base_from_sensor; empty: by transforms",
    "initial_pose": "where a robot that the server does not know begins, x y z qx qy qz qw of map_from_base; empty: not told",
    "range_min_m": "nearer points are skipped; 0: as the server's settings for the robot say",
    "range_max_m": "farther points are skipped; 0: as the server's settings for the robot say",
    "body_m": "points in this box are of the robot itself, x y z x y z in the sensor frame; empty: as the server's settings say",
    "publish_tf": "publish map -> odom",
    "transform_tolerance": "how far beyond the cloud's stamp map -> odom is to be believed, s",
    "transform_period_s": "how often it is looked whether map -> odom has to be published again, s",
    "publish_grid": "publish the map from above",
    "grid_period_s": "least time between two grids, s",
    "octomap_period_s": "least time between two octrees, s",
    "occupancy_min_z": "lower end of the band of heights of the grid, m",
    "occupancy_max_z": "upper end of the band of heights of the grid, m",
    "occupancy_z_from": "from where these heights count: 'floor', or 'map' for z = 0 of the map as in octomap_server",
    "octomap_free_level": "level of the voxels that are told as free in octrees; -1: none are",
    "save_map_file": "file that save_map writes; empty: the map's name with .mrol, in the working directory",
    "allow_reset": "let the service reset delete what the map holds",
    "request_timeout_s": "how long one request may take, s",
}
"""What each parameter means, for `ros2 param describe`."""


RANGES_S = {
    "transform_period_s": (0.001, 60.0),
    "transform_tolerance": (0.0, 3600.0),
    "request_timeout_s": (0.01, 3600.0),
    "time_offset_s": (-1e10, 1e10),
}
"""The least and the largest value of times, seconds: ROS and sockets have none beyond."""

VALUE_SHOWN = 80
"""Characters of a wrong value that are shown."""

ROBOT_NAME_MAX = 64
"""Characters of a robot's name on the server."""


class OptionError(ValueError):
    """A parameter that cannot be used."""


@dataclass(frozen=True)
class Options:
    """The parameters with their defaults; `DESCRIPTIONS` says what they mean."""

    server: str = "localhost:7333"
    key_file: str = ""
    ca: str = ""
    map: str = "map"
    robot: str = ""
    session: str = ""
    resolution: float = 0.1
    frame_id: str = "map"
    odom_frame: str = "odom"
    base_frame_id: str = "base_link"
    frame_prefix: str = ""
    clouds_reliable: bool = False
    odometry_topic: str = ""
    imu_topic: str = ""
    times: str = ""
    time_offset_s: float = 0.0
    extrinsics: Sequence[float] = ()
    initial_pose: Sequence[float] = ()
    range_min_m: float = 0.0
    range_max_m: float = 0.0
    body_m: Sequence[float] = ()
    publish_tf: bool = False
    transform_tolerance: float = 0.2
    transform_period_s: float = 0.05
    publish_grid: bool = True
    grid_period_s: float = 2.0
    octomap_period_s: float = 5.0
    occupancy_min_z: float = 0.1
    occupancy_max_z: float = 2.0
    occupancy_z_from: str = "floor"
    octomap_free_level: int = -1
    save_map_file: str = ""
    allow_reset: bool = False
    request_timeout_s: float = 10.0

    def __post_init__(self) -> None:
        for of in fields(self):
            value = getattr(self, of.name)
            numbers = value if isinstance(value, Sequence) and not isinstance(value, str) else [value]
            if any(isinstance(number, float) and not math.isfinite(number) for number in numbers):
                raise OptionError(f"{of.name} must be finite, got {value}")
        for name, (least, most) in RANGES_S.items():
            _check(least <= getattr(self, name) <= most, name, f"{least:g} to {most:g} s", getattr(self, name))
        self._check_frames()
        for name in ("resolution", "range_min_m", "range_max_m", "grid_period_s", "octomap_period_s"):
            _check(getattr(self, name) >= 0, name, "0 or more", getattr(self, name))
        _check(
            self.occupancy_min_z < self.occupancy_max_z,
            "occupancy_min_z",
            f"below occupancy_max_z, {self.occupancy_max_z}",
            self.occupancy_min_z,
        )
        _check(self.occupancy_z_from in ("floor", "map"), "occupancy_z_from", "floor or map", self.occupancy_z_from)
        _check(-1 <= self.octomap_free_level < 16, "octomap_free_level", "-1 to 15", self.octomap_free_level)
        for name, count in (("extrinsics", 7), ("initial_pose", 7), ("body_m", 6)):
            numbers = getattr(self, name)
            _check(len(numbers) in (0, count), name, f"empty or {count} numbers", list(numbers))
        for name in ("extrinsics", "initial_pose"):
            if getattr(self, name):
                try:
                    Pose.of(list(getattr(self, name)), name)
                except mrol.ArgumentError as error:
                    raise OptionError(str(error)) from error
        try:
            parse_times(self.times)
        except ValueError as error:
            raise OptionError(str(error)) from error

    def _check_frames(self) -> None:
        for name, frame in (("frame_id", self.map_frame), ("odom_frame", self.odom), ("base_frame_id", self.base)):
            _check(is_frame_name(frame), name, f"name a frame in 1 to {NAME_BYTES_MAX} printable bytes", frame, verb="must")
        is_own = self.publish_tf and self.odom == self.map_frame
        _check(not is_own, "odom_frame", "another frame than frame_id", self.odom)
        _check(self.base != self.odom, "base_frame_id", "another frame than odom_frame", self.base)

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Options:
        """The options of parameters by their names. Whole numbers are taken for others, and None for an empty list.

        Raises `OptionError`.
        """
        return cls(**{name: _typed(name, value, getattr(cls, name)) for name, value in values.items()})

    @property
    def odom(self) -> str:
        """The odometry's frame, with the prefix."""
        return plain_frame(self.frame_prefix + plain_frame(self.odom_frame))

    @property
    def base(self) -> str:
        """The robot's frame, with the prefix."""
        return plain_frame(self.frame_prefix + plain_frame(self.base_frame_id))

    @property
    def map_frame(self) -> str:
        """The map's frame, which robots share: it has no prefix."""
        return plain_frame(self.frame_id)

    @property
    def base_from_sensor(self) -> Pose | None:
        """Where the sensor is on the robot, where somebody says."""
        return Pose.of(list(self.extrinsics)) if self.extrinsics else None

    @property
    def times_rule(self) -> tuple[str, TimesRule] | None:
        """The field and the rule of times of points, where somebody says."""
        return parse_times(self.times)

    def robot_name(self, namespace: str) -> str:
        """The robot's name on the server: what is set, or the namespace, or the host's name."""
        found = self.robot or namespace.strip("/").replace("/", ".") or socket.gethostname()
        return re.sub(r"[^A-Za-z0-9._-]", "-", found)[:ROBOT_NAME_MAX]


def _typed(name: str, value: Any, default: Any) -> Any:
    """A value in the type of the default."""
    if isinstance(default, tuple):
        numbers = () if value is None else tuple(value)
        _check(all(_is_number(number) for number in numbers), name, "numbers", value)
        return tuple(float(number) for number in numbers)
    if isinstance(default, float):
        _check(_is_number(value), name, "a number", value)
        return float(value)
    _check(type(value) is type(default), name, {str: "text", bool: "true or false", int: "a whole number"}[type(default)], value)
    return value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _check(is_good: bool, name: str, expected: str, value: object, verb: str = "must be") -> None:
    if not is_good:
        raise OptionError(f"{name} {verb} {expected}, got {shown(str(value), VALUE_SHOWN)}")
