"""Which scans touched a voxel."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from .._arguments import level_of
from .._arrays import numbers_text, vector_of
from .._fields import Fields, reading
from ..errors import ArgumentError, excerpt
from ..pose import Pose, pose_in
from ..version import Version, Versioned
from .handle import MapHandle


@dataclass(frozen=True, eq=False)
class ObservingScan:
    """A scan that put a point into a voxel."""

    revision: int
    robot: str
    session: str
    scan_id: int | None
    timestamp_ns: int | None
    map_from_sensor: Pose


@dataclass(frozen=True, eq=False)
class Observers(Versioned):
    """The scans that touched a voxel, the newest first."""

    voxel: tuple[int, int, int]
    scans: tuple[ObservingScan, ...]
    older_scans: bool
    """Whether there are older ones, or may be."""


class ObserverOperations(MapHandle):
    """Observers of a voxel."""

    def observers(self, point: ArrayLike | None = None, *, voxel: ArrayLike | None = None, level: int = 0) -> Observers:
        """The scans that put a point into the voxel at `point` (x y z, meters), or into `voxel` i j k.

        `level` is that of the voxel, 0 the finest.

        Raises `FailedPrecondition` (`no_journal`: the server keeps maps in memory only).
        """
        if (point is None) == (voxel is None):
            raise ArgumentError("point", "both or neither of point and voxel", "the only one of them")
        fields = self._get_fields(
            "observers",
            point=None if point is None else numbers_text(vector_of(point, 3, "point", is_finite=True)),
            voxel=None if voxel is None else numbers_text(_index(voxel)),
            level=level_of(level),
        )
        with reading("voxel"):
            i, j, k = (int(of) for of in fields.numbers("voxel", (3,)))
        scans = tuple(_scan(of) for of in fields.objects("scans"))
        return self._noted(Observers(Version.of(fields), (i, j, k), scans, fields.flag("older_scans")))


def _index(voxel: ArrayLike) -> list[float]:
    numbers = vector_of(voxel, 3, "voxel", is_finite=True)
    if any(number != int(number) for number in numbers):
        raise ArgumentError("voxel", excerpt(voxel), "the index i j k of a voxel, whole numbers")
    return numbers


def _scan(fields: Fields) -> ObservingScan:
    return ObservingScan(
        revision=fields.whole("revision"),
        robot=fields.text("robot"),
        session=fields.text("session"),
        scan_id=fields.optional("scan_id", fields.whole),
        timestamp_ns=fields.optional("timestamp_ns", fields.whole),
        map_from_sensor=pose_in(fields, "map_from_sensor"),
    )
