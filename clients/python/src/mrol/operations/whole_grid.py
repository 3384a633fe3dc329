"""The map from above, of a whole site."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import F32, Bools
from .._bits import unpacked
from .._fields import reading
from .._protobuf import Message
from .._question import body_of_question
from .._transport.deadline import Deadline
from .._transport.request import BYTES, Request
from ..errors import BadAnswer
from ..progress import Progress, checked_progress, progress_of
from ..questions.grid import BandFrom, Grid, fields_of_grid
from ..questions.scope import QUESTION, QuestionScope
from ..version import Version
from .framing import failure_of, next_message
from .handle import MapHandle

if TYPE_CHECKING:
    from typing_extensions import Unpack

CELL_BYTES = 6
"""Bytes of a cell in memory: a height and two booleans."""


@dataclass(frozen=True, eq=False)
class WholeGrid(Grid):
    """A 2-D grid that was joined of tiles, each of a revision of its own; `version` is that of the last one."""

    first_version: Version
    """The version of the first tile: the same where the map did not change meanwhile."""


class WholeGridOperations(MapHandle):
    """Projection of a whole site to the floor."""

    @QUESTION.documented
    def whole_grid(
        self,
        area: ArrayLike | None = None,
        *,
        min_z_m: float | None = None,
        max_z_m: float | None = None,
        band_from: BandFrom = "floor",
        cell_m: float | None = None,
        tell_unknown: bool = False,
        progress: Progress = None,
        **scope: Unpack[QuestionScope],
    ) -> WholeGrid:
        """The map from above as `grid` has it, of a whole site: joined of tiles, which the server draws one after the other.

        `area`, `min_z_m`, `max_z_m`, `band_from`, `cell_m` and `tell_unknown` are as of `grid`.

        Where the map changes meanwhile tiles are of different revisions, which `version` and `first_version` tell. `progress` is
        told of the tiles; what it raises ends it.

        Raises `ResourceExhausted` (`grid_too_large`), `DeadlineExceeded` (`time_limit`, beyond `grid_time_max_s`),
        `InvalidArgument` (`bad_grid`, `point_out_of_range`), `FailedPrecondition` (`no_floor`), and `BadAnswer` where it takes
        more than `answer_bytes_max`.
        """
        fields = fields_of_grid(area, min_z_m, max_z_m, band_from, cell_m, tell_unknown=tell_unknown)
        checked, options = checked_progress(progress), QUESTION.checked(scope, "whole_grid")
        return self._server.in_order(
            lambda scope, _: self._caller.whole(lambda: self._joined({**fields, **scope}, checked)),
            lambda grid: grid.version,
            options,
            None,
        )

    def _joined(self, fields: Mapping[str, Any], progress: Progress) -> WholeGrid:
        request = Request("POST", self._target("grid", "tiles"), BYTES, body_of_question(fields))
        bounds, joined = self._caller.bounds, _Tiles(self._caller.bounds.answer_bytes_max)
        with progress_of(progress, self._name, None) as told, self._caller.stream(request) as body:
            while not joined.are_all:
                data = next_message(body, Deadline(bounds.timeout_s), bounds.answer_bytes_max)
                with reading("a tile of the grid"):
                    tile = Message(data)
                    if tile.has(9):
                        raise failure_of(tile.message(9))
                    joined.put(tile)
                told(joined.count, joined.expected)
        return joined.grid()


class _Tiles:
    """Tiles of one grid, as `GridTile` of `proto/mrol/v1/planning.proto` has them, joined."""

    def __init__(self, bytes_max: int) -> None:
        self._bytes_max = bytes_max
        self.count = 0
        self.expected = 1
        self._versions: list[Version] = []
        self._floors_m: list[float] = []

    @property
    def are_all(self) -> bool:
        """Whether every tile has come."""
        return self.count >= self.expected

    def put(self, tile: Message) -> None:
        """Takes the next tile. Raises `ValueError` for one that does not lie in the grid."""
        part, shape = tile.message(8), (tile.whole(4), tile.whole(3))
        if self.count == 0:
            self._begin(tile, part, shape)
        rows, columns = part.whole(5), part.whole(4)
        y, x, cells = tile.whole(7), tile.whole(6), rows * columns
        if shape != self._occupied.shape or y + rows > shape[0] or x + columns > shape[1]:
            raise ValueError(f"a tile of {columns} x {rows} cells at {x}, {y} does not lie in {shape[1]} x {shape[0]}")
        where = np.s_[y : y + rows, x : x + columns]
        self._occupied[where] = unpacked(part.data(6), cells).reshape(rows, columns)
        tops_m = part.data(8)
        if tops_m.nbytes != 4 * cells:
            raise ValueError(f"{tops_m.nbytes} bytes are no heights of {cells} cells")
        self._tops_m[where] = np.frombuffer(tops_m, "<f4").reshape(rows, columns)
        if self._free is not None:
            self._free[where] = unpacked(part.data(10), cells).reshape(rows, columns)
        self._floors_m += [part.double(12), part.double(13)] if part.has(12) and part.has(13) else []
        version = part.message(9)
        content_hash = version.whole(3) if version.has(3) else None
        self._versions = [*self._versions[:1], Version(version.whole(1), version.text(2), content_hash)]
        self.count += 1

    def _begin(self, tile: Message, part: Message, shape: tuple[int, int]) -> None:
        if shape[0] * shape[1] * CELL_BYTES > self._bytes_max:
            raise BadAnswer(
                f"the grid has {shape[1]} x {shape[0]} cells of {CELL_BYTES} bytes, more than answer_bytes_max, {self._bytes_max}: "
                "ask for a smaller area or larger cells, or raise it"
            )
        self.expected = max(tile.whole(5), 1)
        self._cell_m = part.double(1)
        self._origin_m = np.array([tile.double(1), tile.double(2)])
        self._occupied: Bools = np.zeros(shape, np.bool_)
        self._tops_m: F32 = np.full(shape, np.nan, np.float32)
        self._free: Bools | None = np.zeros(shape, np.bool_) if part.has(10) else None

    def grid(self) -> WholeGrid:
        """All of them."""
        arrays = [self._origin_m, self._occupied, self._tops_m, *([] if self._free is None else [self._free])]
        for array in arrays:
            array.setflags(write=False)
        return WholeGrid(
            version=self._versions[-1],
            cell_m=self._cell_m,
            origin_m=self._origin_m,
            occupied=self._occupied,
            tops_m=np.where(np.isfinite(self._tops_m), self._tops_m, np.float32(np.nan)),
            free=self._free,
            floor_m=(min(self._floors_m), max(self._floors_m)) if self._floors_m else None,
            first_version=self._versions[0],
        )
