"""Streams of messages of protocol buffers, each behind its length."""

from .._protobuf import Message
from .._transport.caller import Body
from .._transport.deadline import Deadline
from ..errors import BadAnswer, ServerError, excerpt, server_error
from .following import exactly

LENGTH_BYTES = 4

KINDS = {
    3: ("invalid_argument", 400),
    4: ("deadline_exceeded", 504),
    5: ("not_found", 404),
    6: ("conflict", 409),
    7: ("permission_denied", 403),
    8: ("resource_exhausted", 429),
    9: ("failed_precondition", 412),
    13: ("internal", 500),
    14: ("unavailable", 503),
    16: ("unauthenticated", 401),
}
"""The code and the status of HTTP of each status of gRPC, which the message that ends a stream has."""


def next_message(body: Body, deadline: Deadline, most: int) -> memoryview:
    """The bytes of the next message, at most so many."""
    length = int.from_bytes(exactly(body, LENGTH_BYTES, deadline), "little")
    if length > most:
        raise BadAnswer(f"a message of {length} bytes, more than answer_bytes_max, {most}")
    return memoryview(exactly(body, length, deadline))


def failure_of(of: Message) -> ServerError:
    """Why a stream ended, as its last message says."""
    code, status = KINDS.get(of.whole(1), ("internal", 500))
    retry_after_s = of.double(4) if of.has(4) else None
    return server_error(status, code, of.text(2), excerpt(of.text(3)).strip("'\""), retry_after_s)
