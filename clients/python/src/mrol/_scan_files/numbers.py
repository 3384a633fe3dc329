"""Numbers in text: one by one, and many at once where a text is of plain numbers alone."""

import re
from collections.abc import Sequence

import numpy as np

from .._arrays import F64
from .lines import Lines
from .problem import Problem, quoted

_NUMBER = re.compile(r"[+-]?(?:inf|infinity|nan|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?)", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(r"\+?[0-9]+", re.ASCII)
_WORD_MAX = (1 << 64) - 1

_PLAIN = b"0123456789+-.eE \t\nnaifNAIF"
"""Characters of a text that is read at once: of finite numbers, NaN and infinities."""


def number(token: str) -> float:
    """A number; `nan` and `inf` are some."""
    if _NUMBER.fullmatch(token) is None:
        raise Problem(not_a_number(token))
    return float(token)


def not_a_number(token: str) -> str:
    """What is wrong with a token."""
    if "\ufffd" in token or "\0" in token:
        return f"not text but binary data: {quoted(token)}"
    return f"{quoted(token)} is not a number (a comment starts with #)"


def whole(token: str) -> int | None:
    """A whole number of 64 bits from 0 on, or None of all else."""
    if _WHOLE.fullmatch(token) is None or len(token) > 40:
        return None
    value = int(token)
    return value if value <= _WORD_MAX else None


def plain_rows(lines: Lines, columns: Sequence[int], count: int | None = None, separator: str | None = None) -> F64 | None:
    """These columns of the lines that follow, or of so many of them, where all of them are plain numbers.

    None where there is anything else: then they are read line by line, which takes ten times as long and finds what is wrong.
    """
    data = lines.rest()
    if lines.ends_with_cr:
        return None
    data = data.replace(b"\r\n", b"\n")
    if count is not None:
        # What follows is of no concern.
        pieces = data.split(b"\n", count)[:count]
        data = b"\n".join(pieces)
    if not data.strip() or data.translate(None, _PLAIN + (separator or "").encode()):
        return None
    try:
        rows = np.loadtxt(
            data.decode("ascii").split("\n"), np.float64, comments=None, delimiter=separator, usecols=columns, ndmin=2
        )
    except ValueError:
        return None
    return rows if count is None or len(rows) == count else None
