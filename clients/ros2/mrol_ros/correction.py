"""Where the odometry's frame is in the map, and what is known of the robot's pose."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock

import numpy as np
from mrol import Pose
from numpy.typing import NDArray

AHEAD_MAX_NS = 1_000_000_000
"""A cloud's stamp counts up to so far ahead of the clock, nanoseconds."""

OPEN_VARIANCE = 1e6
"""The variance of a direction that the map leaves open, m^2 or rad^2."""

ROUNDING = 1e-6
"""How far correlations may be from what they can be."""

LEAST_STD = np.array([0.5, 0.5, 0.5, 0.1, 0.1, 0.26])
"""For directions of a pose whose variance is 0, which means "not told": m along x y z, then rad. RViz tells x, y and yaw alone."""


@dataclass(frozen=True, eq=False)
class StampedCorrection:
    """Where the odometry's frame is in the map, with the time until which that is to be believed."""

    stamp_ns: int
    map_from_odom: Pose


class Correction:
    """The newest `map_from_odom`, and the stamps with which it is published.

    Each stamp is later than the one before, whatever the clock does: a buffer of tf that has a later transform ignores an earlier
    one for what is asked next. Threads may share it.
    """

    def __init__(self, tolerance_ns: int) -> None:
        self._tolerance_ns = tolerance_ns
        self._lock = Lock()
        self._map_from_odom: Pose | None = None
        self._stamp_ns: int | None = None
        self.ahead_ns = 0
        """How far the last cloud's stamp is ahead of the clock; 0 where it is not, or by less than a second."""

    def update(self, stamp_ns: int, map_from_sensor: Pose, odom_from_sensor: Pose, now_ns: int = 0) -> StampedCorrection:
        """Takes the pose that the server found for the cloud of a stamp, and where odometry has the sensor at that time.

        `now_ns` is the time by the clock, and 0 where nobody tells it.
        """
        with self._lock:
            self._map_from_odom = map_from_sensor @ odom_from_sensor.inverse()
            ahead_ns = stamp_ns - now_ns
            self.ahead_ns = ahead_ns if now_ns > 0 and ahead_ns > AHEAD_MAX_NS else 0
            if self.ahead_ns:
                # A stamp of next year would hold for a year, since stamps never go back.
                stamp_ns = now_ns + AHEAD_MAX_NS
            return self._next(stamp_ns + self._tolerance_ns)

    def keep_alive(self, now_ns: int, period_ns: int) -> StampedCorrection | None:
        """The same again where its stamp ends within `period_ns` from now; None where it does not, and before the first.

        So the map's frame stays while no cloud is answered.
        """
        with self._lock:
            if self._map_from_odom is None or self._stamp_ns is None or self._stamp_ns >= now_ns + period_ns:
                return None
            return self._next(now_ns + self._tolerance_ns)

    def clock_was_set_back(self) -> None:
        """Lets stamps begin anew, earlier than before."""
        with self._lock:
            self._stamp_ns = 0 if self._stamp_ns is not None else None

    def forget(self) -> None:
        """Publishes nothing more until there is another pose."""
        with self._lock:
            self._map_from_odom = None

    def _next(self, stamp_ns: int) -> StampedCorrection:
        assert self._map_from_odom is not None
        self._stamp_ns = stamp_ns if self._stamp_ns is None else max(stamp_ns, self._stamp_ns + 1)
        return StampedCorrection(self._stamp_ns, self._map_from_odom)


def covariance_of(information: NDArray[np.float64], lever_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """The covariance of a pose whose origin is `lever_m` away from the sensor's, along the map's axes; shape (6, 6).

    `information` is the inverse covariance of the sensor's pose: x y z in meters, then turns in radians, along the map's axes. A
    direction that it leaves open has a variance of 1e6.
    """
    values, vectors = np.linalg.eigh((information + information.T) / 2)
    variances = 1 / np.maximum(values, 1 / OPEN_VARIANCE)
    return moved_covariance((vectors * variances) @ vectors.T, lever_m)


def moved_covariance(covariance: NDArray[np.float64], lever_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """The covariance of the pose of a point of the same body that lies `lever_m` away, along the map's axes."""
    x, y, z = lever_m
    jacobian = np.eye(6)
    # d(turn x lever) / d(turn)
    jacobian[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    moved: NDArray[np.float64] = jacobian @ covariance @ jacobian.T
    return (moved + moved.T) / 2


def guess_covariance(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """The covariance of an initial pose as somebody gave it, where directions without a variance get one."""
    told = np.array(covariance, np.float64).reshape(6, 6)
    variances = np.diag(told).copy()
    if not np.isfinite(told).all() or (variances < 0).any():
        raise ValueError("the covariance of an initial pose must be 36 finite numbers with variances of 0 or more")
    is_open = variances == 0
    told[is_open, :] = 0
    told[:, is_open] = 0
    told[np.diag_indices(6)] = np.where(is_open, LEAST_STD**2, variances)
    scale = np.sqrt(np.diag(told))
    correlation = told / np.outer(scale, scale)
    if np.abs(correlation - correlation.T).max() > ROUNDING or np.linalg.eigvalsh(correlation)[0] < -ROUNDING:
        raise ValueError("the covariance of an initial pose must be symmetric, with correlations that can be")
    return told
