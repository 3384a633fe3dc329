"""A second opinion on paths, by brute force in numpy: it shares no code with the map server.

A path is walked in steps of less than a quarter of a voxel. At each step the distance from every sphere's center to every cube
of an occupied voxel near it is computed; boxes of voxels only tell which ones are near.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from checker import Places

STEPS_PER_VOXEL = 5
BOX_VOXELS = 8
STEPS_AT_ONCE = 16
ROOM_M = 0.25
"""Up to where clearances are told."""


@dataclass
class Contact:
    """Where a path comes nearest to the map."""

    clearance_m: float
    """From the surface of the nearest sphere to the nearest cube, at most ROOM_M; below 0 where they overlap."""
    place: Places | None
    """Where the body is then."""


class Oracle:
    """The cubes of all occupied voxels, and the spheres of a body without any padding."""

    def __init__(self, voxels: NDArray[np.int64], resolution_m: float, spheres: NDArray[np.float32]) -> None:
        self.resolution_m = resolution_m
        self.centers = spheres[:, :3].astype(np.float64)
        self.radii = spheres[:, 3].astype(np.float64)
        self.reach_m = float((np.linalg.norm(self.centers, axis=1) + self.radii).max())
        boxes, box_of = np.unique(voxels // BOX_VOXELS, axis=0, return_inverse=True)
        order = np.argsort(box_of, kind="stable")
        ends = np.cumsum(np.bincount(box_of))
        lows = np.split(voxels[order] * resolution_m, ends[:-1])
        self.lows_of_box = {tuple(box): lows for box, lows in zip(boxes.tolist(), lows)}

    def contact(self, path: Places) -> Contact:
        """Where the body comes nearest to the map on the path."""
        nearest = Contact(ROOM_M, None)
        steps = self._steps(path)
        for begin in range(0, len(steps), STEPS_AT_ONCE):
            places = steps[begin : begin + STEPS_AT_ONCE]
            clearances = self._clearances(places)
            least = int(np.argmin(clearances))
            if clearances[least] < nearest.clearance_m:
                nearest = Contact(float(clearances[least]), places[least])
        return nearest

    def _steps(self, path: Places) -> Places:
        pieces = [path[:1]]
        for a, b in zip(path[:-1], path[1:]):
            count = int(np.linalg.norm(b - a) / self.resolution_m * STEPS_PER_VOXEL) + 1
            pieces.append(a + (b - a) * np.arange(1, count + 1)[:, None] / count)
        return np.concatenate(pieces)

    def _clearances(self, places: Places) -> NDArray[np.float64]:
        """Of the body at each place: the least distance from a sphere's surface to a cube."""
        lows = self._lows_near(places.min(0) - self.reach_m - ROOM_M, places.max(0) + self.reach_m + ROOM_M)
        if len(lows) == 0:
            return np.full(len(places), np.inf)
        centers = (places[:, None, :] + self.centers).reshape(-1, 3)
        squares = np.zeros((len(centers), len(lows)))
        for axis in range(3):
            low = lows[:, axis] - centers[:, axis, None]
            outside = np.maximum(np.maximum(low, -(low + self.resolution_m)), 0)
            squares += outside * outside
        distances = np.sqrt(squares.min(1)).reshape(len(places), -1)
        return (distances - self.radii).min(1)

    def _lows_near(self, low: Places, high: Places) -> Places:
        """The low corners of the cubes that meet a box."""
        side = self.resolution_m * BOX_VOXELS
        first, last = np.floor(low / side).astype(int), np.floor(high / side).astype(int)
        boxes = (
            (i, j, k)
            for i in range(first[0], last[0] + 1)
            for j in range(first[1], last[1] + 1)
            for k in range(first[2], last[2] + 1)
        )
        near = np.concatenate([np.empty((0, 3))] + [self.lows_of_box[box] for box in boxes if box in self.lows_of_box])
        meets = (near <= high).all(1) & (near + self.resolution_m >= low).all(1)
        return near[meets]
