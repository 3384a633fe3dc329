"""A network between the node and its server, and what may be in the way."""

import socket
from contextlib import suppress
from threading import Event, Thread


class Proxy:
    """Forwards connections to a server, as long as nothing is in the way of them."""

    def __init__(self, server):
        host, port = server.address.rsplit(":", 1)
        self._server = (host, int(port))
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=100)
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._thawed = Event()
        self._thawed.set()
        self._is_gone = False
        self._ends = []
        self._treat = None
        Thread(target=self._accept, daemon=True).start()

    def freeze(self):
        """Lets nothing through until it is thawed, and nobody is told."""
        self._thawed.clear()

    def thaw(self):
        """Lets all through, what waited too."""
        self._thawed.set()

    def lose(self):
        """Drops all bytes: connections that there are, and new ones, stay open and silent, now and later."""
        self._is_gone = True

    def find(self):
        """Lets new connections through again."""
        self._is_gone = False

    def treat(self, how):
        """Answers itself from the next bytes on: `how` takes each connection; None lets the server answer again."""
        self._treat = how
        for end in self._ends:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._ends.clear()

    def stop(self):
        """Takes no more connections."""
        self._thawed.set()
        self._listener.close()

    def _accept(self):
        while True:
            try:
                client, _ = self._listener.accept()
                if self._treat is not None:
                    Thread(target=self._answered, args=(client,), daemon=True).start()
                    continue
                server = socket.create_connection(self._server)
            except OSError:
                return
            self._ends += [client, server]
            for ends in ((client, server), (server, client)):
                Thread(target=self._carry, args=ends, daemon=True).start()

    def _answered(self, client):
        with suppress(OSError), client:
            self._treat(client)

    def _carry(self, source, sink):
        is_lost = False
        with suppress(OSError):
            while data := source.recv(1 << 16):
                self._thawed.wait()
                is_lost = is_lost or self._is_gone
                if not is_lost:
                    sink.sendall(data)
        if not is_lost:
            with suppress(OSError):
                sink.shutdown(socket.SHUT_WR)
