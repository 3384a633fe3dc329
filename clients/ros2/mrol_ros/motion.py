"""Motions at constant velocity."""

from __future__ import annotations

import math

import numpy as np
from mrol import Pose

SMALL_ANGLE_RAD = 1e-5
"""Below this angle the first terms of the series are exact to the last digit."""

EXTRAPOLATION_SHARE_MAX = 10.0
"""A motion is continued by at most so many times its length."""


def share_of_motion(motion: Pose, share: float) -> Pose:
    """The part of a motion (`before_from_after`) that a body has made after a `share` of the time, if its velocity is constant."""
    turn = _scaled_axis(motion)
    linear = np.linalg.solve(_left(turn), motion.translation_m)
    part = turn * share
    return _pose(_left(part) @ (linear * share), part)


def extrapolate(before: Pose, last: Pose, share: float) -> Pose:
    """`last`, moved on by a `share` of the way from `before` to it: translation and turn, each along its own axis."""
    share = min(max(share, -EXTRAPOLATION_SHARE_MAX), EXTRAPOLATION_SHARE_MAX)
    motion = before.inverse() @ last
    return last @ _pose(motion.translation_m * share, _scaled_axis(motion) * share)


def _scaled_axis(motion: Pose) -> np.ndarray:
    vector, scalar = motion.rotation_xyzw[:3], float(motion.rotation_xyzw[3])
    if scalar < 0:
        vector, scalar = -vector, -scalar
    length = float(np.linalg.norm(vector))
    return vector * (2.0 if length < SMALL_ANGLE_RAD else 2 * math.atan2(length, scalar) / length)


def _left(turn: np.ndarray) -> np.ndarray:
    """The matrix that takes a constant velocity to the translation that it makes while the body turns by `turn`."""
    x, y, z = turn
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = float(np.linalg.norm(turn))
    if angle < SMALL_ANGLE_RAD:
        first, second = 0.5, 1 / 6
    else:
        first, second = (1 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3
    return np.eye(3) + cross * first + cross @ cross * second


def _pose(translation_m: np.ndarray, turn: np.ndarray) -> Pose:
    angle = float(np.linalg.norm(turn))
    factor = 0.5 if angle < SMALL_ANGLE_RAD else math.sin(angle / 2) / angle
    quaternion = np.append(turn * factor, math.cos(angle / 2))
    return Pose(translation_m, quaternion / np.linalg.norm(quaternion))
