"""Until when a call may last."""

import math
import socket
from time import monotonic

from .._arrays import number_of
from ..errors import ArgumentError, TimedOut, excerpt
from .stop import Stop

TIMEOUT_MAX_S = 10 * 365 * 86_400.0
"""The longest time of a call: what is longer is more than the system's timers take."""


def seconds(value: object, argument: str) -> float:
    """A time in seconds that is a number above 0; an infinite one is the longest there is."""
    expected = "a number of seconds above 0"
    if isinstance(value, float) and value == math.inf:
        return TIMEOUT_MAX_S
    number = number_of(value, argument, expected)
    if number <= 0:
        raise ArgumentError(argument, excerpt(value), expected)
    return min(number, TIMEOUT_MAX_S)


class Deadline:
    """A moment after which a call does not go on; a `stop` may end it before."""

    __slots__ = ("_end", "_stop", "_timeout_s")

    def __init__(self, timeout_s: float, stop: Stop | None = None) -> None:
        self._timeout_s = timeout_s
        self._stop = stop
        self._end = monotonic() + timeout_s

    def remaining_s(self) -> float:
        """Seconds that are left.

        Raises `TimedOut` where none are.
        """
        left = self._end - monotonic()
        if left <= 0:
            raise self.passed()
        return left

    def within(self, timeout_s: float) -> "Deadline":
        """The moment after so many seconds, or this one if it is earlier; the same stop ends it."""
        earlier = Deadline(timeout_s, self._stop)
        earlier._end = min(earlier._end, self._end)
        return earlier

    def guard(self, sock: socket.socket) -> None:
        """Sets the time of what waits on a socket, and lets the stop end it.

        Raises `TimedOut` where none is left, and `ConnectionLost` where it was stopped.
        """
        sock.settimeout(self.remaining_s())
        if self._stop is not None:
            self._stop.guard(sock)

    def passed(self) -> TimedOut:
        """The error that says that the time is up."""
        return TimedOut(f"no answer within {self._timeout_s:g} s")
