"""ROS messages from and to what the other modules take."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from mrol import Grid, Pose
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from .clouds import CloudField, CloudLayout, StampedCloud
from .frames import plain_frame
from .guesses import InitialPose
from .occupancy_grid import grid_cells

SECOND_NS = 1_000_000_000
STAMP_MAX_NS = (1 << 31) * SECOND_NS - 1
"""The last time that a stamp can tell."""


def stamp_ns_of(stamp: Time) -> int:
    """A stamp in nanoseconds."""
    return stamp.sec * SECOND_NS + stamp.nanosec


def stamp_of(stamp_ns: int) -> Time:
    """Nanoseconds as a stamp; the nearest one that there is."""
    stamp_ns = min(max(stamp_ns, 0), STAMP_MAX_NS)
    return Time(sec=stamp_ns // SECOND_NS, nanosec=stamp_ns % SECOND_NS)


def header_of(stamp_ns: int, frame: str) -> Header:
    """A header."""
    return Header(stamp=stamp_of(stamp_ns), frame_id=frame)


def cloud_of(message: PointCloud2) -> StampedCloud:
    """A cloud, whose data is not copied."""
    fields = [CloudField(of.name, of.offset, of.datatype) for of in message.fields]
    layout = CloudLayout(message.width, message.height, message.point_step, message.row_step, message.is_bigendian, fields)
    return StampedCloud(stamp_ns_of(message.header.stamp), plain_frame(message.header.frame_id), layout, message.data)


def seven_of_transform(message: TransformStamped) -> tuple[float, ...]:
    """A transform as x y z qx qy qz qw."""
    t, q = message.transform.translation, message.transform.rotation
    return t.x, t.y, t.z, q.x, q.y, q.z, q.w


def seven_of_pose(message: Any) -> tuple[float, ...]:
    """A `geometry_msgs/Pose` as x y z qx qy qz qw."""
    p, q = message.position, message.orientation
    return p.x, p.y, p.z, q.x, q.y, q.z, q.w


def initial_pose_of(message: PoseWithCovarianceStamped) -> InitialPose:
    """Where somebody says that the robot is.

    Raises `ValueError`.
    """
    pose = Pose.of(list(seven_of_pose(message.pose.pose)), "initialpose")
    return InitialPose(pose, np.array(message.pose.covariance).reshape(6, 6), stamp_ns_of(message.header.stamp))


def transform_message(stamp_ns: int, parent: str, child: str, parent_from_child: Pose) -> TransformStamped:
    """A transform."""
    message = TransformStamped(header=header_of(stamp_ns, parent), child_frame_id=child)
    _write(parent_from_child, message.transform.translation, message.transform.rotation)
    return message


def pose_message(stamp_ns: int, frame: str, pose: Pose, covariance: NDArray[np.float64]) -> PoseWithCovarianceStamped:
    """A pose with its covariance, shape (6, 6)."""
    message = PoseWithCovarianceStamped(header=header_of(stamp_ns, frame))
    _write(pose, message.pose.pose.position, message.pose.pose.orientation)
    message.pose.covariance = covariance.reshape(36)
    return message


def grid_message(stamp_ns: int, frame: str, grid: Grid) -> OccupancyGrid:
    """A map from above, whose cells lie on the plane z = 0 of the map."""
    message = OccupancyGrid(header=header_of(stamp_ns, frame))
    message.info.map_load_time = stamp_of(stamp_ns)
    message.info.resolution = float(grid.cell_m)
    message.info.height, message.info.width = grid.occupied.shape
    message.info.origin.position.x, message.info.origin.position.y = (float(of) for of in grid.origin_m)
    message.info.origin.orientation.w = 1.0
    message.data = array("b", grid_cells(grid).tobytes())
    return message


def centers_message(stamp_ns: int, frame: str, centers_m: NDArray[np.float32]) -> PointCloud2:
    """Points, shape (n, 3), as a cloud."""
    data = np.ascontiguousarray(centers_m, "<f4")
    fields = [PointField(name=name, offset=4 * axis, datatype=PointField.FLOAT32, count=1) for axis, name in enumerate("xyz")]
    return PointCloud2(
        header=header_of(stamp_ns, frame),
        height=1,
        width=len(data),
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=data.nbytes,
        data=array("B", data.tobytes()),
        is_dense=True,
    )


def octomap_message(make: Any, stamp_ns: int, frame: str, resolution_m: float, data: bytes) -> Any:
    """A binary octree; `make` is `octomap_msgs.msg.Octomap`."""
    return make(header=header_of(stamp_ns, frame), binary=True, id="OcTree", resolution=resolution_m, data=array("b", data))


LEVELS = {"ok": DiagnosticStatus.OK, "warn": DiagnosticStatus.WARN, "error": DiagnosticStatus.ERROR}


def diagnostics_message(
    stamp_ns: int, hardware: str, statuses: Sequence[tuple[str, str, str, Mapping[str, object]]]
) -> DiagnosticArray:
    """Diagnostics of statuses: name, level (ok, warn, error), sentence, values."""
    message = DiagnosticArray(header=header_of(stamp_ns, ""))
    for name, level, text, values in statuses:
        pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        message.status.append(DiagnosticStatus(level=LEVELS[level], name=name, message=text, hardware_id=hardware, values=pairs))
    return message


def _write(pose: Pose, place: Any, turn: Any) -> None:
    place.x, place.y, place.z = pose.translation_m.tolist()
    turn.x, turn.y, turn.z, turn.w = pose.rotation_xyzw.tolist()
