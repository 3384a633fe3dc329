"""When a request is sent again, and how soon."""

import random
import time

from ..errors import ConnectFailed, ConnectionLost, MrolError, ServerError
from .deadline import Deadline
from .request import Request

PAUSE_FIRST_S = 0.02
PAUSE_MAX_S = 1.0

PASSING = frozenset({"overloaded", "starting", "draining", "catalog_busy", "body_stalled"})
"""Reasons of refusals that are over soon. A refused request changed nothing, so it may be sent again, whatever it is."""


class Attempts:
    """The attempts at one call: as many as its patience and its deadline allow."""

    def __init__(self, patience_s: float, deadline: Deadline) -> None:
        self._patience_s = patience_s
        self._deadline = deadline
        self._failing_since: float | None = None
        self._failures = 0

    def pause_after(self, error: MrolError, request: Request, was_kept: bool) -> None:
        """Waits until the request may be sent again.

        Raises the error where sending it again would not help, might do something twice, or comes too late. `was_kept` tells of a
        connection that was used before: a server that restarts closes those, so the first such failure costs no time.
        """
        if not _may_be_repeated(error, request):
            raise error
        now = time.monotonic()
        if self._failing_since is None:
            self._failing_since = now
        self._failures += 1
        if was_kept and self._failures == 1 and isinstance(error, ConnectionLost):
            return
        pause_s = self._pause_s(error)
        if now + pause_s - self._failing_since > self._patience_s or pause_s > self._deadline.remaining_s():
            raise error
        time.sleep(pause_s)

    def _pause_s(self, error: MrolError) -> float:
        longest_s = min(PAUSE_MAX_S, PAUSE_FIRST_S * 2 ** min(self._failures - 1, 10))
        # Callers that failed together do not come back together.
        pause_s = random.uniform(longest_s / 2, longest_s)
        told_s = error.retry_after_s if isinstance(error, ServerError) else None
        return pause_s if told_s is None else max(pause_s, told_s)


def _may_be_repeated(error: MrolError, request: Request) -> bool:
    if isinstance(error, ConnectFailed):
        return True
    if isinstance(error, ServerError):
        return error.reason in PASSING
    return isinstance(error, ConnectionLost) and request.is_repeatable
