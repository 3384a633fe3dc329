"""Which places no path can join: a proof by flooding a lattice of voxels."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from checker import Places


@dataclass
class Reach:
    """Which places cannot be reached from each other, proved on a lattice of the map's voxels.

    A cell of the lattice is closed where the body fits nowhere in it. What two places have to pass closed cells for, no path
    joins. The converse does not hold: cells that touch may be joined by no path.
    """

    labels: NDArray[np.int32]
    low: NDArray[np.int64]
    resolution_m: float

    @staticmethod
    def of(
        voxels: NDArray[np.int64], resolution_m: float, spheres: NDArray[np.float32], low: Places, high: Places
    ) -> "Reach":
        first = np.floor(low / resolution_m).astype(np.int64)
        size = np.ceil(high / resolution_m).astype(np.int64) - first
        margin = int(np.ceil(np.abs(spheres).sum(1).max() / resolution_m)) + 1
        within = ((voxels >= first - margin) & (voxels < first + size + margin)).all(1)
        is_free = np.ones(size + 2 * margin, np.bool_)
        is_free[tuple((voxels[within] - first + margin).T)] = False
        distances_m = ndimage.distance_transform_edt(is_free, sampling=resolution_m)
        is_open = np.ones(size, np.bool_)
        for sphere in spheres.astype(np.float64):
            offset = np.rint(sphere[:3] / resolution_m).astype(int)
            begin = offset + margin
            moved = distances_m[tuple(slice(first, first + length) for first, length in zip(begin, size))]
            # The sphere's center is at most half a cell's diagonal and what was rounded away from the center of the cell that is
            # looked up, and a voxel reaches half a side from its center in any direction.
            rounded_m = float(np.linalg.norm(sphere[:3] - offset * resolution_m))
            is_open &= moved > sphere[3] - (np.sqrt(3) / 2 - 0.5) * resolution_m - rounded_m
        labels, _ = ndimage.label(is_open, np.ones((3, 3, 3)))
        return Reach(labels, first, resolution_m)

    def are_apart(self, start: Places, goal: Places) -> bool:
        """Whether no path joins two places."""
        labels = [self.labels[tuple(self._cell(place))] for place in (start, goal)]
        return 0 in labels or labels[0] != labels[1]

    def _cell(self, place: Places) -> NDArray[np.int64]:
        cell = np.floor(place / self.resolution_m).astype(np.int64) - self.low
        return np.clip(cell, 0, np.array(self.labels.shape) - 1)
