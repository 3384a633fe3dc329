"""Points of `.pcd` files: the fields x, y, z. The viewpoint is ignored: the pose of a scan is given with the scan."""

import struct
from itertools import islice

import numpy as np

from .._arrays import F64
from .counts import FILE_BYTES_MAX, VALUE_BYTES_MIN, check_count
from .lines import Lines, content, read_each, words_of
from .lzf import decompressed
from .numbers import number, plain_rows
from .pcd_header import PcdHeader, take_header
from .problem import Problem

LZF_RATIO_MAX = 88
"""Bytes that one byte of compressed data can stand for: 3 bytes repeat 264."""


def points_of(data: bytes) -> F64:
    """The points of a file: text, binary or compressed."""
    lines = Lines(data)
    header = take_header(lines)
    if header.kind == "ascii":
        return _of_text(header, lines)
    payload = memoryview(data)[lines.at :]
    return _of_bytes(header, payload) if header.kind == "binary" else _of_compressed(header, payload)


def _of_text(header: PcdHeader, lines: Lines) -> F64:
    values = sum(header.counts)
    # The last line need not end.
    check_count("points", header.points, values * VALUE_BYTES_MIN, lines.left + 1)
    columns = [sum(header.counts[:axis]) for axis in header.axes]
    # The last one is read too, so that a line without it is found.
    points = plain_rows(lines, [*columns, values - 1], header.points)
    if points is not None:
        return points[:, :3]
    read = read_each(islice(content(lines), header.points), lambda text: _point(words_of(text), columns, values))
    if len(read) != header.points:
        raise Problem(f"truncated: POINTS declares {header.points}, {len(read)} follow")
    return np.array(read, np.float64).reshape(-1, 3)


def _point(tokens: list[str], columns: list[int], values: int) -> list[float]:
    if len(tokens) < values:
        raise Problem("fewer values than the fields need")
    return [number(tokens[column]) for column in columns]


def _of_bytes(header: PcdHeader, payload: memoryview) -> F64:
    check_count("points", header.points, header.record_bytes, len(payload))
    if header.points == 0:
        return np.zeros((0, 3))
    kind = np.dtype(
        {
            "names": ["x", "y", "z"],
            "formats": [f"<f{header.sizes[axis]}" for axis in header.axes],
            "offsets": [header.offset(axis) for axis in header.axes],
            "itemsize": header.record_bytes,
        }
    )
    records = np.frombuffer(payload, kind, header.points)
    return np.stack([records[name].astype(np.float64) for name in "xyz"], axis=1)


def _of_compressed(header: PcdHeader, payload: memoryview) -> F64:
    """Of points whose fields lie one behind the other, each of all points."""
    if len(payload) < 8:
        raise Problem("truncated: the sizes of the compressed data are missing")
    compressed, whole = struct.unpack_from("<II", payload)
    data = payload[8:]
    if compressed > len(data):
        raise Problem(f"truncated: {compressed} bytes of compressed data are declared, {len(data)} follow")
    if whole > min(FILE_BYTES_MAX, compressed * LZF_RATIO_MAX) or header.points * header.record_bytes != whole:
        raise Problem(
            f"{compressed} bytes of compressed data that become {whole} cannot hold {header.points} points of "
            f"{header.record_bytes} bytes: the header is wrong"
        )
    check_count("points", header.points, header.record_bytes, whole)
    columns = decompressed(data[:compressed], whole)
    if header.points == 0:
        return np.zeros((0, 3))
    of_axes = [
        np.frombuffer(columns, f"<f{header.sizes[axis]}", header.points, header.offset(axis) * header.points).astype(np.float64)
        for axis in header.axes
    ]
    return np.stack(of_axes, axis=1)
