"""What ends a stream from outside: from another thread, or from a handler of a signal."""

import os
import socket
from contextlib import suppress
from typing import Protocol
from weakref import ref

from ..errors import ConnectionLost


class Stop:
    """Ends what waits on a socket.

    No lock is needed: `set` sets the flag and then looks for a socket, `guard` does the two the other way round.
    """

    def __init__(self) -> None:
        # With the process that waits on it: in a forked child the parent's would be ended.
        self._guarded: tuple[int, socket.socket] | None = None
        self.is_set = False

    def guard(self, sock: socket.socket) -> None:
        """Lets `set` end what waits on this socket, and no longer what waits on the one before it.

        Raises `ConnectionLost` where it is set already.
        """
        self._guarded = os.getpid(), sock
        if self.is_set:
            raise ConnectionLost("the stream was closed by this program")

    def set(self) -> None:
        """Ends what waits on the socket, and whatever would wait later."""
        self.is_set = True
        owner, sock = self._guarded or (None, None)
        if sock is not None and owner == os.getpid():
            with suppress(OSError):
                # `SSLSocket.shutdown` would take the session from under a thread that reads.
                socket.socket.shutdown(sock, socket.SHUT_RDWR)


class Closable(Protocol):
    """What can be closed."""

    def close(self) -> None:
        """Closes it."""


class OpenStreams:
    """The streams that end with a client; what nobody refers to any more is none of them."""

    def __init__(self, parent: "OpenStreams | None" = None) -> None:
        self._parent = parent
        # Each change is one of the set's own, and so is its copy: threads need no lock.
        self._streams: set[ref[Closable]] = set()

    def add(self, stream: Closable) -> None:
        """Adds one, to those of the parent too."""
        self._streams.add(ref(stream, self._streams.discard))
        if self._parent is not None:
            self._parent.add(stream)

    def close(self) -> None:
        """Closes them all."""
        for found in self._streams.copy():
            stream = found()
            if stream is not None:
                stream.close()
