"""Connections that are kept for the next request: for threads, and for processes that fork."""

import os
import ssl
from threading import Lock

from .address import Address
from .connection import Connection
from .deadline import Deadline

KEPT_MAX = 8
"""Connections that are kept while nobody uses them."""


class _Connections:
    """The connections of one process."""

    def __init__(self) -> None:
        self.process = os.getpid()
        self.lock = Lock()
        self.kept: list[Connection] = []
        self.used: set[Connection] = set()


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
            with of_process.lock:
                if not of_process.kept:
                    break
                connection = of_process.kept.pop()
                of_process.used.add(connection)
            if connection.is_reusable:
                return connection, True
            self._drop(of_process, connection)
        connection = Connection(self.address, self._tls, deadline)
        with of_process.lock:
            of_process.used.add(connection)
        return connection, False

    def give_back(self, connection: Connection) -> None:
        """Keeps a connection for the next request, or closes it where it is of no use."""
        of_process = self._of_process()
        with of_process.lock:
            of_process.used.discard(connection)
            is_kept = len(of_process.kept) < KEPT_MAX and connection.is_reusable
            if is_kept:
                of_process.kept.append(connection)
        if not is_kept:
            connection.close()

    def close(self) -> None:
        """Closes the connections that nobody uses; others are closed when they are given back."""
        of_process = self._of_process()
        with of_process.lock:
            kept, of_process.kept = of_process.kept, []
        for connection in kept:
            connection.close()

    def _of_process(self) -> _Connections:
        found = self._connections
        if found.process != os.getpid():
            # The lock may be held by a thread that this process has not. Should two threads come here at once, one makes
            # connections that are used once and closed.
            inherited, self._connections = found, _Connections()
            found = self._connections
            for connection in [*inherited.kept, *inherited.used]:
                connection.close()
        return found

    @staticmethod
    def _drop(of_process: _Connections, connection: Connection) -> None:
        with of_process.lock:
            of_process.used.discard(connection)
        connection.close()
