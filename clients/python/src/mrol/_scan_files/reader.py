"""Scan files by their extensions, and folders of them."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Union

import numpy as np

from .._arrays import F32, F64
from .._files import File, open_regular, path_of_file
from ..errors import ArgumentError, ScanFileError, excerpt
from . import pcd, ply, text
from .axes import AxisMissing, axes_of
from .counts import FILE_BYTES_MAX
from .packed import points_of_array, points_of_floats
from .problem import Problem

ColumnsLike = Union[str, Sequence[str]]
"""Names of columns: a text with spaces or commas between them, or a sequence."""

_Reader = Callable[[bytes, "list[str] | None"], F64]

_WITH_HEADER = (".ply", ".pcd")
"""Extensions of files whose header names the columns."""

_OF_LISTS = (".txt", ".csv")
"""Extensions of text that may be anything: such a file is read where it is named, and is none of a folder's scans."""

_DIGITS = re.compile(r"([0-9]+)")


def read_scan(path: File, columns: ColumnsLike | None = None, *, exact: bool = False) -> F32 | F64:
    """The points of the scan file at a `path`, shape (n, 3), in the sensor's frame, meters.

    The extension says the format, in either case: `.ply` (text, binary of either order of bytes), `.pcd` (text, binary,
    binary_compressed), `.xyz`, `.txt` and `.csv` (text: the first three columns, or those that a line of names says), `.npy`
    (an array of shape (..., 3), with columns behind x y z or with fields x, y and z), `.bin` (little-endian float32 x y z i) and
    `.f32` (x y z). Points that are not finite are kept: they mean "no return". The program `mrol` reads the same of a file.

    `columns` names the columns of a text, an array or bare floats where they are others: `columns="x y z i"`. With `exact` the
    points are float64, as files in survey coordinates have them; float32 otherwise.

    Raises `OSError` for a file that cannot be opened, `ScanFileError` for one that is broken, truncated or no scan, with its line
    where it has one, and for bare floats that look like rows of another length; `ArgumentError` for another extension.
    """
    name = path_of_file(path, "path")
    suffix = os.path.splitext(name)[1].lower()
    names = None if columns is None else _names(columns)
    if suffix not in _READERS:
        raise ArgumentError("path", excerpt(name), f"a scan file: {' '.join(_READERS)}")
    if names is not None and suffix in _WITH_HEADER:
        raise ArgumentError("columns", excerpt(columns), f"left out for {suffix} files, whose header names them")
    with open_regular(name) as opened:
        if os.fstat(opened.fileno()).st_size > FILE_BYTES_MAX:
            raise ScanFileError(name, f"larger than {FILE_BYTES_MAX} bytes, the most that a scan file may have; split it")
        data = opened.readall() or b""
    try:
        # Any bits may stand for "no return", and a number beyond float32 does too.
        with np.errstate(over="ignore", invalid="ignore"):
            points = _READERS[suffix](data, names)
            return np.ascontiguousarray(points, None if exact else np.dtype("<f4"))
    except Problem as problem:
        raise ScanFileError(name, problem.text, problem.line) from None


def scan_files(folder: File) -> list[Path]:
    """The scan files of a `folder`, in the natural order of their names: scan2 before scan10.

    They are those that `read_scan` reads, but for `.txt` and `.csv`, which may be lists of poses: read those by their names.

    Raises `OSError` for a folder that cannot be read, and `ScanFileError` for one without a scan file.
    """
    name = path_of_file(folder, "folder")
    with os.scandir(name) as entries:
        suffixes = {entry.name: os.path.splitext(entry.name)[1].lower() for entry in entries if entry.is_file()}
    found = [file for file, suffix in suffixes.items() if suffix in _READERS and suffix not in _OF_LISTS]
    if not found:
        by_name = sum(suffix in _OF_LISTS for suffix in suffixes.values())
        hint = f"; {by_name} of {' or '.join(_OF_LISTS)} are read by their names alone" if by_name else ""
        known = " ".join(suffix for suffix in _READERS if suffix not in _OF_LISTS)
        raise ScanFileError(name, f"no scan file in this folder, supported are {known}{hint}")
    return [Path(name, file) for file in sorted(found, key=natural)]


def natural(name: str) -> tuple[list[str | int], str]:
    """What sorts names naturally: digits count as the numbers that they are."""
    # Text and digits take turns.
    return [int(piece) if place % 2 else piece for place, piece in enumerate(_DIGITS.split(name))], name


def _names(columns: ColumnsLike) -> list[str]:
    expected = 'names of columns with x, y and z among them, such as "x y z i"'
    given = re.split(r"[ ,]+", columns.strip()) if isinstance(columns, str) else columns
    if not isinstance(given, Sequence) or not all(isinstance(of, str) for of in given):
        raise ArgumentError("columns", excerpt(columns), expected)
    names = list(given)
    try:
        axes_of(names)
    except AxisMissing:
        raise ArgumentError("columns", excerpt(columns), expected) from None
    return names


def _of_text(data: bytes, names: list[str] | None) -> F64:
    return text.points_of(data, None if names is None else axes_of(names))


_READERS: dict[str, _Reader] = {
    ".ply": lambda data, _: ply.points_of(data),
    ".pcd": lambda data, _: pcd.points_of(data),
    ".xyz": _of_text,
    ".txt": _of_text,
    ".csv": _of_text,
    ".npy": points_of_array,
    ".bin": lambda data, names: points_of_floats(data, names, 4),
    ".f32": lambda data, names: points_of_floats(data, names, 3),
}
