"""Planners' questions in the form for programs: a head in JSON, and arrays of bytes behind it.

bytes      what
4          length h of the head, little-endian
h          the head, in which {"at": a, "bytes": n} stands for an array
the rest   the arrays: this one is n bytes long and begins a bytes after the head
"""

import json
import struct
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ._arrays import F32, U32, Bools, raw
from ._bits import indices_of, unpacked
from ._fields import fields_of, reading
from .questions.backend import I32, I64, Answer, Names
from .version import Version

NONE = 0xFFFF_FFFF
"""The number that stands for none."""

Item = TypeVar("Item", bound=np.generic)


def body_of_question(fields: Mapping[str, Any]) -> "list[bytes | memoryview]":
    """A question's body, in pieces: fields that are arrays stand behind the head, and those that are None are left out."""
    pieces: list[memoryview] = []
    text = json.dumps(_placed(fields, pieces), allow_nan=False).encode()
    return [struct.pack("<I", len(text)) + text, *pieces]


def _placed(value: Any, pieces: "list[memoryview]") -> Any:
    """A field as the head has it: an array is added to the pieces, and its place stands for it."""
    if isinstance(value, Mapping):
        return {name: _placed(of, pieces) for name, of in value.items() if of is not None}
    if isinstance(value, np.ndarray):
        piece = raw(value)
        place = {"at": sum(of.nbytes for of in pieces), "bytes": piece.nbytes}
        pieces.append(piece)
        return place
    return [_placed(of, pieces) for of in value] if isinstance(value, list) else value


class QuestionAnswer(Answer):
    """An answer: its head, and the arrays that the head speaks of."""

    def __init__(self, body: memoryview) -> None:
        with reading("the answer's head"):
            (length,) = struct.unpack_from("<I", body)
            if length > body.nbytes - 4:
                raise ValueError(f"a head of {length} bytes in an answer of {body.nbytes}")
            head = fields_of(body[4 : 4 + length])
        super().__init__(head, Version.of(head))
        self._data = body[4 + length :]

    def bits(self, name: str, count: int, set_bits: int | None = None) -> Bools:
        """An array of booleans; where the head tells how many are true, so many are."""
        with reading(name):
            return unpacked(self._bytes(name, (count + 7) // 8), count, set_bits)

    def floats(self, name: str, count: int, *columns: int) -> F32:
        """An array of floats of shape (count, *columns)."""
        with reading(name):
            numbers = count * int(np.prod(columns, dtype=np.int64))
            return np.frombuffer(self._bytes(name, 4 * numbers), "<f4").reshape(count, *columns)

    def finite(self, name: str, count: int) -> F32:
        """An array of floats; what is not finite stands for none."""
        floats = self.floats(name, count)
        return np.where(np.isfinite(floats), floats, np.float32(np.nan))

    def numbers(self, name: str, count: int) -> I64:
        """An array of numbers, in which -1 stands for none."""
        with reading(name):
            numbers = self._unsigned(name, count).astype(np.int64)
            numbers[numbers == NONE] = -1
            return _frozen(numbers)

    def voxels(self, name: str, count: int) -> I32:
        """Indices i j k of voxels, shape (count, 3)."""
        with reading(name):
            return _frozen(indices_of(np.frombuffer(self._bytes(name, 8 * count), "<u8")))

    def names(self, name: str, count: int) -> Names:
        """An array of names and None; all of it None where the answer has no such array."""
        found: Names = np.full(count, None, object)
        if self.head.has(name):
            with reading(name):
                of_array = self.head.object(name)
                numbers = self._unsigned(name, count)
                texts = of_array.texts("names")
                if not ((numbers < len(texts)) | (numbers == NONE)).all():
                    raise ValueError(f"there are {len(texts)} names")
                for number, text in enumerate(texts):
                    found[numbers == number] = text
        return _frozen(found)

    def _unsigned(self, name: str, count: int) -> U32:
        return np.frombuffer(self._bytes(name, 4 * count), "<u4")

    def _bytes(self, name: str, expected: int) -> memoryview:
        place = self.head.object(name)
        at, length = place.whole("at"), place.whole("bytes")
        if length != expected or at < 0 or at + length > self._data.nbytes:
            raise ValueError(f"{length} bytes at {at} of {self._data.nbytes}, where {expected} are needed")
        return self._data[at : at + length]


def _frozen(array: NDArray[Item]) -> NDArray[Item]:
    array.setflags(write=False)
    return array
