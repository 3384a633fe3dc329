"""A robot's body, and where it is asked to be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import F32, Shape, are_rows, as_floats, as_numbers, number_of, rows_of
from .errors import ArgumentError, excerpt
from .pose import Pose, sevens_of

NO_SPHERES: NDArray[np.float32] = np.zeros((0, 4), np.float32)
NO_POINTS: NDArray[np.float32] = np.zeros((0, 3), np.float32)


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid part of a body, in a frame of its own.

    `spheres` has shape (n, 4): x y z and the radius, meters. `points` has shape (m, 3). `padding_m` is added to all radii; points
    with padding are spheres.
    """

    spheres: ArrayLike = field(default_factory=lambda: NO_SPHERES)
    points: ArrayLike = field(default_factory=lambda: NO_POINTS)
    padding_m: float = 0.0


@dataclass(frozen=True, eq=False)
class Body:
    """A robot as its links; each has a pose of its own in a configuration."""

    links: Sequence[Link]

    def __post_init__(self) -> None:
        try:
            links = tuple(self.links)
        except Exception as error:
            # Whatever going through an object raises.
            raise ArgumentError("body.links", excerpt(self.links), "a sequence of Link") from error
        if not links:
            raise ArgumentError("body.links", excerpt(self.links), "one Link or more")
        for number, link in enumerate(links):
            if not isinstance(link, Link):
                raise ArgumentError(f"body.links[{number}]", excerpt(link), "a Link")
        object.__setattr__(self, "links", links)

    @classmethod
    def of(cls, value: BodyLike) -> Body:
        """A `Body`, a `Link`, or the spheres of one link: an array of shape (n, 4)."""
        if isinstance(value, Body):
            return value
        is_empty = value.shape == (0,) if isinstance(value, np.ndarray) else isinstance(value, Sequence) and not value
        if is_empty:
            raise ArgumentError("body.links[0].spheres", excerpt(value), "spheres x y z r, shape (n, 4), one or more")
        return cls([value if isinstance(value, Link) else Link(spheres=value)])

    def fields(self, bytes_max: int) -> dict[str, Any]:
        """The body as a field of a question: numbers of each link, in arrays of no more bytes than that."""
        links = []
        for number, link in enumerate(self.links):
            name = f"body.links[{number}]"
            spheres, _ = rows_of(link.spheres, 4, f"{name}.spheres", "spheres x y z r, shape (n, 4)", bytes_max)
            points, _ = rows_of(link.points, 3, f"{name}.points", "points x y z, shape (n, 3)", bytes_max)
            links.append(
                {
                    "spheres": spheres if len(spheres) else None,
                    "points": points if len(points) else None,
                    "padding_m": number_of(link.padding_m, f"{name}.padding_m"),
                }
            )
        return {"links": links}


BodyLike = Union[Body, Link, ArrayLike]
"""What is taken for a body: see `Body.of`."""

ConfigurationsLike = Union[Sequence[Pose], ArrayLike]
"""Poses of all links, in the map frame: see `configurations_of`."""


def configurations_of(value: ConfigurationsLike, links: int, argument: str, bytes_max: int) -> tuple[F32, Shape]:
    """Configurations as rows x y z qx qy qz qw, link by link, and the shape in which the configurations were given.

    Of a body of one link, configurations of shape (...) are an array of shape (..., 4, 4), (..., 7), or (..., 3) for a body that
    does not turn, or a sequence of `Pose`. A body of more links has an axis for them before the last or the last two.
    """
    axis = "" if links == 1 else f"{links}, "
    expected = f"poses of shape (..., {axis}4, 4), (..., {axis}7) or (..., {axis}3)"
    is_sent_as_it_is = are_rows(value, 7, bytes_max)
    sevens = np.asarray(value) if is_sent_as_it_is else _sevens(value, links, argument, expected)
    lead = sevens.shape[:-1]
    if links != 1:
        if not lead or lead[-1] != links:
            raise ArgumentError(argument, f"shape {sevens.shape}", f"{expected}: the body has {links} links")
        lead = lead[:-1]
    floats = sevens if is_sent_as_it_is else as_floats(sevens, argument, expected, bytes_max)
    return floats.reshape(-1, 7), lead


def _sevens(value: Any, links: int, argument: str, expected: str) -> NDArray[Any]:
    if isinstance(value, Pose):
        return np.array(value.seven())
    if isinstance(value, Sequence) and value and all(isinstance(pose, Pose) for pose in value):
        return np.array([pose.seven() for pose in value])
    array = as_numbers(value, argument, expected)
    if array.shape[-2:] == (4, 4):
        return sevens_of(array, argument)
    if array.shape == (0,):
        # An empty list.
        return np.zeros((0, 7)) if links == 1 else np.zeros((0, links, 7))
    if array.ndim > 0 and array.shape[-1] == 7:
        return array
    if array.ndim > 0 and array.shape[-1] == 3:
        sevens = np.zeros((*array.shape[:-1], 7), array.dtype if array.dtype.kind == "f" else np.float64)
        sevens[..., :3] = array
        sevens[..., 6] = 1
        return sevens
    raise ArgumentError(argument, f"shape {array.shape}", expected)
