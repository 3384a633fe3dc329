"""Points of `.ply` files: the x, y, z of element `vertex`."""

from itertools import islice

import numpy as np

from .._arrays import F64
from .counts import VALUE_BYTES_MIN, check_count
from .lines import Lines, content, read_each, words_of
from .numbers import number, plain_rows, whole
from .ply_header import Element, PlyHeader, Property, take_header
from .problem import Problem, quoted


def points_of(data: bytes) -> F64:
    """The points of a file: text, or binary of either order of bytes."""
    lines = Lines(data)
    header = take_header(lines)
    if header.encoding == "ascii":
        return _of_text(header, lines)
    return _of_bytes(header, memoryview(data)[lines.at :], "<" if header.encoding == "binary_little_endian" else ">")


def _of_text(header: PlyHeader, lines: Lines) -> F64:
    vertex = header.vertex
    for element in (*header.before, vertex):
        # The last line need not end.
        least = len(element.properties) * VALUE_BYTES_MIN
        check_count(f"{quoted(element.name)} elements", element.count, least, lines.left + 1)
    skipped = sum(element.count for element in header.before)
    if not skipped and not any(of.is_list for of in vertex.properties):
        # The last one is read too, so that a line without it is found.
        points = plain_rows(lines, [*header.axes, len(vertex.properties) - 1], vertex.count)
        if points is not None:
            return points[:, :3]
    read = read_each(islice(content(lines), skipped, skipped + vertex.count), lambda text: _point(header, text))
    if len(read) != vertex.count:
        raise Problem(f'truncated: {len(read)} of {vertex.count} "vertex" elements')
    return np.array(read, np.float64).reshape(-1, 3)


def _point(header: PlyHeader, text: str) -> list[float]:
    tokens, properties = words_of(text), header.vertex.properties
    point, at = [np.nan] * 3, 0
    for place, of in enumerate(properties):
        if at >= len(tokens):
            raise Problem(f"fewer values than {len(properties)} properties")
        if of.is_list:
            length = whole(tokens[at])
            if length is None:
                raise Problem(f"{quoted(tokens[at])} is not a number (a comment starts with #)")
            at += length
        elif place in header.axes:
            point[header.axes.index(place)] = number(tokens[at])
        at += 1
    return point


def _of_bytes(header: PlyHeader, payload: memoryview, order: str) -> F64:
    at = 0
    for element in header.before:
        at = _behind(element, payload, at, order)
    vertex = header.vertex
    _check(vertex, len(payload) - at)
    if vertex.count == 0:
        return np.zeros((0, 3))
    if not any(of.is_list for of in vertex.properties):
        kind = np.dtype([(str(place), order + of.kind()) for place, of in enumerate(vertex.properties)])
        entries = np.frombuffer(payload, kind, vertex.count, at)
        return np.stack([entries[str(place)].astype(np.float64) for place in header.axes], axis=1)
    points = np.empty((vertex.count, 3))
    wanted = {place: axis for axis, place in enumerate(header.axes)}
    steps = [_Step(of, order) for of in vertex.properties]
    for number_of_entry in range(vertex.count):
        for place, step in enumerate(steps):
            end = step.end(payload, at)
            if end > len(payload):
                raise _truncated(vertex, number_of_entry)
            if place in wanted:
                points[number_of_entry, wanted[place]] = np.frombuffer(payload, step.kind, 1, at)[0]
            at = end
    return points


class _Step:
    """How far a property reaches."""

    def __init__(self, of: Property, order: str) -> None:
        self._property = of
        self.kind = np.dtype(order + of.kind())
        self._length = np.dtype(order + of.length_kind()) if of.is_list else None

    @property
    def bytes_min(self) -> int:
        """Bytes that it takes at least: a list may be empty."""
        return (self.kind if self._length is None else self._length).itemsize

    def end(self, payload: memoryview, at: int) -> int:
        """Where it ends; beyond the payload where that is cut off."""
        if self._length is None or at + self._length.itemsize > len(payload):
            return at + self.bytes_min
        count = int(np.frombuffer(payload, self._length, 1, at)[0])
        if count < 0:
            raise self._property.problem(f"a list of {count} values")
        return at + self._length.itemsize + count * self.kind.itemsize


def _behind(element: Element, payload: memoryview, at: int, order: str) -> int:
    """Where the entries of an element end."""
    _check(element, len(payload) - at)
    steps = [_Step(of, order) for of in element.properties]
    if not any(of.is_list for of in element.properties):
        return at + element.count * sum(step.bytes_min for step in steps)
    for number_of_entry in range(element.count):
        for step in steps:
            at = step.end(payload, at)
            if at > len(payload):
                raise _truncated(element, number_of_entry)
    return at


def _check(element: Element, have: int) -> None:
    least = sum(_Step(of, "<").bytes_min for of in element.properties)
    check_count(f"{quoted(element.name)} elements", element.count, least, have)


def _truncated(element: Element, entry: int) -> Problem:
    return Problem(f"element {quoted(element.name)} {entry} of {element.count}: the file is truncated")
