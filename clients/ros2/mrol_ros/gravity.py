"""The direction of gravity by an accelerometer."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from mrol import Pose
from numpy.typing import NDArray

WINDOW_NS = 200_000_000
"""Accelerations are averaged over so long before a cloud, nanoseconds."""

KEPT_MAX = 2000
G = 9.80665
TOLERANCE = 0.03
"""How far the length may be from 1 g, as a share of it."""


class GravityWindow:
    """The last accelerations that were measured."""

    def __init__(self) -> None:
        self._accelerations: deque[tuple[int, tuple[float, ...]]] = deque(maxlen=KEPT_MAX)

    def note(self, stamp_ns: int, acceleration: Sequence[float]) -> None:
        """Notes what the accelerometer reads, x y z in its own frame."""
        self._accelerations.append((stamp_ns, tuple(acceleration)))

    def reaches(self, stamp_ns: int) -> bool:
        """Whether the accelerometer was heard of at a time or later."""
        return bool(self._accelerations) and self._accelerations[-1][0] >= stamp_ns

    def at(self, stamp_ns: int, sensor_from_imu: Pose) -> NDArray[np.float64] | None:
        """The direction in which things fall, in the sensor frame, before a time; None unless it reads 1 g, in m/s^2 or in g."""
        near = [of for at_ns, of in list(self._accelerations) if 0 <= stamp_ns - at_ns <= WINDOW_NS]
        if not near:
            return None
        up = np.mean(near, axis=0)
        length = float(np.linalg.norm(up))
        if not any(abs(length / one_g - 1) <= TOLERANCE for one_g in (G, 1.0)):
            return None
        down: NDArray[np.float64] = sensor_from_imu.matrix[:3, :3] @ -up
        return down
