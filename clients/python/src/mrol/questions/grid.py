"""The map from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from .._arguments import choice_of, flag_of
from .._arrays import F32, F64, Bools, as_numbers, number_of
from .._fields import reading
from ..errors import ArgumentError, excerpt
from ..version import Versioned
from .group import QuestionGroup
from .scope import QUESTION, QuestionScope

if TYPE_CHECKING:
    from typing_extensions import Unpack


BandFrom = Literal["floor", "map"]
BASES = get_args(BandFrom)


@dataclass(frozen=True, eq=False)
class Grid(Versioned):
    """A 2-D grid.

    Arrays have shape (cells along y, cells along x): row 0 has the smallest y, so that matplotlib draws it upright with
    `origin="lower"`.
    """

    cell_m: float
    """The side of a cell."""
    origin_m: F64
    """The corner of cell [0, 0], x y."""
    occupied: Bools
    tops_m: F32
    """The upper end of the highest voxel in the cell, in the band, in the map frame; NaN where there is none."""
    free: Bools | None
    """Where `tell_unknown` asked: cells that scans saw through. What is neither occupied nor free is unknown."""
    floor_m: tuple[float, float] | None
    """The lowest and the highest floor of these cells, in the map frame, where heights count from the floor and it reaches any."""

    @property
    def extent_m(self) -> tuple[float, float, float, float]:
        """Where it lies: x from and to, y from and to, as matplotlib's `extent` takes it."""
        height, width = self.occupied.shape
        x, y = (float(of) for of in self.origin_m)
        return x, x + width * self.cell_m, y, y + height * self.cell_m


class GridQuestions(QuestionGroup):
    """Projection to the floor."""

    @QUESTION.documented
    def grid(
        self,
        area: ArrayLike | None = None,
        *,
        min_z_m: float | None = None,
        max_z_m: float | None = None,
        band_from: BandFrom = "floor",
        cell_m: float | None = None,
        tell_unknown: bool = False,
        **scope: Unpack[QuestionScope],
    ) -> Grid:
        """The map from above: a cell is occupied where a voxel in it reaches between `min_z_m` and `max_z_m`.

        These heights count from the floor that robots stand on, which is found below the places from which they saw the map; with
        `band_from="map"` from z = 0 of the map, where usually the first scan's sensor was. Without bounds that does not matter.

        `area` has shape (2, 2): the smallest x y, then the largest; all of the map without it. `cell_m` is a whole number of voxels
        of the level. With `tell_unknown` cells that scans saw through are told from those that nobody saw.

        Raises `ResourceExhausted` (`grid_too_large`) and `DeadlineExceeded` (`time_limit`), where `mrol.Map.whole_grid` is the way,
        `InvalidArgument` (`bad_grid`, `point_out_of_range`), `FailedPrecondition` (`no_floor`).
        """
        fields = fields_of_grid(area, min_z_m, max_z_m, band_from, cell_m, tell_unknown=tell_unknown)
        answer = self._backend.ask("grid", fields, QUESTION.checked(scope, "grid"))
        with reading("size"):
            width, height = (int(of) for of in answer.head.numbers("size", (2,)))
            if width < 0 or height < 0:
                raise ValueError(f"{width} x {height}")
        cells, shape = width * height, (height, width)
        return Grid(
            version=answer.version,
            cell_m=answer.head.number("cell_m"),
            origin_m=answer.head.numbers("origin_m", (2,)),
            occupied=answer.bits("occupied", cells).reshape(shape),
            tops_m=answer.finite("tops_m", cells).reshape(shape),
            free=answer.bits("free", cells).reshape(shape) if answer.head.has("free") else None,
            floor_m=_range_of(answer.head.numbers("floor_m", (2,))) if answer.head.has("floor_m") else None,
        )


def fields_of_grid(
    area: ArrayLike | None,
    min_z_m: float | None,
    max_z_m: float | None,
    band_from: BandFrom,
    cell_m: float | None,
    *,
    tell_unknown: bool,
) -> dict[str, Any]:
    """What a grid is asked of, as fields of the question."""
    return {
        "area": None if area is None else _area(area),
        "min_z_m": None if min_z_m is None else number_of(min_z_m, "min_z_m"),
        "max_z_m": None if max_z_m is None else number_of(max_z_m, "max_z_m"),
        "band_from": choice_of(band_from, "band_from", BASES),
        "cell_m": None if cell_m is None else number_of(cell_m, "cell_m"),
        "tell_unknown": flag_of(tell_unknown, "tell_unknown"),
    }


def _range_of(numbers: F64) -> tuple[float, float]:
    low, high = (float(of) for of in numbers)
    return low, high


def _area(area: ArrayLike) -> dict[str, list[float]]:
    expected = "two corners of x y: the smallest coordinates, then the largest"
    array = as_numbers(area, "area", expected)
    if array.shape != (2, 2) or not np.isfinite(array).all():
        raise ArgumentError("area", excerpt(area), expected)
    return {"min_m": [float(of) for of in array[0]], "max_m": [float(of) for of in array[1]]}
