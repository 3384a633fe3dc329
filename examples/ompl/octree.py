"""The same questions to an octree of FCL (its successor, PyPI `coal`): what planners use without a map server."""

from functools import cache

import coal
import numpy as np
from numpy.typing import NDArray

from checker import Bools, Places, padding_between_checks


class OctreeChecker:
    """Checks a body against the voxels of a map in an octree, at steps of half a voxel.

    A ball around the body is asked first: where it is free, so is the body.
    """

    def __init__(self, voxels: NDArray[np.int64], resolution_m: float, spheres: NDArray[np.float32]) -> None:
        self.step_m = resolution_m / 2
        self.tree = coal.CollisionObject(coal.makeOctree((voxels + 0.5) * resolution_m, resolution_m))
        padded = spheres.astype(np.float64)
        padded[:, 3] += padding_between_checks(self.step_m)
        self.offsets = padded[:, :3]
        self.parts = [coal.CollisionObject(coal.Sphere(radius)) for radius in padded[:, 3]]
        around = float((np.linalg.norm(self.offsets, axis=1) + padded[:, 3]).max())
        self.ball = coal.CollisionObject(coal.Sphere(around))
        self.request, self.result = coal.CollisionRequest(), coal.CollisionResult()

    def places_fit(self, places: Places) -> Bools:
        return np.array([self._fits(place) for place in places])

    def motions_fit(self, motions: Places) -> Bools:
        return np.array([self._motion_fits(start, end) for start, end in motions])

    def _motion_fits(self, start: Places, end: Places) -> bool:
        count = max(int(np.ceil(np.linalg.norm(end - start) / self.step_m)), 1)
        return all(self._fits(start + (end - start) * (i / count)) for i in bisecting(count))

    def _fits(self, place: Places) -> bool:
        if not self._meets(self.ball, place):
            return True
        return not any(self._meets(part, place + offset) for part, offset in zip(self.parts, self.offsets))

    def _meets(self, part: coal.CollisionObject, center: Places) -> bool:
        part.setTranslation(center)
        part.computeAABB()
        self.result.clear()
        return coal.collide(self.tree, part, self.request, self.result) > 0


@cache
def bisecting(count: int) -> list[int]:
    """0 to count, the ends first, then the middles of what is left: so OMPL's own validator goes along an edge."""
    order, gaps = [count, 0], [(0, count)]
    for first, last in gaps:
        middle = (first + last) // 2
        if first < middle:
            order.append(middle)
            gaps += [(first, middle), (middle, last)]
    return order
