"""Counts of headers, checked against the bytes that are there."""

from .problem import Problem

POINTS_MAX = 100_000_000
"""Points that a header may declare."""

HEADER_BYTES_MAX = 1 << 20
"""Bytes of a file in which its header must end."""

FILE_BYTES_MAX = 1 << 30
"""Bytes that a scan file may have."""

VALUE_BYTES_MIN = 2
"""Bytes of a value of text at least: a digit and what divides it from the next one."""


def check_count(what: str, count: int, entry_bytes: int, have: int) -> None:
    """Refuses a count of entries, each of so many bytes at least, where fewer bytes follow, or too many entries."""
    if count > POINTS_MAX:
        raise Problem(f"the header declares {count} {what}, the limit is {POINTS_MAX}")
    if count * entry_bytes > have or (entry_bytes == 0 and count > 0):
        raise Problem(
            f"the header declares {count} {what} of at least {entry_bytes} bytes each, but {have} bytes follow: "
            "the file is truncated or its header wrong"
        )
