"""What the map looks like, on change."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event, Thread

import mrol
import numpy as np
from mrol import Grid
from numpy.typing import NDArray

from .octree import FREE, OCCUPIED, Leaves, octree_data
from .options import Options
from .own_scans import OwnScans
from .server_link import ServerLink
from .texts import shown
from .voxel_set import VoxelSet

PAUSE_S = 1.0
"""How long it waits after the server was not reached."""

TICK_S = 0.1

CLOSE_MAX_S = 2.0
"""How long threads may take to end: one that waits for the server ends with the process."""

CLASSIFIED_MAX = 2_000_000
"""Places that are asked for whether they are free, at most."""


@dataclass(frozen=True, eq=False)
class MapVoxels:
    """The occupied voxels of a level, and the free ones of a coarser level where they were asked for."""

    revision: int
    resolution_m: float
    occupied: NDArray[np.int32]
    """Indices i j k, shape (n, 3)."""
    free: NDArray[np.int32]
    free_level: int
    """Levels above that of the occupied voxels."""

    @property
    def centers_m(self) -> NDArray[np.float32]:
        """The centers of the occupied voxels in the map frame, shape (n, 3)."""
        return ((self.occupied + 0.5) * self.resolution_m).astype(np.float32)

    def octree(self) -> tuple[bytes, int]:
        """The content of a binary OctoMap, and how many voxels lie outside of one."""
        free = [Leaves(self.free, self.free_level, FREE)] if len(self.free) else []
        return octree_data([Leaves(self.occupied, 0, OCCUPIED), *free])


class MapFeed:
    """Follows the map by a watch, and tells of it when it has changed and not more often than is wished."""

    def __init__(
        self,
        options: Options,
        link: ServerLink,
        on_grid: Callable[[Grid], None],
        on_voxels: Callable[[MapVoxels], None],
        wants_voxels: Callable[[], bool],
        *,
        own_scans: OwnScans,
    ) -> None:
        """`own_scans` is told of each scan that comes into the map."""
        self.error = ""
        """Why the map is not followed; empty while it is."""
        self.outside = 0
        self.voxels: MapVoxels | None = None
        """The last that was told."""
        self.grid_revision: int | None = None
        self._options = options
        self._link = link
        self._own_scans = own_scans
        self._on_grid = on_grid
        self._on_voxels = on_voxels
        self._wants_voxels = wants_voxels
        self._set = VoxelSet()
        self._closing = Event()
        self._level, self._resolution_m = 0, 0.0
        self._watch: mrol.Watch[mrol.WatchEvent] | None = None
        self._threads = [Thread(target=self._follow, daemon=True), Thread(target=self._tell, daemon=True)]

    @property
    def revision(self) -> int | None:
        """The newest revision that is known."""
        return self._set.revision

    def start(self) -> None:
        """Begins to follow."""
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Ends it, within two seconds."""
        self._closing.set()
        watch = self._watch
        if watch is not None:
            watch.close()
        end_s = time.monotonic() + CLOSE_MAX_S
        for thread in self._threads:
            thread.join(max(0.0, end_s - time.monotonic()))

    def _follow(self) -> None:
        while not self._closing.is_set():
            try:
                self._level, self._resolution_m = self._link.level()
                with self._link.map().watch(delta_level=self._level) as self._watch:
                    for event in self._watch:
                        self.error = ""
                        if isinstance(event, mrol.WatchedState | mrol.WatchedChange):
                            self._set.take(event)
                        if isinstance(event, mrol.WatchedChange) and isinstance(event.cause, mrol.WatchedScan):
                            self._own_scans.see(event.cause)
                        if self._closing.is_set():
                            return
            except mrol.MrolError as error:
                self.error = shown(str(error))
                if isinstance(error, mrol.NotFound):
                    self._link.forget_map()
            except Exception as error:
                # A defect at one event ends nothing: the map is followed anew.
                self.error = shown(f"the node failed at an event: {error!r}")
            self._closing.wait(PAUSE_S)

    def _tell(self) -> None:
        grid_at_s = voxels_at_s = 0.0
        while not self._closing.wait(TICK_S):
            revision = self._set.revision
            if revision is None:
                continue
            try:
                now_s = time.monotonic()
                if (
                    self._options.publish_grid
                    and revision != self.grid_revision
                    and now_s - grid_at_s >= self._options.grid_period_s
                ):
                    grid_at_s = now_s
                    self._tell_grid()
                told = None if self.voxels is None else self.voxels.revision
                if revision != told and now_s - voxels_at_s >= self._options.octomap_period_s and self._wants_voxels():
                    voxels_at_s = now_s
                    self.voxels = self.read_voxels()
                    self._on_voxels(self.voxels)
            except mrol.MrolError as error:
                self.error = shown(str(error))
            except Exception as error:
                self.error = shown(f"the node failed at a map: {error!r}")

    def _tell_grid(self) -> None:
        # What has changed while it is drawn is drawn again.
        before = self._set.revision
        if len(self._set.indices()) == 0:
            return
        options = self._options
        grid = self._link.map().whole_grid(
            min_z_m=options.occupancy_min_z,
            max_z_m=options.occupancy_max_z,
            band_from=options.occupancy_z_from,  # type: ignore[arg-type]
            tell_unknown=True,
            level=self._level,
        )
        self._on_grid(grid)
        self.grid_revision = before

    def read_voxels(self) -> MapVoxels:
        """The voxels as they are now.

        Raises `mrol.MrolError`, also before anything is known.
        """
        revision, occupied = self._set.revision, self._set.indices()
        if revision is None:
            raise mrol.MrolError("nothing is known of the map yet")
        free_level = self._options.octomap_free_level - self._level
        free = np.zeros((0, 3), np.int32)
        if self._options.octomap_free_level >= 0 and free_level >= 0 and len(occupied):
            free = self._free(occupied, free_level)
        return MapVoxels(revision, self._resolution_m, occupied, free, max(free_level, 0))

    def _free(self, occupied: NDArray[np.int32], free_level: int) -> NDArray[np.int32]:
        """The free voxels of a coarser level around the occupied ones."""
        low, high = (occupied.min(axis=0) >> free_level), (occupied.max(axis=0) >> free_level) + 1
        if math.prod((high - low).tolist()) > CLASSIFIED_MAX:
            raise mrol.MrolError(f"octomap_free_level must be coarser: the map has more than {CLASSIFIED_MAX} voxels of that level")
        axes = [np.arange(begin, end, dtype=np.int32) for begin, end in zip(low, high, strict=True)]
        indices = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        side_m = self._resolution_m * (1 << free_level)
        told = self._link.map().classify(((indices + 0.5) * side_m).astype(np.float32), level=self._level + free_level)
        free: NDArray[np.int32] = indices[told.free]
        return free
