"""A server that answers what a test says, however wrong."""

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread

Script = Callable[[socket.socket, Event], None]
"""What is done with a connection whose request was read; the event is set when the test is over."""

LIVE = b"HTTP/1.1 200 OK\r\ncontent-length: 2\r\n\r\nok"


class ScriptedServer:
    """Answers `/livez` as a server does, so that one can connect, and everything else by a script."""

    def __init__(self, script: Script) -> None:
        self._script = script
        self._over = Event()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self.requests = 0
        self.head = b""
        """The last request, without its body."""
        self._threads: list[Thread] = []
        self._accepting = Thread(target=self._accept, daemon=True)
        self._accepting.start()

    def __enter__(self) -> "ScriptedServer":
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
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
            Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        with client, suppress(OSError):
            while (head := self._request(client)) is not None:
                if b"/livez" in head:
                    client.sendall(LIVE)
                    continue
                self.requests += 1
                self.head = head
                self._script(client, self._over)
                return

    @staticmethod
    def _request(client: socket.socket) -> bytes | None:
        """Reads a request, body and all; its head."""
        data = b""
        while b"\r\n\r\n" not in data:
            piece = client.recv(65_536)
            if not piece:
                return None
            data += piece
        head, rest = data.split(b"\r\n\r\n", 1)
        lengths = [line.split(b":")[1] for line in head.lower().split(b"\r\n") if line.startswith(b"content-length:")]
        left = int(lengths[0]) - len(rest) if lengths else 0
        while left > 0:
            left -= len(client.recv(min(left, 65_536)))
        return head


def answering(data: bytes) -> Script:
    """Sends bytes and closes."""
    return lambda client, _: client.sendall(data)


def answer(body: bytes, *headers: bytes, status: bytes = b"200 OK") -> bytes:
    """A well-formed answer."""
    lines = [b"HTTP/1.1 " + status, b"content-length: %d" % len(body), *headers]
    return b"\r\n".join(lines) + b"\r\n\r\n" + body


@contextmanager
def answering_all(data: bytes) -> Iterator[str]:
    """The address of a server that says the same to each connection, whatever it is asked, and hangs up."""

    def accept() -> None:
        with suppress(OSError):
            while True:
                client, _ = listener.accept()
                with client, suppress(OSError):
                    client.recv(65_536)
                    client.sendall(data)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        accepting = Thread(target=accept, daemon=True)
        accepting.start()
        yield f"127.0.0.1:{listener.getsockname()[1]}"
        with suppress(OSError):
            listener.shutdown(socket.SHUT_RDWR)
    accepting.join()
