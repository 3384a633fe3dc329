"""Failures of the extension, as the exceptions that this package raises for the same."""

from .. import errors

STATUS: dict[str, int] = {
    "invalid_argument": 400,
    "unauthenticated": 401,
    "permission_denied": 403,
    "not_found": 404,
    "conflict": 409,
    "failed_precondition": 412,
    "resource_exhausted": 429,
    "deadline_exceeded": 504,
    "unavailable": 503,
    "internal": 500,
}
"""The status of HTTP that a kind of failure has most often: nothing here goes by HTTP."""

GRPC: dict[str, str] = {"already_exists": "conflict", "aborted": "conflict", "out_of_range": "invalid_argument"}
"""The names of gRPC that are others here."""


class Closed(errors.MrolError):
    """The replica or the map was closed."""


class Forked(errors.MrolError):
    """It belongs to the process that forked this one: open one in each process."""


class TooLarge(errors.MrolError):
    """The map is larger than the options of the replica allow."""


class Refused(errors.MrolError, ValueError):
    """An argument makes no sense; the message names it, with its value and its limit."""


def argument(name: str, value: object, expected: str) -> errors.ArgumentError:
    """The exception of an argument that the extension looks at itself."""
    return errors.ArgumentError(name, errors.excerpt(value), expected)


def exception(kind: str, code: str, reason: str, message: str) -> errors.MrolError:
    """The exception of a failure."""
    if kind == "refused":
        word = GRPC.get(code, code)
        return errors.server_error(STATUS.get(word, 500), word, reason, message)
    kinds: dict[str, type[errors.MrolError]] = {
        "argument": Refused,
        "closed": Closed,
        "forked": Forked,
        "too_large": TooLarge,
        "unreachable": errors.ConnectFailed,
        "lost": errors.ConnectionLost,
        "timed_out": errors.TimedOut,
        "damaged": errors.BadAnswer,
    }
    return kinds.get(kind, errors.MrolError)(message)
