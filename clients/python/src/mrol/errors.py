"""What goes wrong, as exceptions: all of them are `MrolError`.

MrolError                 itself: a map file that changed, or could not be read, while it was sent
  ArgumentError           an argument was refused before anything was sent (a ValueError)
  ScanFileError           a scan file that is broken or none (a ValueError)
  ServerError             the server refused; it changed nothing, but where `repeat_with` says that nobody knows
    InvalidArgument, Unauthenticated, PermissionDenied, NotFound, Conflict, FailedPrecondition,
    ResourceExhausted, DeadlineExceeded, Unavailable, Internal
  TransportError          there is no answer
    ConnectFailed         no connection was made: nothing was sent (a ConnectionError)
    ConnectionLost        it broke before the answer was there (a ConnectionError)
    TimedOut              the call's own time was up (a TimeoutError)
  BadAnswer               what came is no answer of an mrol server
    WrongPort             the address is one of gRPC, or of TLS without https://
"""

import re
from collections.abc import Mapping
from reprlib import Repr
from types import MappingProxyType
from typing import Any

from ._secrets import masked, masked_bytes

EXCERPT_MAX = 200
"""Characters of a value that a message shows."""

PROBLEM_MAX = 500
"""Characters of what a message says about a file, which may repeat a part of it."""

_ITEMS_MAX = 40
_NESTING_MAX = 4


class _Excerpt(Repr):
    """Writes what is long in part: a list of a million numbers would take as long to write as to send."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel = _NESTING_MAX
        self.maxlist = self.maxtuple = self.maxdict = self.maxset = self.maxfrozenset = self.maxdeque = self.maxarray = _ITEMS_MAX
        self.maxstring = self.maxother = EXCERPT_MAX + 3

    def repr1(self, x: Any, level: int) -> str:
        if isinstance(x, int) and x.bit_length() > 4 * EXCERPT_MAX:
            # Python refuses to write numbers of thousands of digits.
            return f"a number of {x.bit_length()} bits"
        # Before it is cut: of a secret in the middle of the cut a part would be left.
        if isinstance(x, bytes | bytearray):
            return repr(masked_bytes(x)[: EXCERPT_MAX + 3])
        return super().repr1(masked(x) if isinstance(x, str) else x, level)


def excerpt(value: object) -> str:
    """A value as a message shows it: in one line, without secrets, and cut where it is long."""
    try:
        text = re.sub(r"\s*\n\s*", " ", masked(_Excerpt().repr(value)))
    except Exception:
        # Whatever an object's own `__repr__` raises.
        text = f"an object of {type(value).__name__}"
    return text if len(text) <= EXCERPT_MAX else f"{text[:EXCERPT_MAX]}..."


class MrolError(Exception):
    """The base of all errors of this package.

    Of a change whose outcome is not known, `repeat_with` has the arguments (`session` and `scan_id`, or `request_id`) with which
    the same call does it once; it is empty of everything else.

    What it says is without the secrets of this process, also where a peer has said them.
    """

    repeat_with: Mapping[str, Any] = MappingProxyType({})

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(masked(given) if isinstance(given, str) else given for given in arguments))


OUTCOME_UNKNOWN = ("outcome_unknown", "deadline_exceeded")
"""Reasons and codes of refusals after which a change may have been made."""


def is_outcome_unknown(error: MrolError) -> bool:
    """Whether the change that failed so may have been made."""
    if isinstance(error, ServerError):
        return error.is_after_loss or error.reason in OUTCOME_UNKNOWN or error.code in OUTCOME_UNKNOWN
    return isinstance(error, TransportError | BadAnswer)


class ArgumentError(MrolError, ValueError):
    """An argument that cannot be sent.

    `argument` names it, `value` says what was given, `expected` what belongs there.
    """

    def __init__(self, argument: str, value: str, expected: str) -> None:
        super().__init__(f"{argument} must be {expected}, got {value}")
        self.argument = argument
        self.value = masked(value)
        self.expected = expected

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.argument, self.value, self.expected)


class ScanFileError(MrolError, ValueError):
    """A scan file that cannot be read as what it is, or a folder without one.

    `path` names it, `problem` says what is wrong, and `line` where, counted from 1, in a file of text.
    """

    def __init__(self, path: str, problem: str, line: int | None = None) -> None:
        shown = problem if len(problem) <= PROBLEM_MAX else f"{problem[:PROBLEM_MAX]}..."
        super().__init__(f"{path}{'' if line is None else f':{line}'}: {shown}")
        self.path = path
        self.problem = masked(shown)
        self.line = line

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.path, self.problem, self.line)


class ServerError(MrolError):
    """The server's refusal.

    `reason` is a stable word for programs (`docs/guide/api.md` lists all with what to do), `code` the kind of failure, `status`
    that of HTTP, `message` a sentence with field, value and limit, and `retry_after_s` how long to wait where the server can tell.
    `is_after_loss` says that the request had been sent before, and that attempt was lost: a change may have been made by it.
    """

    is_after_loss = False

    def __init__(self, status: int, code: str, reason: str, message: str, retry_after_s: float | None = None) -> None:
        super().__init__(f"{message} ({reason})")
        self.status = status
        self.code = masked(code)
        self.reason = masked(reason)
        self.message = masked(message)
        self.retry_after_s = retry_after_s

    def __reduce__(self) -> tuple[Any, ...]:
        of_init = (self.status, self.code, self.reason, self.message, self.retry_after_s)
        return type(self), of_init, vars(self).copy()


class InvalidArgument(ServerError):
    """The request can never succeed as it is."""


class Unauthenticated(ServerError):
    """There is no key, or none that counts."""


class PermissionDenied(ServerError):
    """The key is for less."""


class NotFound(ServerError):
    """There is no such map, scan, keep-out or route."""


class Conflict(ServerError):
    """It is there already, and is not the same."""


class FailedPrecondition(ServerError):
    """The state of the map does not allow it."""


class ResourceExhausted(ServerError):
    """A limit was reached: come later, or ask for less."""


class DeadlineExceeded(ServerError):
    """The server's time for the request was up."""


class Unavailable(ServerError):
    """The server cannot do it now."""


class Internal(ServerError):
    """A defect or a disk error of the server; its log has it."""


class TransportError(MrolError):
    """There is no answer."""


class ConnectFailed(TransportError, ConnectionError):
    """No connection was made, so nothing was sent."""


class ConnectionLost(TransportError, ConnectionError):
    """The connection broke before the answer was there."""


class TimedOut(TransportError, TimeoutError):
    """The time of the call was up."""


class BadAnswer(MrolError):
    """What came is no answer of an mrol server, or not one that this version of the package understands."""


class WrongPort(BadAnswer):
    """The address is one of another protocol: the server's gRPC, or TLS where the address does not say https."""


_BY_CODE: dict[str, type[ServerError]] = {
    "invalid_argument": InvalidArgument,
    "unauthenticated": Unauthenticated,
    "permission_denied": PermissionDenied,
    "not_found": NotFound,
    "conflict": Conflict,
    "failed_precondition": FailedPrecondition,
    "resource_exhausted": ResourceExhausted,
    "deadline_exceeded": DeadlineExceeded,
    "unavailable": Unavailable,
    "internal": Internal,
}


def server_error(status: int, code: str, reason: str, message: str, retry_after_s: float | None = None) -> ServerError:
    """The exception of a kind of failure."""
    return _BY_CODE.get(code, ServerError)(status, code, reason, message, retry_after_s)
