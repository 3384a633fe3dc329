"""Arrays as they are sent: little-endian and contiguous. What is that already is not copied."""

import array as arrays_of_python
import math
from collections.abc import Sequence
from itertools import chain
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ArgumentError, excerpt

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U32 = NDArray[np.uint32]
Bools = NDArray[np.bool_]
Shape = tuple[int, ...]

_F32 = np.dtype("<f4")

WORD_MAX = (1 << 64) - 1
"""The largest number of 64 bits."""

AXES = ("x", "y", "z")

NOT_OF_ARRAYS = (str, bytes, bytearray, memoryview, range, arrays_of_python.array)
"""Sequences in which there is no array."""


def as_numbers(value: ArrayLike, argument: str, expected: str) -> NDArray[Any]:
    """The array of real numbers that a value is, of any shape and type of number.

    Raises `ArgumentError` for everything else.
    """
    try:
        array = np.asarray(value)
    except Exception as error:
        # Lists of unequal lengths, and whatever an object's own conversion raises.
        raise ArgumentError(argument, f"{excerpt(type(value))}: {excerpt(error)}", expected) from error
    refuse_masked(value, array.ndim, argument, expected)
    if array.dtype.names is not None and set(AXES) <= set(array.dtype.names):
        array = _of_named_axes(array, argument, expected)
    if array.dtype.kind not in "fiu":
        raise ArgumentError(argument, f"an array of {array.dtype}", expected)
    return array


def refuse_masked(value: object, axes: int, argument: str, expected: str) -> None:
    """Refuses masked values, of an array or of those in a sequence of arrays: numpy takes the numbers behind the masks.

    `axes` is how deep sequences lie in each other.
    """
    level: list[Any] = [value]
    for _ in range(axes + 1):
        kinds = set(map(type, level))
        if any(issubclass(kind, np.ma.MaskedArray) for kind in kinds) and any(map(_is_masked, level)):
            raise ArgumentError(argument, "an array with masked values", f"{expected}; fill it first: .filled(numpy.nan)")
        nested = tuple(kind for kind in kinds if issubclass(kind, Sequence) and not issubclass(kind, NOT_OF_ARRAYS))
        if not nested:
            return
        level = list(chain.from_iterable(level if len(nested) == len(kinds) else (of for of in level if type(of) in nested)))


def are_rows(value: object, columns: int, bytes_max: int) -> "TypeGuard[F32]":
    """Whether a value is an array of rows as they are sent, so that nothing of it has to be looked at.

    What it spares takes as long as some hundred look-ups.
    """
    return (
        type(value) is np.ndarray
        and value.dtype == _F32
        and value.ndim > 1
        and value.shape[-1] == columns
        and value.flags.c_contiguous
        and value.nbytes <= bytes_max
    )


def rows_of(value: ArrayLike, columns: int, argument: str, expected: str, bytes_max: int) -> tuple[F32, Shape]:
    """Numbers as rows of so many little-endian floats, and the shape in which the rows were given.

    An array of shape (..., columns) is n rows, where n is the product of the other lengths; one of shape (0,) is no rows.
    """
    if are_rows(value, columns, bytes_max):
        return (value if value.ndim == 2 else value.reshape(-1, columns)), value.shape[:-1]
    array = as_numbers(value, argument, expected)
    if array.shape == (0,):
        array = array.reshape(0, columns)
    if array.ndim == 0 or array.shape[-1] != columns:
        raise ArgumentError(argument, f"shape {array.shape}", expected)
    return as_floats(array, argument, expected, bytes_max).reshape(-1, columns), array.shape[:-1]


def as_floats(array: NDArray[Any], argument: str, expected: str, bytes_max: int) -> F32:
    """Numbers as contiguous little-endian floats: the array itself where it is that."""
    if array.size * 4 > bytes_max:
        given = f"{array.size * 4} bytes of float32"
        raise ArgumentError(argument, given, f"at most {bytes_max} bytes (request_bytes_max of connect)")
    with np.errstate(over="ignore", invalid="ignore"):
        floats = np.ascontiguousarray(array, np.dtype("<f4"))
    if array.dtype.kind == "f" and array.dtype.itemsize > 4:
        # What is too large would mean "no return" of a scan.
        beyond = np.isinf(floats) & np.isfinite(array)
        if beyond.any():
            raise ArgumentError(argument, excerpt(float(array[beyond][0])), f"{expected}, in the range of float32")
    return floats


