"""Fields of an answer in JSON, each read as what it has to be."""

import json
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ._secrets import masked
from .errors import BadAnswer, excerpt

Read = TypeVar("Read")

F64 = NDArray[np.float64]

READING_FAILS = (
    KeyError,
    TypeError,
    ValueError,
    IndexError,
    AttributeError,
    OverflowError,
    RecursionError,
    struct.error,
)
"""What Python raises of what is not as it should be."""


@contextmanager
def reading(what: str) -> Iterator[None]:
    """Tells of what cannot be read as an answer, whatever goes wrong with it."""
    try:
        yield
    except READING_FAILS as error:
        # A part of the answer may be in the error, and a secret in that.
        cause = error if masked(said := str(error)) == said else None
        raise BadAnswer(f"{what} cannot be read: {excerpt(error)}") from cause


def fields_of(body: bytes | bytearray | memoryview) -> "Fields":
    """The object that a body is."""
    with reading("the answer's JSON"):
        # Bytes of one address space: json copies what is no bytes.
        return Fields(json.loads(bytes(body)))


class Fields:
    """An object of an answer. What is missing or of another kind is a `BadAnswer` that names it."""

    def __init__(self, value: object, name: str = "the answer") -> None:
        if not isinstance(value, dict):
            raise BadAnswer(f"{name} must be an object, got {excerpt(value)}")
        self._fields: dict[str, Any] = value

    def has(self, name: str) -> bool:
        """Whether the field is there and not null."""
        return self._fields.get(name) is not None

    def text(self, name: str) -> str:
        """A string."""
        return self._of(name, str, "a string")

    def flag(self, name: str) -> bool:
        """A boolean."""
        return self._of(name, bool, "a boolean")

    def whole(self, name: str) -> int:
        """A whole number."""
        value = self._of(name, int, "a whole number")
        if isinstance(value, bool):
            raise self._wrong(name, "a whole number")
        return value

    def number(self, name: str) -> float:
        """A number."""
        value = self._fields.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._wrong(name, "a number")
        with reading(name):
            return float(value)

    def texts(self, name: str) -> tuple[str, ...]:
        """An array of strings."""
        values = self._list(name)
        if not all(isinstance(value, str) for value in values):
            raise self._wrong(name, "an array of strings")
        return tuple(values)

    def numbers(self, name: str, shape: tuple[int, ...]) -> F64:
        """An array of numbers of a shape, in which -1 stands for any length."""
        with reading(name):
            array = np.array(self._fields[name], np.float64)
            fits = len(array.shape) == len(shape) and all(n in (-1, m) for m, n in zip(array.shape, shape, strict=True))
            if not fits and array.size == 0 and -1 in shape:
                array, fits = np.zeros([max(n, 0) for n in shape]), True
        if not fits:
            raise self._wrong(name, f"numbers of shape {shape}")
        array.setflags(write=False)
        return array

    def object(self, name: str) -> "Fields":
        """An object within this one."""
        return Fields(self._fields.get(name), name)

    def objects(self, name: str) -> list["Fields"]:
        """An array of objects."""
        return [Fields(value, name) for value in self._list(name)]

    def optional(self, name: str, read: Callable[[str], Read]) -> Read | None:
        """What a method of this class reads, or None where the field is missing or null."""
        return read(name) if self.has(name) else None

    def _list(self, name: str) -> list[Any]:
        return self._of(name, list, "an array")

    def _of(self, name: str, kind: type[Read], expected: str) -> Read:
        value = self._fields.get(name)
        if not isinstance(value, kind):
            raise self._wrong(name, expected)
        return value

    def _wrong(self, name: str, expected: str) -> BadAnswer:
        return BadAnswer(f"{name} of the answer must be {expected}, got {excerpt(self._fields.get(name))}")
