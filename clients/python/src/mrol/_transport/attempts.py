"""When a request is sent again, where, and how soon."""

import random
import time

from ..errors import ConnectFailed, ConnectionLost, MrolError, ServerError, TransportError
from .deadline import Deadline
from .request import Request

PAUSE_FIRST_S = 0.02
PAUSE_MAX_S = 1.0

PASSING = frozenset({"overloaded", "starting", "draining", "catalog_busy", "body_stalled"})
"""Reasons of refusals that are over soon. A refused request changed nothing, so it may be sent again, whatever it is."""


LATE = "revision_not_reached"
"""The reason of a refusal by a server that has not got the `min_revision` of a question: another one may have it."""

GOING = frozenset({"starting", "draining", LATE})
"""Reasons of refusals by a server that is not there yet, or no more, or late: another one is asked, and later calls begin there."""


class Attempts:
    """The attempts at one call: as many as its patience and its deadline allow, and one at each of several servers at least."""

    def __init__(self, patience_s: float, deadline: Deadline, servers: int = 1) -> None:
        self._patience_s = patience_s
        self._deadline = deadline
        self._failing_since: float | None = None
        self._failures = 0
        self._servers = servers
        # Servers that are yet to be asked before there is a pause.
        self._others = servers - 1
        self._unreachable: list[str] = []
        self._first: MrolError | None = None
        self._has_renewed = False
        self._was_lost = False

    def _note(self, error: MrolError) -> None:
        """Notes a loss on the way: that a later attempt is refused does not say that the lost one changed nothing."""
        if isinstance(error, ServerError):
            error.is_after_loss = self._was_lost
        self._was_lost |= isinstance(error, TransportError) and not isinstance(error, ConnectFailed)

    def may_renew(self, error: MrolError, request: Request, was_kept: bool) -> bool:
        """Whether the call is to be sent to the same one of several servers again, over a new connection: once.

        A connection that was kept may have been closed by a server that is there.
        """
        may = (
            self._servers > 1 and was_kept and not self._has_renewed and isinstance(error, ConnectionLost) and request.is_repeatable
        )
        self._has_renewed |= may
        self._was_lost |= may
        return may

    def is_over_here(self, error: MrolError) -> bool:
        """Whether later calls are to begin at another server."""
        return self._servers > 1 and (
            isinstance(error, TransportError) or (isinstance(error, ServerError) and error.reason in GOING)
        )

    def may_go_on(self, error: MrolError, request: Request) -> bool:
        """Whether the call is to be sent to another server now."""
        self._note(error)
        is_late = isinstance(error, ServerError) and error.reason == LATE
        may = self._others > 0 and self.is_over_here(error) and (is_late or _may_be_repeated(error, request))
        self._others -= may
        if may and isinstance(error, ConnectFailed):
            self._unreachable.append(str(error))
        elif may and self._first is None:
            self._first = error
        return may

    def of_all(self, error: MrolError) -> MrolError:
        """The error of the call, where the last of several servers has failed by this one.

        Of servers that were not there all are named, unless one has refused the call, or it was sent to one and lost.
        """
        if not isinstance(error, ConnectFailed):
            return error
        if self._first is not None:
            return self._first
        return ConnectFailed("; ".join(dict.fromkeys([*self._unreachable, str(error)]))) if self._unreachable else error

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
            raise self.of_all(error)
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