def counts_of(value: ArrayLike, argument: str) -> U32:
    """Counts as little-endian unsigned numbers."""
    expected = "an array of counts, shape (n,)"
    array = as_numbers(value, argument, expected)
    # What has nothing in it is of floats, where nobody says otherwise.
    if array.ndim != 1 or (array.size > 0 and array.dtype.kind not in "iu"):
        raise ArgumentError(argument, f"an array of {array.dtype} of shape {array.shape}", expected)
    if array.size > 0 and not (int(array.min()) >= 0 and int(array.max()) < 1 << 32):
        raise ArgumentError(argument, excerpt(array), expected)
    return np.ascontiguousarray(array, np.dtype("<u4"))


def vector_of(value: ArrayLike, length: int, argument: str, is_finite: bool = False) -> list[float]:
    """So many numbers, as a list; no NaN, and infinite ones where they need not be finite."""
    expected = f"{length} finite numbers" if is_finite else f"{length} numbers"
    array = as_numbers(value, argument, expected)
    with np.errstate(all="ignore"):
        floats = array.astype(np.float64)
    # What is beyond the range of a double would mean "without bound".
    is_wrong = ~np.isfinite(floats) if is_finite else np.isnan(floats) | (np.isinf(floats) & np.isfinite(array))
    if array.shape != (length,) or np.any(is_wrong):
        raise ArgumentError(argument, excerpt(value), expected)
    return [float(number) for number in floats]


def number_of(value: object, argument: str, expected: str = "a finite number", least: float = -math.inf) -> float:
    """A finite number, not below the least."""
    number = _float_of(value)
    if number is None or not math.isfinite(number) or number < least:
        raise ArgumentError(argument, excerpt(value), expected)
    return number


def seconds_of(value: object, argument: str) -> float:
    """A time in seconds, 0 or more."""
    return number_of(value, argument, "a number of seconds, 0 or more", 0.0)


def whole_of(value: object, argument: str, least: int = 0, most: int = WORD_MAX) -> int:
    """A whole number in a range."""
    if type(value) is int and least <= value <= most:
        return value
    if isinstance(value, np.integer) and not isinstance(value, np.timedelta64):
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise ArgumentError(argument, excerpt(value), f"a whole number of {least} to {most}")
    return int(value)


def raw(array: NDArray[Any]) -> memoryview:
    """The bytes of a contiguous array, where they are."""
    return array.reshape(-1).view(np.uint8).data


def numbers_text(numbers: list[float]) -> str:
    """Numbers as a parameter of an address."""
    return ",".join(map(repr, numbers))


def _float_of(value: object) -> float | None:
    """A real number as one of Python's; None of all else, text and times of numpy among it."""
    is_number = isinstance(value, int | float | np.integer | np.floating)
    if not is_number or isinstance(value, bool | np.timedelta64):
        return None
    try:
        with np.errstate(all="ignore"):
            return float(value)  # type: ignore[arg-type]
    except OverflowError:
        return math.inf


def _is_masked(value: object) -> bool:
    if not isinstance(value, np.ma.MaskedArray):
        return False
    # Of records the mask has fields.
    mask = np.ascontiguousarray(np.ma.getmaskarray(value))
    return bool(mask.view(np.bool_).any())


def _of_named_axes(array: NDArray[Any], argument: str, expected: str) -> NDArray[Any]:
    """Coordinates of an array of records with fields x, y and z, as clouds of points are often kept."""
    kinds = [array.dtype[name] for name in AXES]
    if any(kind.kind not in "fiu" or kind.shape for kind in kinds):
        raise ArgumentError(argument, f"an array of {array.dtype}", expected)
    return np.stack([array[name] for name in AXES], axis=-1)
