"""A socket as `http.client` uses one, with two bounds that it does not offer.

A time-out of a socket is that of one read: a server that sends a byte a second is never late. And a length that a server claims is
read, however large. Here a deadline holds over all reads and writes, and what an answer may have in bytes is counted.
"""

import socket
import ssl
from io import BufferedReader, RawIOBase
from typing import TYPE_CHECKING

from ..errors import BadAnswer
from .deadline import Deadline
from .protocol import OPENING_BYTES

if TYPE_CHECKING:
    # Python has it from 3.12 on; who checks types knows it.
    from typing_extensions import Buffer

SMALL_BYTES = 16 << 10
"""Pieces of a request that are no larger are put together and sent at once."""

READ_AHEAD_BYTES = 64 << 10
"""Bytes that are read at once beyond what is asked for."""


class BoundedStream:
    """The socket of one connection, for one request after the other."""

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._unsent = bytearray()
        # TLS encrypts one piece after the other.
        self._can_gather = not isinstance(sock, ssl.SSLSocket)
        self._deadline: Deadline | None = None
        self._bytes_left: int | None = 0
        self.has_ended = False
        self.opening = b""
        """The first bytes that came over the connection, which tell what is spoken at the other end."""

    def begin(self, deadline: Deadline, bytes_max: int | None) -> None:
        """Sets the bounds of the next request and its answer; without `bytes_max` any number of bytes is read."""
        self._deadline = deadline
        self._bytes_left = bytes_max
        self._unsent.clear()

    def renew(self, deadline: Deadline) -> None:
        """Gives what is still to be read another deadline."""
        self._deadline = deadline

    def sendall(self, data: "Buffer") -> None:
        """Sends a piece of a request, or keeps it until there is more to send."""
        piece = memoryview(data)
        if piece.nbytes <= SMALL_BYTES:
            self._unsent += piece
            if len(self._unsent) > SMALL_BYTES:
                self.flush()
            return
        if self._unsent and self._can_gather:
            self._send_behind(piece)
        else:
            self.flush()
            self._send(piece)

    def flush(self) -> None:
        """Sends what was kept."""
        if self._unsent:
            self._send(memoryview(bytes(self._unsent)))
            self._unsent.clear()

    def _send(self, data: memoryview) -> None:
        if not data.nbytes:
            return
        assert self._deadline is not None
        self._sock.settimeout(self._deadline.remaining_s())
        try:
            self._sock.sendall(data)
        except TimeoutError as error:
            raise self._deadline.passed() from error

    def _send_behind(self, data: memoryview) -> None:
        """Sends what was kept and a piece behind it, by one call of the system."""
        assert self._deadline is not None
        self._sock.settimeout(self._deadline.remaining_s())
        # A view, since bytes show themselves in a traceback with what its frames hold, and there is a key in them.
        head = memoryview(bytes(self._unsent))
        self._unsent.clear()
        try:
            sent = self._sock.sendmsg([head, data])
        except TimeoutError as error:
            raise self._deadline.passed() from error
        if sent < head.nbytes:
            self._send(head[sent:])
        self._send(data.cast("B")[max(0, sent - head.nbytes) :])

    def receive_into(self, buffer: "Buffer") -> int:
        """Reads what is there, or waits for it."""
        assert self._deadline is not None
        self._sock.settimeout(self._deadline.remaining_s())
        try:
            count = self._sock.recv_into(buffer)
        except TimeoutError as error:
            raise self._deadline.passed() from error
        if count == 0:
            self.has_ended = True
        elif len(self.opening) < OPENING_BYTES:
            self.opening += bytes(memoryview(buffer)[: min(count, OPENING_BYTES - len(self.opening))])
        if self._bytes_left is not None:
            self._bytes_left -= count
            if self._bytes_left < 0:
                raise BadAnswer("the answer has more bytes than answer_bytes_max allows")
        return count

    def makefile(self, mode: str) -> BufferedReader:
        """What `http.client` reads an answer from."""
        assert mode == "rb"
        return BufferedReader(_Reader(self), READ_AHEAD_BYTES)

    def close(self) -> None:
        """Nothing: `http.client` closes at the end of headers what the body is yet to be read from. The connection closes it."""


class _Reader(RawIOBase):
    """The reading side of a stream."""

    def __init__(self, stream: BoundedStream) -> None:
        self._stream = stream

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: "Buffer", /) -> int:
        return self._stream.receive_into(buffer)
