"""What a map is: its settings, its levels, who sent its scans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._fields import F64, Fields
from ..errors import BadAnswer
from ..pose import Pose, pose_in
from ..version import Version, Versioned
from .handle import MapHandle


@dataclass(frozen=True)
class FilterSettings:
    """The settings of counting Bloom filters."""

    hashes: int
    bits_per_key: float


@dataclass(frozen=True)
class Level:
    """One level of a map, 0 the finest. Rates and bytes are those of its filter, None in a map without filters."""

    level: int
    resolution_m: float
    voxels: int
    plane_bytes: int | None
    counter_bytes: int | None
    expected_false_positive_rate: float | None
    ideal_false_positive_rate: float | None
    measured_false_positive_rate: float | None


@dataclass(frozen=True, eq=False)
class Sighting:
    """A robot as its last scan showed it."""

    robot: str
    seen_at_ns: int
    timestamp_ns: int | None
    map_from_sensor: Pose
    verdict: str
    stationary: bool


@dataclass(frozen=True)
class Storage:
    """What of a map lies on disk."""

    durable_revision: int
    snapshot_revision: int
    undo_from_revision: int
    """Changes from this revision on can be undone."""
    read_only: str | None
    """Why the map takes no changes."""


@dataclass(frozen=True, eq=False)
class MapInfo(Versioned):
    """A map's description."""

    name: str
    resolution_m: float
    """The side of a voxel of level 0."""
    filter: FilterSettings | None
    moments: bool
    """Whether scans are aligned to surfaces; without moments by overlap alone."""
    origin_m: F64 | None
    """Where the map's origin lies in the frame of a survey, x y z: a place p of the map is at p + origin_m there."""
    levels: tuple[Level, ...]
    """The levels, finest first."""
    scans: int
    """Scans that were accepted and not undone."""
    poses: int | None
    """Those of them whose poses are kept: a server thins old poses, unless its `store.keep_trajectory` is `all`. None of a server
    that does not tell, from before it counted them."""
    robots: tuple[str, ...]
    sightings: tuple[Sighting, ...]
    asleep: bool
    """Whether the map is not in memory: what is told of it is from when it left, and the next request opens it."""
    set_bytes: int
    moment_bytes: int
    trajectory_bytes: int
    viewpoints: int
    viewpoint_bytes: int
    storage: Storage | None
    """None of a map in memory only."""

    @property
    def voxels(self) -> NDArray[np.int64]:
        """How many voxels each level has, shape (levels,)."""
        return np.array([level.voxels for level in self.levels], np.int64)


class DescriptionOperations(MapHandle):
    """Descriptions."""

    def describe(self) -> MapInfo:
        """The map's settings, size, robots and storage.

        Raises `NotFound` (`map_not_found`).
        """
        return self._noted(map_info(self._get_fields()))


def map_info(fields: Fields) -> MapInfo:
    """The description of a map in an answer."""
    settings = fields.object("settings")
    return MapInfo(
        version=Version.of(fields),
        name=fields.text("map"),
        resolution_m=settings.number("resolution_m"),
        filter=_filter(settings),
        moments=settings.flag("moments"),
        origin_m=settings.numbers("origin_m", (3,)) if settings.has("origin_m") else None,
        levels=tuple(_level(of) for of in fields.objects("levels")),
        scans=fields.whole("scans"),
        poses=fields.whole("poses") if fields.has("poses") else None,
        robots=fields.texts("robots"),
        sightings=tuple(_sighting(of) for of in fields.objects("sightings")) if fields.has("sightings") else (),
        asleep=fields.flag("asleep"),
        set_bytes=fields.whole("set_bytes"),
        moment_bytes=fields.whole("moment_bytes"),
        trajectory_bytes=fields.whole("trajectory_bytes"),
        viewpoints=fields.whole("viewpoints"),
        viewpoint_bytes=fields.whole("viewpoint_bytes"),
        storage=_storage(fields.object("storage")) if fields.has("storage") else None,
    )


def _filter(settings: Fields) -> FilterSettings | None:
    try:
        if settings.text("filter") == "none":
            return None
    except BadAnswer:
        pass
    of = settings.object("filter")
    return FilterSettings(of.whole("hashes"), of.number("bits_per_key"))


def _level(fields: Fields) -> Level:
    rates: dict[str, Any] = {
        name: fields.optional(name, fields.number)
        for name in ("expected_false_positive_rate", "ideal_false_positive_rate", "measured_false_positive_rate")
    }
    return Level(
        level=fields.whole("level"),
        resolution_m=fields.number("resolution_m"),
        voxels=fields.whole("voxels"),
        plane_bytes=fields.optional("plane_bytes", fields.whole),
        counter_bytes=fields.optional("counter_bytes", fields.whole),
        **rates,
    )


def _sighting(fields: Fields) -> Sighting:
    return Sighting(
        robot=fields.text("robot"),
        seen_at_ns=fields.whole("seen_at_ns"),
        timestamp_ns=fields.optional("timestamp_ns", fields.whole),
        map_from_sensor=pose_in(fields, "map_from_sensor"),
        verdict=fields.text("verdict"),
        stationary=fields.flag("stationary"),
    )


def _storage(fields: Fields) -> Storage:
    return Storage(
        fields.whole("durable_revision"),
        fields.whole("snapshot_revision"),
        fields.whole("undo_from_revision"),
        fields.optional("read_only", fields.text),
    )
