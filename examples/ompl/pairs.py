"""Where to plan from and to: places where the body fits, in parts of the map that some sensor has seen into."""

import numpy as np
from numpy.typing import NDArray

from checker import Bools, Checker, Places
from server import ServedMap

DISTANCE_MIN_M = 3.0
"""From a start to its goal, at least."""
TRIES_AT_ONCE = 2000
SENSORS_ASKED = 6


def region_of(voxels: NDArray[np.int64], resolution_m: float, spheres: NDArray[np.float32]) -> tuple[Places, Places]:
    """Low and high corner of the box in which a body may be placed.

    All of the body stays where nearly all of the map is: what a few rays found through a window is left out.
    """
    low, high = np.percentile(voxels, [1, 99], axis=0)
    below = (spheres[:, :3] - spheres[:, 3:]).min(0)
    above = (spheres[:, :3] + spheres[:, 3:]).max(0)
    return low * resolution_m - below, (high + 1) * resolution_m - above


def draw_pairs(served: ServedMap, checker: Checker, low: Places, high: Places, count: int, seed: int) -> Places:
    """So many random pairs of start and goal, an array of n by 2 by 3."""
    random = np.random.default_rng(seed)
    sensors = served.sensor_places()
    pairs: Places = np.empty((0, 2, 3))
    while len(pairs) < count:
        tries = random.uniform(low, high, (TRIES_AT_ONCE, 3))
        tries = tries[checker.places_fit(tries)]
        tries = tries[_are_seen(served, sensors, tries, random)]
        drawn = tries[: len(tries) // 2 * 2].reshape(-1, 2, 3)
        apart = np.linalg.norm(drawn[:, 0] - drawn[:, 1], axis=1) >= DISTANCE_MIN_M
        pairs = np.concatenate([pairs, drawn[apart]])
    return pairs[:count]


def _are_seen(served: ServedMap, sensors: Places, places: Places, random: np.random.Generator) -> Bools:
    """Whether a place is in sight of one of some sensors, which are drawn."""
    seen = np.zeros(len(places), np.bool_)
    for _ in range(SENSORS_ASKED):
        seen |= served.rays_are_free(sensors[random.integers(len(sensors), size=len(places))], places)
    return seen
