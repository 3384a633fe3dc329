"""What a planner asks of a map, and the body that it asks for."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Places = NDArray[np.float64]
"""Rows of x y z, meters in the map frame."""
Bools = NDArray[np.bool_]

DRONE: NDArray[np.float32] = np.array(
    [
        [0.00, 0.00, 0.00, 0.12],
        [0.00, 0.00, -0.09, 0.08],
        [0.16, 0.16, 0.03, 0.11],
        [0.16, -0.16, 0.03, 0.11],
        [-0.16, 0.16, 0.03, 0.11],
        [-0.16, -0.16, 0.03, 0.11],
    ],
    np.float32,
)
"""A quadrotor of 0.54 m by 0.54 m by 0.31 m that keeps its heading: spheres, rows of x y z and radius in meters."""


class Checker(Protocol):
    """Answers whether a body fits into a map: at places, and along straight motions between them."""

    def places_fit(self, places: Places) -> Bools:
        """Whether the body fits at each of n places, an array of n by 3."""
        ...

    def motions_fit(self, motions: Places) -> Bools:
        """Whether the body fits all along each of n motions, an array of n by 2 by 3: from where, to where."""
        ...


def padding_between_checks(step_m: float) -> float:
    """The padding by which a motion that is free where it is checked is free in between, meters.

    No point of the body moves by more than `step_m` from one check to the next, so it is never farther than half of that from
    where it was at a check.
    """
    return step_m / 2
