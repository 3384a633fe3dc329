"""What the questions of all modules use."""

from __future__ import annotations

from numpy.typing import ArrayLike

from .._arrays import F32, Shape, rows_of
from .backend import Backend
from .parts import Answer, Ask, ask_in_parts
from .scope import Scope


class QuestionGroup:
    """Some of the questions that a map is asked, answered by its backend."""

    _backend: Backend

    def _rows(self, value: ArrayLike, columns: int, argument: str, expected: str) -> tuple[F32, Shape]:
        """Numbers as rows, and the shape in which the rows were given: see `rows_of`."""
        return rows_of(value, columns, argument, expected, self._backend.bytes_max)

    def _in_parts(self, ask: Ask[Answer], scope: Scope, count: int, array_bytes: int, shape: Shape) -> Answer:
        """Asks about any number of elements, all of it within the time of one call: see `ask_in_parts`."""
        return ask_in_parts(ask, scope, self._backend.deadline(), count, array_bytes, shape)
