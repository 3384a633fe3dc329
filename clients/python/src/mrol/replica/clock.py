"""Times that the extension's clocks can count."""

from .._arrays import number_of
from ..errors import ArgumentError, excerpt

SECONDS_MAX = 1e9


def seconds_of(value: float, argument: str) -> float:
    """A time in seconds, 0 or more, and no more than is counted."""
    seconds = number_of(value, argument)
    if not 0 <= seconds <= SECONDS_MAX:
        raise ArgumentError(argument, excerpt(value), f"seconds, 0 to {SECONDS_MAX:g}")
    return seconds
