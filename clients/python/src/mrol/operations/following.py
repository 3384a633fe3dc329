"""Streams that end only for good: where the connection breaks, they come back."""

import time
from collections.abc import Callable, Generator
from contextlib import closing
from typing import TypeVar

from .._transport.attempts import PASSING
from .._transport.caller import Body, Caller
from .._transport.deadline import Deadline
from .._transport.stop import Stop
from ..errors import BadAnswer, ConnectionLost, MrolError, ServerError, TransportError

PAUSE_S = 0.2
"""How long a stream waits before it comes back."""

SILENCE_MAX_S = 60.0
"""A stream that is told nothing for so long, no heartbeat either, has lost its connection."""

PIECE_BYTES = 1 << 16

COMES_BACK = PASSING | {"watch_stalled", "map_replaced"}
"""Reasons after which a stream comes back. Of the map that has the name now a server tells all, whatever was told of another."""

Item = TypeVar("Item")


def following(caller: Caller, connect: Callable[[], Generator[Item, None, None]], stop: Stop) -> Generator[Item, None, None]:
    """What connections tell, one after the other: `connect` makes one that goes on where the last one ended.

    It ends by what ends a stream for good, and where the server does not come back within `patience_s`; and without an error once
    it is stopped.
    """
    failing_since: float | None = None
    while not stop.is_set:
        try:
            with closing(connect()) as items:
                for item in items:
                    failing_since = None
                    yield item
        except MrolError as error:
            if stop.is_set:
                return
            now = time.monotonic()
            failing_since = now if failing_since is None else failing_since
            if now - failing_since > caller.bounds.patience_s or not _comes_back(error):
                raise
            time.sleep(PAUSE_S)


def exactly(body: Body, count: int, deadline: Deadline) -> bytes:
    """So many bytes of a stream."""
    data = b""
    while len(data) < count:
        data += _unless_ended(body.read(count - len(data), deadline))
    return data


class Lines:
    """The lines of a stream, none longer than `most` bytes."""

    def __init__(self, body: Body, most: int) -> None:
        self._body = body
        self._most = most
        self._rest = b""

    def next(self, deadline: Deadline) -> bytes:
        """The next line, without its end."""
        while b"\n" not in self._rest:
            if len(self._rest) > self._most:
                raise BadAnswer(f"a line of more than answer_bytes_max, {self._most}, bytes")
            self._rest += _unless_ended(self._body.read_some(PIECE_BYTES, deadline))
        line, _, self._rest = self._rest.partition(b"\n")
        return line


def _unless_ended(data: bytes) -> bytes:
    if not data:
        raise ConnectionLost("the stream broke off")
    return data


def _comes_back(error: MrolError) -> bool:
    return isinstance(error, TransportError) or (isinstance(error, ServerError) and error.reason in COMES_BACK)
