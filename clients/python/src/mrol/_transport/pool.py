"""Connections that are kept for the next request: for threads, and for processes that fork."""

import os
import ssl
from collections import deque
from contextlib import suppress
from weakref import WeakSet

from .address import Address
from .connection import Connection
from .deadline import Deadline

KEPT_MAX = 8
"""Connections that are kept while nobody uses them; one more for each thread that gives one back at the same moment."""


class _Connections:
    """The connections of one process.

    No lock is needed, each change being one of a container's own: so none is held when Ctrl-C comes or another thread forks.
    """

    def __init__(self) -> None:
        self.process = os.getpid()
        self.kept: deque[Connection] = deque()
        # What nobody refers to any more ends by itself, wherever Ctrl-C may have come between taking it and giving it back.
        self.used: WeakSet[Connection] = WeakSet()


class Pool:
    """Connections to one server.

    Each is used by one thread at a time. A child process has none of its parent's: two processes that write to one connection would
    read each other's answers. It closes its copies of them, which the parent does not notice.
    """

    def __init__(self, address: Address, tls: ssl.SSLContext | None) -> None:
        self.address = address
        self._tls = tls
        self._connections = _Connections()

    def take(self, deadline: Deadline, may_be_kept: bool = True) -> tuple[Connection, bool]:
        """A connection for one request, and whether it was kept from one before: a server may just be closing that.

        Raises `ConnectFailed`.
        """
        of_process = self._of_process()
        while may_be_kept:
            try:
                connection = of_process.kept.pop()
            except IndexError:
                break
            of_process.used.add(connection)
            if connection.is_reusable:
                return connection, True
            of_process.used.discard(connection)
            connection.close()
        connection = Connection(self.address, self._tls, deadline)
        of_process.used.add(connection)
        return connection, False

    def give_back(self, connection: Connection) -> None:
        """Keeps a connection for the next request, or closes it where it is of no use."""
        of_process = self._of_process()
        of_process.used.discard(connection)
        if connection.is_reusable and len(of_process.kept) < KEPT_MAX:
            of_process.kept.append(connection)
        else:
            connection.close()

    def close(self) -> None:
        """Closes the connections that nobody uses; others are closed when they are given back."""
        of_process = self._of_process()
        with suppress(IndexError):
            while True:
                of_process.kept.pop().close()

    def _of_process(self) -> _Connections:
        found = self._connections
        if found.process != os.getpid():
            # Should two threads come here at once, one makes connections that are used once and closed.
            inherited, self._connections = found, _Connections()
            found = self._connections
            for connection in [*inherited.kept, *inherited.used]:
                connection.close()
        return found
