"""Values that belong nowhere, and what must become of them."""

import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import mrol


class Malicious:
    """An object whose conversion goes wrong."""

    def __array__(self, *_: object, **__: object) -> Any:
        raise RuntimeError("no array today")


class Endless:
    """An object that cannot be shown either."""

    def __repr__(self) -> str:
        raise RuntimeError("no words today")

    def __iter__(self) -> Iterator[int]:
        raise RuntimeError("no items today")


ODD: dict[str, Any] = {
    "None": None,
    "text": "odd",
    "empty text": "",
    "text with a NUL": "a\0b",
    "half a character": "\ud800",
    "bytes": b"odd",
    "a dict": {"x": 1},
    "an empty list": [],
    "a list of lists of unequal lengths": [[1, 2, 3], [1]],
    "a set": {1, 2},
    "NaN": float("nan"),
    "infinity": float("inf"),
    "a half": 0.5,
    "minus one": -1,
    "five": 5,
    "more than 64 bits": 1 << 64,
    "a number of many digits": 10**5000,
    "minus such a number": -(10**400),
    "True": True,
    "complex": 1 + 2j,
    "a number of numpy": np.float32(0.5),
    "NaN of numpy": np.float64("nan"),
    "a time": np.datetime64(5, "ns"),
    "a duration": np.timedelta64(5, "ns"),
    "an array of two axes": np.zeros((2, 2)),
    "an array of nothing": np.zeros((0, 3)),
    "an array of objects": np.array([None, "x", 1], dtype=object),
    "an array of times": np.zeros((1, 3), "M8[s]"),
    "an array of complex": np.zeros((1, 3), complex),
    "an array of text": np.array(["a", "b"]),
    "infinite numbers": [np.inf, np.inf, np.inf],
    "numbers beyond float64": np.array(["1e4000"] * 3, np.longdouble),
    "masked values": np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0]),
    "a list of masked values": [np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0])],
    "a pose": mrol.Pose.identity(),
    "a class": dict,
    "a function": len,
    "an object that is not to be read": Malicious(),
    "an object that is not to be shown": Endless(),
}


def error_of(call: Callable[[], object]) -> mrol.MrolError | None:
    """What a call ends by. An error that is none of this package ends the test."""
    try:
        call()
    except mrol.MrolError as error:
        return error
    return None


def must_be_named(call: Callable[[], object], names: str, odd: str) -> None:
    """What cannot be sent is refused by a word that names the argument; the server, or a map in this process, the rest."""
    error = error_of(call)
    if isinstance(error, mrol.ArgumentError):
        assert re.match(names, error.argument), (odd, error)
        assert error.expected
        assert str(error).startswith(f"{error.argument} must be ")
        assert len(str(error)) < 1000
    elif isinstance(error, mrol.ServerError):
        assert error.status < 500, (odd, error)
    elif error is not None:
        # What a map in this process refuses is a ValueError as well.
        assert isinstance(error, ValueError), (odd, error)
