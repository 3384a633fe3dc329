"""A copy of the occupied voxels of one level, by the events of a watch."""

from __future__ import annotations

from threading import Lock

import numpy as np
from mrol import WatchedChange, WatchedState
from numpy.typing import NDArray

AXIS_BITS = 21
OFFSET = 1 << (AXIS_BITS - 1)
MASK = (1 << AXIS_BITS) - 1

WAITING_MAX = 100_000
"""Changes of voxels wait until there are so many, or as many as voxels."""


class VoxelSet:
    """The occupied voxels of one level. Changes wait until somebody asks, or there are many, and then are made all at once.

    Threads may share it.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._keys = np.zeros(0, np.int64)
        self._waiting: list[tuple[NDArray[np.int64], bool]] = []
        self._count = 0
        self._revision: int | None = None

    @property
    def revision(self) -> int | None:
        """The revision that the voxels are of; None before the first event."""
        return self._revision

    @property
    def waiting(self) -> int:
        """How many changes of voxels wait."""
        return self._count

    def take(self, event: WatchedState | WatchedChange) -> None:
        """Takes the next event of a watch."""
        with self._lock:
            if isinstance(event, WatchedState):
                self._keys, self._waiting, self._count = np.unique(_keys_of(event.indices())), [], 0
            else:
                changes = [(_keys_of(event.removed()), False), (_keys_of(event.added()), True)]
                self._waiting += changes
                self._count += sum(len(keys) for keys, _ in changes)
                if self._count > max(WAITING_MAX, len(self._keys)):
                    self._make_changes()
            self._revision = event.version.revision

    def indices(self) -> NDArray[np.int32]:
        """Indices i j k of all voxels, shape (n, 3)."""
        with self._lock:
            if self._waiting:
                self._make_changes()
            keys = self._keys
        shifts = np.arange(3) * AXIS_BITS
        indices: NDArray[np.int32] = ((keys[:, None] >> shifts & MASK) - OFFSET).astype(np.int32)
        return indices

    def _make_changes(self) -> None:
        touched = np.concatenate([keys for keys, _ in self._waiting])[::-1]
        is_there = np.concatenate([np.full(len(keys), there) for keys, there in self._waiting])[::-1]
        self._waiting, self._count = [], 0
        # The last word on each voxel counts.
        keys, last = np.unique(touched, return_index=True)
        stay = np.setdiff1d(self._keys, keys, assume_unique=True)
        self._keys = np.union1d(stay, keys[is_there[last]])


def _keys_of(indices: NDArray[np.int32]) -> NDArray[np.int64]:
    x, y, z = (indices.astype(np.int64) + OFFSET).T
    keys: NDArray[np.int64] = x | y << AXIS_BITS | z << (2 * AXIS_BITS)
    return keys
