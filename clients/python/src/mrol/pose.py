"""Poses: where a frame is in another one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import F64, as_numbers
from ._fields import Fields, reading
from .errors import ArgumentError, excerpt

NORM_TOLERANCE = 1e-3
"""How far the norm of a quaternion may be from 1, and the columns of a rotation from unit vectors at right angles."""

UNIT_QUATERNION = "a unit quaternion qx qy qz qw, finite numbers of shape (4,)"

EXPECTED = "a Pose, a 4 x 4 matrix, (t, q) of x y z and qx qy qz qw, or seven numbers x y z qx qy qz qw"


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid transform. One named `a_from_b` carries points of frame b into frame a: `p_a = a_from_b.apply(p_b)`.

    `translation_m` has shape (3,), meters; `rotation_xyzw` is a unit quaternion of shape (4,), the scalar last, as in ROS and
    scipy.
    """

    translation_m: F64
    rotation_xyzw: F64

    def __post_init__(self) -> None:
        translation = _part(self.translation_m, "translation_m", "x y z in meters, finite numbers of shape (3,)", 3)
        rotation = _part(self.rotation_xyzw, "rotation_xyzw", UNIT_QUATERNION, 4)
        if not abs(float(np.linalg.norm(rotation)) - 1) <= NORM_TOLERANCE:
            raise ArgumentError("rotation_xyzw", excerpt(self.rotation_xyzw), UNIT_QUATERNION)
        # Whoever changes the arrays afterwards changes no pose.
        object.__setattr__(self, "translation_m", translation)
        object.__setattr__(self, "rotation_xyzw", rotation)

    @classmethod
    def identity(cls) -> Pose:
        """The pose of a frame in itself."""
        return cls.of([0, 0, 0, 0, 0, 0, 1])

    @classmethod
    def of(cls, value: PoseLike, argument: str = "pose") -> Pose:
        """The pose that a `value` means: a `Pose`, a 4 x 4 matrix, `(t, q)`, or seven numbers.

        An error calls it `argument`.

        Raises `ArgumentError`, also for what is no rotation: a norm or an angle that is off by more than a thousandth.
        """
        if isinstance(value, Pose):
            return value
        seven = _seven_of(value, argument)
        return cls(seven[:3], seven[3:])

    @property
    def matrix(self) -> F64:
        """The 4 x 4 matrix."""
        matrix = np.eye(4)
        matrix[:3, :3] = _rotation_of(self.rotation_xyzw)
        matrix[:3, 3] = self.translation_m
        return matrix

    def apply(self, points: ArrayLike) -> F64:
        """The `points`, of shape (..., 3), carried into the other frame."""
        expected = "points x y z, an array of numbers of shape (..., 3)"
        array = as_numbers(points, "points", expected)
        if array.ndim == 0 or array.shape[-1] != 3:
            raise ArgumentError("points", f"shape {array.shape}", expected)
        with np.errstate(all="ignore"):
            carried: F64 = array.astype(np.float64) @ _rotation_of(self.rotation_xyzw).T + self.translation_m
        return carried

    def inverse(self) -> Pose:
        """The way back: of `a_from_b`, `b_from_a`."""
        return Pose.of(np.linalg.inv(self.matrix))

    def __matmul__(self, other: Pose) -> Pose:
        """`a_from_b @ b_from_c` is `a_from_c`."""
        if not isinstance(other, Pose):
            raise ArgumentError("the pose on the right", excerpt(other), "a Pose: Pose.of makes one")
        return Pose.of(self.matrix @ other.matrix)

    def seven(self) -> list[float]:
        """The numbers x y z qx qy qz qw."""
        return [*self.translation_m.tolist(), *self.rotation_xyzw.tolist()]

    def json(self) -> dict[str, list[float]]:
        """The pose as the server's JSON has it."""
        seven = self.seven()
        return {"translation_m": seven[:3], "rotation_xyzw": seven[3:]}


PoseLike = Union[Pose, ArrayLike, tuple[ArrayLike, ArrayLike]]
"""What is taken for a pose: see `Pose.of`."""


