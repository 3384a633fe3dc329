"""The poses of accepted scans."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arguments import word_of
from .._arrays import F64, whole_of
from .._fields import Fields
from ..pose import Pose, pose_in
from ..version import Version, Versioned
from .handle import MapHandle


@dataclass(frozen=True, eq=False)
class MappedScan:
    """An accepted scan, and where it was taken."""

    robot: str
    session: str
    scan_id: int | None
    timestamp_ns: int | None
    map_from_sensor: Pose
    revision: int
    """The revision that it made."""
    overlap: float
    new_voxels: int
    carved_voxels: int


@dataclass(frozen=True, eq=False)
class Trajectory(Versioned):
    """The poses of accepted scans, ascending by revision."""

    scans: tuple[MappedScan, ...]
    next_since_revision: int | None
    """Where the next page begins, of a page after which there is more."""

    def __len__(self) -> int:
        return len(self.scans)

    @property
    def positions_m(self) -> F64:
        """Where the sensor was, shape (n, 3)."""
        return np.array([scan.map_from_sensor.translation_m for scan in self.scans]).reshape(-1, 3)

    @property
    def matrices(self) -> F64:
        """The poses, `map_from_sensor`, shape (n, 4, 4)."""
        return np.array([scan.map_from_sensor.matrix for scan in self.scans]).reshape(-1, 4, 4)


class TrajectoryOperations(MapHandle):
    """Trajectories."""

    def trajectory(self, *, robot: str | None = None, since_revision: int = 0, limit: int | None = None) -> Trajectory:
        """The poses of accepted scans: of all robots or of one `robot`, after `since_revision`, all of them or `limit` at most.

        Raises `InvalidArgument` (`page_too_large`).
        """
        fields = self._get_fields(
            "trajectory",
            robot=None if robot is None else word_of(robot, "robot"),
            since_revision=whole_of(since_revision, "since_revision"),
            limit=None if limit is None else whole_of(limit, "limit"),
        )
        scans = tuple(_scan(of) for of in fields.objects("poses"))
        return self._noted(Trajectory(Version.of(fields), scans, fields.optional("next_since_revision", fields.whole)))


def _scan(fields: Fields) -> MappedScan:
    return MappedScan(
        robot=fields.text("robot"),
        session=fields.text("session"),
        scan_id=fields.optional("scan_id", fields.whole),
        timestamp_ns=fields.optional("timestamp_ns", fields.whole),
        map_from_sensor=pose_in(fields, "map_from_sensor"),
        revision=fields.whole("revision"),
        overlap=fields.number("overlap"),
        new_voxels=fields.whole("new_voxels"),
        carved_voxels=fields.whole("carved_voxels"),
    )
