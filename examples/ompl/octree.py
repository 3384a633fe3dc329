"""The same questions to an octree of FCL (its successor, PyPI `coal`): what planners use without a map server."""

from collections.abc import Callable

import coal
import numpy as np
from numpy.typing import NDArray

from checker import Bools, Places, padding_between_checks


class OctreeChecker:
    """Checks a body against the voxels of a map in an octree.

    A sphere that moves along a line sweeps a capsule, which is one question to the octree: several times as quick as steps, but for
    bodies alone that do not turn. First comes a sphere around the whole body: where that is free, so is the body. The padding is
    that of the other checkers, so that all answer alike.
    """

    def __init__(self, voxels: NDArray[np.int64], resolution_m: float, spheres: NDArray[np.float32]) -> None:
        self.tree = coal.makeOctree((voxels + 0.5) * resolution_m, resolution_m)
        self.tree_pose = coal.Transform3s()
        padded = spheres.astype(np.float64)
        padded[:, 3] += padding_between_checks(resolution_m / 2)
        self.around_m = float((np.linalg.norm(padded[:, :3], axis=1) + padded[:, 3]).max())
        self.parts = [(part[:3], float(part[3])) for part in padded]
        self.request, self.result = coal.CollisionRequest(), coal.CollisionResult()

    def places_fit(self, places: Places) -> Bools:
        return np.array([self._fits(np.eye(3), place, coal.Sphere) for place in places])

    def motions_fit(self, motions: Places) -> Bools:
        return np.array([self._motion_fits(start, end) for start, end in motions])

    def _motion_fits(self, start: Places, end: Places) -> bool:
        length_m = float(np.linalg.norm(end - start))
        if length_m == 0:
            return self._fits(np.eye(3), start, coal.Sphere)
        rotation = rotation_to((end - start) / length_m)
        return self._fits(rotation, (start + end) / 2, lambda radius: coal.Capsule(radius, length_m))

    def _fits(self, rotation: Places, center: Places, shape: Callable[[float], coal.ShapeBase]) -> bool:
        """Whether the body does not meet the map, its spheres given other shapes."""
        if not self._meets(shape(self.around_m), rotation, center):
            return True
        return not any(self._meets(shape(radius), rotation, center + offset) for offset, radius in self.parts)

    def _meets(self, shape: coal.ShapeBase, rotation: Places, center: Places) -> bool:
        self.result.clear()
        pose = coal.Transform3s(rotation, center)
        return coal.collide(self.tree, self.tree_pose, shape, pose, self.request, self.result) > 0


def rotation_to(direction: Places) -> Places:
    """A rotation that carries the z axis, along which capsules lie, into a direction."""
    across = np.eye(3)[np.argmin(np.abs(direction))]
    x = np.cross(across, direction)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(direction, x), direction], 1)
