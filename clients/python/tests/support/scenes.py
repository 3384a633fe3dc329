"""Points of a simulated room, as a sensor in it sees them."""

import numpy as np
from numpy.typing import NDArray

HALF_M = np.array([4.0, 3.0, 1.5])
"""The room's walls, floor and ceiling are so far from its middle, the origin of the map."""

POST = np.array([1.5, 1.0])
"""A post stands in it, which makes it look different from each side."""


def room(sensor: tuple[float, float, float] = (0.0, 0.0, 0.0), count: int = 60_000, seed: int = 1) -> NDArray[np.float32]:
    """A scan of the room, in the frame of a sensor that is not turned."""
    rng = np.random.default_rng(seed)
    walls = rng.uniform(-1, 1, (count, 3))
    axis = rng.integers(0, 3, count)
    walls[np.arange(count), axis] = rng.choice([-1, 1], count)
    post = rng.uniform(-1, 1, (count // 8, 3)) * [0.2, 0.3, 1.5]
    post[:, 0] = np.sign(post[:, 0]) * 0.2
    post[:, :2] += POST
    points = np.concatenate([walls * HALF_M, post])
    return (points + rng.normal(0, 0.003, points.shape) - sensor).astype(np.float32)