def pose_in(fields: Fields, name: str) -> Pose:
    """A pose of an answer."""
    pose = fields.object(name)
    with reading(name):
        return Pose(pose.numbers("translation_m", (3,)), pose.numbers("rotation_xyzw", (4,)))


def sevens_of(matrices: NDArray[Any], argument: str) -> F64:
    """Matrices of shape (..., 4, 4) as numbers x y z qx qy qz qw of shape (..., 7)."""
    with np.errstate(all="ignore"):
        given = matrices.astype(np.float64)
        rotations = given[..., :3, :3]
        squares = np.swapaxes(rotations, -1, -2) @ rotations
        is_rotation = (np.abs(squares - np.eye(3)) <= 2 * NORM_TOLERANCE).all(axis=(-1, -2))
        is_rotation &= np.linalg.det(rotations) > 0
    is_rigid = (np.abs(given[..., 3, :] - [0, 0, 0, 1]) <= NORM_TOLERANCE).all(axis=-1)
    if not (is_rotation & is_rigid).all() or not np.isfinite(given).all():
        wrong = given.reshape(-1, 4, 4)[np.argmin((is_rotation & is_rigid).reshape(-1))]
        raise ArgumentError(argument, excerpt(wrong.tolist()), "rigid transforms: a rotation, a translation, and 0 0 0 1 below")
    return np.concatenate([given[..., :3, 3], _quaternions_of(rotations)], axis=-1)


def _seven_of(value: Any, argument: str) -> F64:
    if isinstance(value, tuple | list) and len(value) == 2:
        parts = [as_numbers(part, argument, EXPECTED) for part in value]
        shapes = [part.shape for part in parts]
        if shapes != [(3,), (4,)]:
            raise ArgumentError(argument, f"shapes {shapes[0]} and {shapes[1]}", EXPECTED)
        array = np.concatenate(parts)
    else:
        array = as_numbers(value, argument, EXPECTED)
    if array.shape == (4, 4):
        return sevens_of(array, argument)
    if array.shape != (7,):
        raise ArgumentError(argument, f"shape {array.shape}", EXPECTED)
    with np.errstate(all="ignore"):
        seven: F64 = array.astype(np.float64)
        norm = float(np.linalg.norm(seven[3:]))
    if not np.isfinite(seven).all() or abs(norm - 1) > NORM_TOLERANCE:
        raise ArgumentError(argument, excerpt(seven.tolist()), "finite, with a unit quaternion x y z w")
    seven[3:] /= norm
    return np.asarray(seven, np.float64)


def _rotation_of(quaternion: F64) -> F64:
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _quaternions_of(rotations: F64) -> F64:
    """Unit quaternions of rotations of shape (..., 3, 3): each from its largest component, which loses no digits (Shepperd)."""
    m = rotations.reshape(-1, 3, 3)
    trace = np.trace(m, axis1=1, axis2=2)
    diagonal = np.stack([m[:, 0, 0], m[:, 1, 1], m[:, 2, 2], trace], axis=1)
    largest = np.argmax(diagonal, axis=1)
    # The matrix of all products of the components, times four.
    products = np.empty((len(m), 4, 4))
    for i in range(3):
        products[:, i, i] = 1 + 2 * m[:, i, i] - trace
        j, k = (i + 1) % 3, (i + 2) % 3
        products[:, i, j] = products[:, j, i] = m[:, i, j] + m[:, j, i]
        products[:, i, 3] = products[:, 3, i] = m[:, k, j] - m[:, j, k]
    products[:, 3, 3] = 1 + trace
    quaternions = products[np.arange(len(m)), largest]
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    return np.asarray(quaternions.reshape(*rotations.shape[:-2], 4), np.float64)


def _part(numbers: ArrayLike, argument: str, expected: str, length: int) -> F64:
    array = as_numbers(numbers, argument, expected)
    if array.shape != (length,):
        raise ArgumentError(argument, f"shape {array.shape}", expected)
    with np.errstate(all="ignore"):
        part = array.astype(np.float64)
    if not np.isfinite(part).all():
        raise ArgumentError(argument, excerpt(numbers), expected)
    part.setflags(write=False)
    return part
