"""A proxy that drops connections in the middle of requests and of answers."""

import socket
import struct
from collections.abc import Callable
from contextlib import suppress
from threading import Thread

SAFE_BYTES = 64 << 10


class DroppingProxy:
    """Forwards connections to a server. `plan` tells of each how many bytes it may carry there and back before it is dropped."""

    def __init__(self, server: str, plan: Callable[[int], tuple[int, int] | None]) -> None:
        host, port = server.rsplit(":", 1)
        self._server = (host, int(port))
        self._plan = plan
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self.connections = 0
        self.dropped = 0
        self._accepting = Thread(target=self._accept, daemon=True)
        self._accepting.start()

    def __enter__(self) -> "DroppingProxy":
        return self

    def __exit__(self, *_: object) -> None:
        # An accept that waits is not woken by a close.
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._accepting.join()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            bounds = self._plan(self.connections)
            self.connections += 1
            Thread(target=self._forward, args=(client, bounds), daemon=True).start()

    def _forward(self, client: socket.socket, bounds: tuple[int, int] | None) -> None:
        with client, socket.create_connection(self._server) as server:
            there, back = bounds or (None, None)
            up = Thread(target=self._carry, args=(client, server, there), daemon=True)
            up.start()
            self._carry(server, client, back)
            up.join()

    def _carry(self, source: socket.socket, sink: socket.socket, most: int | None) -> None:
        """Carries bytes until there are no more, or so many were carried: then both sides are reset."""
        carried = 0
        with suppress(OSError):
            while data := source.recv(SAFE_BYTES):
                if most is not None and carried + len(data) > most:
                    sink.sendall(data[: most - carried])
                    self.dropped += 1
                    reset(source)
                    reset(sink)
                    return
                sink.sendall(data)
                carried += len(data)
        with suppress(OSError):
            sink.shutdown(socket.SHUT_WR)


def reset(sock: socket.socket) -> None:
    """Breaks a connection off, without a word."""
    with suppress(OSError):
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        sock.shutdown(socket.SHUT_RDWR)
