"""Requests to a server: each with a key, a connection, a deadline and, where it is safe, another try."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import TypeVar

from ..errors import BadAnswer, ConnectionLost, ServerError, TransportError, Unauthenticated, excerpt, server_error
from .address import Address
from .attempts import Attempts
from .connection import Connection
from .deadline import Deadline, seconds
from .key import Key, Secret
from .pool import Pool
from .redirect import STATUS as SENT_ON
from .redirect import target
from .request import Answer, Request
from .response import Response
from .servers import Servers
from .stop import OpenStreams, Stop

Of = TypeVar("Of")

ERROR_BYTES_MAX = 1 << 20
"""Bytes of an answer that says what is wrong, of one that is read piece by piece otherwise."""


@dataclass(frozen=True)
class Bounds:
    """How long calls last and how large they are."""

    timeout_s: float
    patience_s: float
    request_bytes_max: int
    answer_bytes_max: int


class Caller:
    """Asks one server, or one of several until it is gone; threads and forked processes may share it."""

    def __init__(self, servers: Servers, key: Key, bounds: Bounds, streams: OpenStreams | None = None) -> None:
        self._servers = servers
        self._key = key
        self.bounds = bounds
        self.streams = OpenStreams() if streams is None else streams
        """The watches that `close` ends."""

    def with_timeout(self, timeout_s: float, streams: OpenStreams | None = None) -> "Caller":
        """The same caller, over the same connections and with the same streams or others, with another time for each call."""
        bounds = replace(self.bounds, timeout_s=seconds(timeout_s, "timeout_s"))
        return Caller(self._servers, self._key, bounds, self.streams if streams is None else streams)

    @property
    def address(self) -> str:
        """The address of the server in use."""
        return str(self.place)

    @property
    def place(self) -> Address:
        """Where the server in use is."""
        return self._servers.current.address

    @property
    def has_several(self) -> bool:
        """Whether there are several servers."""
        return len(self._servers) > 1

    def close(self) -> None:
        """Ends the streams, and closes the connections that are kept."""
        self.streams.close()
        self._servers.close()

    def call(self, request: Request, deadline: Deadline | None = None) -> Answer:
        """The answer to a request, whole, within its own time or by a deadline.

        Raises `ServerError` for a refusal, and `TransportError` or `BadAnswer` where there is no answer.
        """
        deadline = deadline or Deadline(self.bounds.timeout_s)
        attempts = Attempts(self.bounds.patience_s, deadline, len(self._servers))
        may_renew, hops, pool = True, 0, self._servers.current
        while True:
            was_kept, secret = False, self._key.secret()
            try:
                connection, was_kept = self._servers.take(pool, deadline, may_be_kept=request.is_repeatable)
                try:
                    answer = connection.ask(request, secret, deadline, self.bounds.answer_bytes_max)
                finally:
                    pool.give_back(connection)
                if answer.status == SENT_ON and self.has_several:
                    pool, hops = target(answer, self._servers, hops), hops + 1
                    continue
                raise_for(answer)
            except Unauthenticated:
                if not (may_renew and self._key.renew(secret)):
                    raise
                may_renew = False
            except (ServerError, TransportError) as error:
                if attempts.may_renew(error, request, was_kept):
                    continue
                if attempts.is_over_here(error):
                    self._servers.leave(pool)
                if attempts.may_go_on(error, request):
                    pool = self._servers.next(pool)
                else:
                    attempts.pause_after(error, request, was_kept)
                    pool = self._servers.current
            else:
                return answer

    def whole(self, read: Callable[[], Of]) -> Of:
        """What is read piece by piece to its end: anew at another of several servers, where the connection is lost."""
        for _ in range(len(self._servers) - 1):
            with suppress(ConnectionLost):
                return read()
        return read()

    @contextmanager
    def stream(self, request: Request, stop: Stop | None = None) -> Iterator["Body"]:
        """An answer that is read piece by piece, over a connection of its own, which is closed at the end; `stop` ends it before.

        Nothing is tried again, but the beginning with another secret: who reads it knows where to go on.

        Raises `ConnectionLost` where the server ends it for the sake of its secret, and there is another one now.
        """
        deadline = Deadline(self.bounds.timeout_s, stop)
        pool, connection, response, secret = self._beginning(request, deadline)
        try:
            yield Body(connection, response)
        except Unauthenticated as refused:
            if not self._key.renew(secret):
                raise
            raise ConnectionLost("the key was refused, and there is another one now") from refused
        except TransportError:
            if stop is None or not stop.is_set:
                self._servers.leave(pool)
            raise
        finally:
            connection.close()
            pool.give_back(connection)

    def _beginning(self, request: Request, deadline: Deadline) -> tuple[Pool, Connection, Response, Secret]:
        """An answer up to its body, of the first server that gives one; and the secret that it was asked with."""
        attempts = Attempts(0.0, deadline, len(self._servers))
        may_renew, hops, pool = True, 0, self._servers.current
        while True:
            secret = self._key.secret()
            try:
                connection, begun = self._begun(pool, request, secret, deadline)
                if isinstance(begun, Answer):
                    pool, hops = target(begun, self._servers, hops), hops + 1
                    continue
            except Unauthenticated:
                if not (may_renew and self._key.renew(secret)):
                    raise
                may_renew = False
            except (ServerError, TransportError) as error:
                if attempts.is_over_here(error):
                    self._servers.leave(pool)
                if not attempts.may_go_on(error, request):
                    raise attempts.of_all(error) from error.__cause__
                pool = self._servers.next(pool)
            else:
                return pool, connection, begun, secret

    def _begun(self, pool: Pool, request: Request, secret: Secret, deadline: Deadline) -> tuple[Connection, "Response | Answer"]:
        """An answer up to its body, over a connection of its own; or all of one that names another server, without it."""
        connection, _ = self._servers.take(pool, deadline)
        try:
            response = connection.open(request, secret, deadline, None)
            if response.status >= 300:
                with_bound = min(response.length or ERROR_BYTES_MAX, ERROR_BYTES_MAX)
                said = memoryview(connection.read(response, with_bound, deadline))
                answer = Answer(response.status, response.plain_headers, said)
                if answer.status != SENT_ON or not self.has_several:
                    raise_for(answer)
                connection.close()
                pool.give_back(connection)
                return connection, answer
            _check_has_end(response)
        except BaseException:
            connection.close()
            pool.give_back(connection)
            raise
        return connection, response


class Body:
    """A body that is read piece by piece."""

    def __init__(self, connection: Connection, response: Response) -> None:
        self._connection = connection
        self._response = response
        self._owner = os.getpid()

    @property
    def length(self) -> int | None:
        """Bytes that are left, where the server told."""
        return self._response.length

    @property
    def answer(self) -> Answer:
        """Status and headers."""
        return Answer(self._response.status, self._response.plain_headers, memoryview(b""))

    def read(self, count: int, deadline: Deadline) -> bytes:
        """Up to so many bytes; less at the end."""
        self._check_owner()
        return self._connection.read(self._response, count, deadline)

    def read_some(self, most: int, deadline: Deadline) -> bytes:
        """What has come, once something has, so many bytes at most; nothing at the end."""
        self._check_owner()
        return self._connection.read_some(self._response, most, deadline)

    def _check_owner(self) -> None:
        # What a child reads its parent would miss.
        if os.getpid() != self._owner:
            raise ConnectionLost("the connection belongs to the process that forked this one")


def _check_has_end(response: Response) -> None:
    if response.length is None and not response.chunked:
        raise BadAnswer("the answer's length is not told, so one that was cut off would look whole")


def raise_for(answer: Answer) -> None:
    """Raises the error that an answer is, where it is one."""
    if 200 <= answer.status < 300:
        return
    try:
        problem = json.loads(bytes(answer.body))
        words = [problem[name] for name in ("code", "reason", "detail")]
    except (ValueError, TypeError, KeyError, RecursionError):
        words = []
    if not words:
        # Here no exception has the answer in it any more, which may be what was sent, with the key.
        raise BadAnswer(f"the server answers {answer.status}, and says {excerpt(bytes(answer.body))}")
    code, reason, detail = (str(word) for word in words)
    raise server_error(answer.status, code, reason, detail, _seconds(answer.header("retry-after")))


def _seconds(text: str | None) -> float | None:
    return float(text) if text is not None and text.isascii() and text.isdigit() and len(text) < 10 else None
