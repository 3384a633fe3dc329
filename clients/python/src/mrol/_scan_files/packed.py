"""Points as bare little-endian float32, row by row, and arrays of numpy."""

import io
from collections.abc import Sequence

import numpy as np

from .._arrays import F64, as_numbers
from ..errors import ArgumentError
from .axes import Columns, axes_of
from .problem import Problem, quoted
from .row_length import NAMES, other_row_length

COLUMNS_MAX = 16
"""Columns of an array, without a word about them: of one with more each column may be a point."""

NUMBER_BYTES = 4


def points_of_floats(data: bytes, columns: Sequence[str] | None, usual: int) -> F64:
    """The points of rows with these columns, or of so many as the file's extension says."""
    length = usual if columns is None else len(columns)
    row_bytes = NUMBER_BYTES * length
    if len(data) % row_bytes:
        points = f"{len(data)} bytes are not whole points of {row_bytes} bytes, point {len(data) // row_bytes} is cut short"
        others = [] if columns is not None else [of for of in NAMES if of != usual and len(data) % (NUMBER_BYTES * of) == 0]
        raise Problem(points + "".join(f"; they may be rows of {of} numbers: give {_option(of)}" for of in others[:1]))
    values = np.frombuffer(data, "<f4")
    if columns is None and (other := other_row_length(values, length)) is not None:
        raise Problem(
            f"the numbers look like rows of {other} ({NAMES[other]}), not of {length} ({NAMES[length]}): give {_option(other)}, "
            f"or {_option(length)} where they are that"
        )
    return _coordinates(values.reshape(-1, length), None if columns is None else axes_of(columns))


def points_of_array(data: bytes, columns: Sequence[str] | None) -> F64:
    """The points of a file of numpy: an array of shape (..., 3) or with more columns, or records with fields x, y and z."""
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise Problem(f"no array of numpy: {quoted(str(error))}") from None
    if not isinstance(array, np.ndarray):
        raise Problem("an archive of arrays: save one array by numpy.save")
    try:
        array = as_numbers(array, "the array", "numbers x y z")
    except ArgumentError as error:
        raise Problem(str(error)) from None
    width = array.shape[-1] if array.ndim else 0
    if columns is None and not 3 <= width <= COLUMNS_MAX:
        raise Problem(f"an array of shape {array.shape}, where (..., 3) is needed, or columns behind x y z, up to {COLUMNS_MAX}")
    if columns is not None and width != len(columns):
        raise Problem(f"an array of shape {array.shape}, where columns has {len(columns)}")
    return _coordinates(array.reshape(-1, width), None if columns is None else axes_of(columns))


def _option(length: int) -> str:
    return f'columns="{NAMES[length]}"'


def _coordinates(rows: "np.typing.NDArray[np.generic]", axes: Columns | None) -> F64:
    return rows[:, (0, 1, 2) if axes is None else axes].astype(np.float64)
