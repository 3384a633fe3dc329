"""Arrays as they are sent: little-endian and contiguous. What is that already is not copied."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ArgumentError, excerpt

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U32 = NDArray[np.uint32]
Bools = NDArray[np.bool_]
Shape = tuple[int, ...]

AXES = ("x", "y", "z")


def as_numbers(value: ArrayLike, argument: str, expected: str) -> NDArray[Any]:
    """The array of real numbers that a value is, of any shape and type of number.

    Raises `ArgumentError` for everything else.
    """
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise ArgumentError(argument, "an array with masked values", f"{expected}; fill it first: .filled(numpy.nan)")
    try:
        array = np.asarray(value)
    except Exception as error:
        # Lists of unequal lengths, and whatever an object's own conversion raises.
        raise ArgumentError(argument, f"{excerpt(type(value))}: {excerpt(error)}", expected) from error
    if array.dtype.names is not None and set(AXES) <= set(array.dtype.names):
        array = _of_named_axes(array, argument, expected)
    if array.dtype.kind not in "fiu":
        raise ArgumentError(argument, f"an array of {array.dtype}", expected)
    return array


def rows_of(value: ArrayLike, columns: int, argument: str, expected: str, bytes_max: int) -> tuple[F32, Shape]:
    """Numbers as rows of so many little-endian floats, and the shape in which the rows were given.

    An array of shape (..., columns) is n rows, where n is the product of the other lengths.
    """
    array = as_numbers(value, argument, expected)
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
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise ArgumentError(argument, f"an array of {array.dtype} of shape {array.shape}", expected)
    if array.size > 0 and not (int(array.min()) >= 0 and int(array.max()) < 1 << 32):
        raise ArgumentError(argument, excerpt(array), expected)
    return np.ascontiguousarray(array, np.dtype("<u4"))


def vector_of(value: ArrayLike, length: int, argument: str) -> list[float]:
    """So many finite or infinite numbers, as a list; no NaN."""
    expected = f"{length} numbers"
    array = as_numbers(value, argument, expected)
    if array.shape != (length,) or np.isnan(array).any():
        raise ArgumentError(argument, excerpt(value), expected)
    return [float(number) for number in array]


def number_of(value: object, argument: str) -> float:
    """A finite number."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise ArgumentError(argument, excerpt(value), "a finite number")
    return float(value)


def whole_of(value: object, argument: str, least: int = 0, most: int = (1 << 64) - 1) -> int:
    """A whole number in a range."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise ArgumentError(argument, excerpt(value), f"a whole number of {least} to {most}")
    return value


def raw(array: NDArray[Any]) -> memoryview:
    """The bytes of a contiguous array, where they are."""
    return array.reshape(-1).view(np.uint8).data


def numbers_text(numbers: list[float]) -> str:
    """Numbers as a parameter of an address."""
    return ",".join(map(repr, numbers))


def _of_named_axes(array: NDArray[Any], argument: str, expected: str) -> NDArray[Any]:
    """Coordinates of an array of records with fields x, y and z, as clouds of points are often kept."""
    kinds = [array.dtype[name] for name in AXES]
    if any(kind.kind not in "fiu" or kind.shape for kind in kinds):
        raise ArgumentError(argument, f"an array of {array.dtype}", expected)
    return np.stack([array[name] for name in AXES], axis=-1)
