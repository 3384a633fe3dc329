"""Parts of space, in the map frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import F64, as_numbers, number_of, vector_of
from ._fields import Fields
from .errors import ArgumentError, excerpt
from .pose import Pose, PoseLike, pose_in

UNBOUNDED_M = 1e300
"""What stands for infinity in JSON, which has none."""


@dataclass(frozen=True, eq=False)
class Box:
    """A box along the map's axes: its smallest and its largest corner, meters; borders belong to it."""

    min_m: ArrayLike
    max_m: ArrayLike

    def corners(self, argument: str = "box") -> tuple[list[float], list[float]]:
        """The corners as numbers.

        Raises `ArgumentError` for what is no corner.
        """
        return vector_of(self.min_m, 3, f"{argument}.min_m"), vector_of(self.max_m, 3, f"{argument}.max_m")

    @classmethod
    def of(cls, value: BoxLike, argument: str = "box") -> Box:
        """A `Box`, or two corners: an array of shape (2, 3)."""
        if isinstance(value, Box):
            return value
        expected = "a Box, or two corners of x y z: the smallest coordinates, then the largest"
        array = as_numbers(value, argument, expected)
        if array.shape != (2, 3):
            raise ArgumentError(argument, excerpt(value), expected)
        return cls(array[0], array[1])

    def json(self, argument: str) -> dict[str, Any]:
        """The shape as the server's JSON has it."""
        min_m, max_m = self.corners(argument)
        return {"min_m": [_bounded(x) for x in min_m], "max_m": [_bounded(x) for x in max_m]}


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball: its center and its radius, meters."""

    center_m: ArrayLike
    radius_m: float

    def json(self, argument: str) -> dict[str, Any]:
        """The shape as the server's JSON has it."""
        center_m = vector_of(self.center_m, 3, f"{argument}.center_m", is_finite=True)
        return {"center_m": center_m, "radius_m": number_of(self.radius_m, f"{argument}.radius_m")}


@dataclass(frozen=True, eq=False)
class OrientedBox:
    """A box with any orientation: the pose of its center in the map, and its sides, meters."""

    map_from_box: PoseLike
    size_m: ArrayLike

    def json(self, argument: str) -> dict[str, Any]:
        """The shape as the server's JSON has it."""
        pose = Pose.of(self.map_from_box, f"{argument}.map_from_box")
        return {"map_from_box": pose.json(), "size_m": vector_of(self.size_m, 3, f"{argument}.size_m", is_finite=True)}


@dataclass(frozen=True, eq=False)
class Prism:
    """A polygon with a height: corners of shape (n, 2), 3 to 64 of them in either direction, and from which z to which, meters."""

    corners_m: ArrayLike
    z_from_m: float
    z_to_m: float

    def json(self, argument: str) -> dict[str, Any]:
        """The shape as the server's JSON has it."""
        expected = "corners of shape (n, 2)"
        with np.errstate(all="ignore"):
            corners: F64 = as_numbers(self.corners_m, f"{argument}.corners_m", expected).astype(np.float64)
        if corners.ndim != 2 or corners.shape[1] != 2 or not np.isfinite(corners).all():
            raise ArgumentError(f"{argument}.corners_m", excerpt(self.corners_m), expected)
        z_from_m, z_to_m = number_of(self.z_from_m, f"{argument}.z_from_m"), number_of(self.z_to_m, f"{argument}.z_to_m")
        return {"corners_m": corners.tolist(), "z_from_m": z_from_m, "z_to_m": z_to_m}


BoxLike = Union[Box, ArrayLike]
Shape = Union[Box, Sphere, OrientedBox, Prism]

REGIONS = (Box, Sphere, OrientedBox)
"""Shapes in which voxels lie, or do not count."""

WORDS: dict[type, str] = {Box: "box", Sphere: "sphere", OrientedBox: "oriented_box", Prism: "prism"}
KINDS = {word: kind for kind, word in WORDS.items()}


def shape_of(value: Any, argument: str) -> Any:
    """What an argument named by a kind of shape means: corners are a box, a center and a radius a sphere."""
    if argument == "box":
        return Box.of(value)
    if argument == "sphere" and isinstance(value, tuple) and len(value) == 2:
        return Sphere(*value)
    return value


def shape_json(shape: Shape, argument: str, kinds: tuple[type, ...]) -> dict[str, Any]:
    """A shape as the server's JSON has it: an object whose field is the word for its kind."""
    if type(shape) not in kinds:
        expected = " or ".join(f"a {kind.__name__}" for kind in kinds)
        raise ArgumentError(argument, excerpt(shape), expected)
    return {WORDS[type(shape)]: shape.json(argument)}


def shape_in(fields: Fields) -> Shape:
    """The shape of an answer."""
    if fields.has("box"):
        box = fields.object("box")
        return Box(box.numbers("min_m", (3,)), box.numbers("max_m", (3,)))
    if fields.has("sphere"):
        sphere = fields.object("sphere")
        return Sphere(sphere.numbers("center_m", (3,)), sphere.number("radius_m"))
    if fields.has("oriented_box"):
        oriented = fields.object("oriented_box")
        return OrientedBox(pose_in(oriented, "map_from_box"), oriented.numbers("size_m", (3,)))
    prism = fields.object("prism")
    return Prism(prism.numbers("corners_m", (-1, 2)), prism.number("z_from_m"), prism.number("z_to_m"))


def _bounded(number: float) -> float:
    return max(-UNBOUNDED_M, min(UNBOUNDED_M, number))
