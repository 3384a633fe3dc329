"""What answers questions: a server, or a map inside this process. Arguments come checked, and answers are arrays."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import F32, Bools
from .._fields import Fields
from .._transport.deadline import Deadline
from ..body import Body
from ..errors import BadAnswer
from ..version import Version
from .scope import Scope

I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Names = NDArray[np.object_]

PointQuery = tuple["list[float] | None", str, bool]
"""How points are asked about: by the pose that carries them into the map, by which look-up, and whether keep-outs count."""


class Answer(ABC):
    """An answer: fields that are no arrays, and arrays by their names. Each array has as many elements as it is asked for."""

    def __init__(self, head: Fields, version: Version) -> None:
        self.head = head
        self.version = version

    def check_count(self, name: str, count: int) -> None:
        """Refuses an answer about another number of elements, which a field of it tells."""
        told = self.head.whole(name)
        if told != count:
            raise BadAnswer(f"{name} of the answer is {told}, where {count} were asked about")

    @abstractmethod
    def bits(self, name: str, count: int, set_bits: int | None = None) -> Bools:
        """An array of booleans; where it is known how many are true, so many are."""

    @abstractmethod
    def floats(self, name: str, count: int, *columns: int) -> F32:
        """An array of floats of shape (count, *columns)."""

    @abstractmethod
    def finite(self, name: str, count: int) -> F32:
        """An array of floats, NaN where there is none."""

    @abstractmethod
    def numbers(self, name: str, count: int) -> I64:
        """An array of numbers, in which -1 stands for none."""

    @abstractmethod
    def voxels(self, name: str, count: int) -> I32:
        """Indices i j k of voxels, shape (count, 3)."""

    @abstractmethod
    def names(self, name: str, count: int) -> Names:
        """An array of names and None; all of it None where the answer has no such array."""


class Backend(ABC):
    """What answers the questions of a map."""

    bytes_max: int
    """Bytes of an array of a question, at most."""

    @abstractmethod
    def query(self, points: F32, how: PointQuery, scope: Scope, deadline: Deadline | None) -> tuple[Version, Bools, int]:
        """Whether points lie in occupied voxels: the version of the map, a boolean for each point, and how many are true."""

    @abstractmethod
    def ask(self, question: str, fields: Mapping[str, Any], scope: Scope, deadline: Deadline | None = None) -> Answer:
        """Answers any other question, by its name and its fields; fields that are None are not given."""

    @abstractmethod
    def body_of(self, body: Body) -> Any:
        """A body, as a field of a question."""

    @abstractmethod
    def deadline(self) -> Deadline | None:
        """Until when a question that begins now may last, where it is told."""
