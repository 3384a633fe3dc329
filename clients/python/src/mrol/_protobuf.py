"""Messages of protocol buffers, as far as a watch needs them read: fields by number, those not known left alone."""

import struct
from typing import Union

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
VARINT_BYTES_MAX = 10
WORD = (1 << 64) - 1

Value = Union[int, memoryview]


class Message:
    """A message: what it has of each field, in the order in which it came."""

    def __init__(self, data: memoryview) -> None:
        self._fields: dict[int, list[Value]] = {}
        at = 0
        while at < data.nbytes:
            tag, at = _varint(data, at)
            value, at = _value(data, at, tag & 7)
            self._fields.setdefault(tag >> 3, []).append(value)

    def has(self, number: int) -> bool:
        """Whether the field is there."""
        return number in self._fields

    def whole(self, number: int) -> int:
        """An unsigned number, or the bits of a fixed one; 0 where it is not there."""
        value = self._last(number)
        if value is None:
            return 0
        if not isinstance(value, int):
            raise ValueError(f"field {number} is no number")
        return value

    def signed(self, number: int) -> int:
        """A signed number."""
        value = self.whole(number)
        return value - (1 << 64) if value >> 63 else value

    def flag(self, number: int) -> bool:
        """A boolean."""
        return self.whole(number) != 0

    def double(self, number: int) -> float:
        """A float of eight bytes."""
        (value,) = struct.unpack("<d", struct.pack("<Q", self.whole(number)))
        return float(value)

    def data(self, number: int) -> memoryview:
        """Bytes; none where the field is not there."""
        value = self._last(number)
        if value is None:
            return memoryview(b"")
        if isinstance(value, int):
            raise ValueError(f"field {number} is a number")
        return value

    def text(self, number: int) -> str:
        """A string."""
        return str(self.data(number), "utf-8")

    def message(self, number: int) -> "Message":
        """A message within this one; an empty one where it is not there."""
        return Message(self.data(number))

    def messages(self, number: int) -> list["Message"]:
        """All messages of a repeated field."""
        return [Message(value) for value in self._fields.get(number, []) if isinstance(value, memoryview)]

    def wholes(self, number: int) -> tuple[int, ...]:
        """All numbers of a repeated field, packed or not."""
        found: list[int] = []
        for value in self._fields.get(number, []):
            if isinstance(value, int):
                found.append(value)
                continue
            at = 0
            while at < value.nbytes:
                one, at = _varint(value, at)
                found.append(one)
        return tuple(found)

    def doubles(self, number: int) -> tuple[float, ...]:
        """All floats of a repeated field, which is packed."""
        return tuple(float(of) for value in self._fields.get(number, []) for of in _floats(value))

    def _last(self, number: int) -> Value | None:
        values = self._fields.get(number)
        return values[-1] if values else None


def _floats(value: Value) -> tuple[float, ...]:
    packed = struct.pack("<Q", value) if isinstance(value, int) else value
    return struct.unpack(f"<{len(packed) // 8}d", packed)


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    number = 0
    for shift in range(VARINT_BYTES_MAX):
        byte = data[at]
        at += 1
        number |= (byte & 0x7F) << (7 * shift)
        if byte < 0x80:
            return number & WORD, at
    raise ValueError("a number of more than ten bytes")


def _value(data: memoryview, at: int, kind: int) -> tuple[Value, int]:
    if kind == VARINT:
        return _varint(data, at)
    if kind == FIXED64:
        return int(struct.unpack_from("<Q", data, at)[0]), at + 8
    if kind == FIXED32:
        return int(struct.unpack_from("<I", data, at)[0]), at + 4
    if kind != BYTES:
        raise ValueError(f"a field of kind {kind}")
    length, at = _varint(data, at)
    if length > data.nbytes - at:
        raise ValueError(f"a field of {length} bytes where {data.nbytes - at} are left")
    return data[at : at + length], at + length
