"""A watch is closed from wherever, and the thread that waits in it goes on."""

import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrol

from .support.scripted import ScriptedServer, answer
from .support.server import Server, serving
from .test_access import certificate
from .test_hostile_servers import map_of
from .test_processes import child_of, must_end_well

CLOSED_S = 1.0
"""How long a thread may go on after the watch was closed that it waits in."""


class Reader(threading.Thread):
    """A thread that iterates a watch to its end."""

    def __init__(self, events: Iterator[Any]) -> None:
        super().__init__(daemon=True)
        self.events = events
        self.told = 0
        self.error: BaseException | None = None
        self.start()

    def run(self) -> None:
        """Iterates."""
        try:
            for _ in self.events:
                self.told += 1
        except BaseException as error:
            self.error = error

    def must_wait(self, told: int) -> None:
        """Waits until it was told so much, and waits for more."""
        end = time.monotonic() + 20
        while self.told < told:
            assert self.error is None
            assert time.monotonic() < end
            time.sleep(0.01)
        time.sleep(0.1)
        assert self.is_alive(), self.error

    def must_end(self) -> None:
        """Makes sure that it ends soon, without an error."""
        self.join(CLOSED_S)
        assert not self.is_alive()
        assert self.error is None


def watched(m: mrol.Map) -> "mrol.Watch[Any]":
    """A watch that tells one event at once."""
    return m.watch()


def watched_events(m: mrol.Map) -> "mrol.Watch[Any]":
    """A watch of answers that tells one at once."""
    m.insert([[1, 0, 0]], align=False, guess=np.eye(4), force=True)
    return m.watch_events()


BOTH = pytest.mark.parametrize("begin", [watched, watched_events])


@BOTH
def test_another_thread_closes_a_watch(empty: mrol.Map, begin: "Callable[[mrol.Map], mrol.Watch[Any]]") -> None:
    with begin(empty) as events:
        reader = Reader(events)
        reader.must_wait(told=1)
        events.close()
        reader.must_end()
        assert next(events, None) is None
        events.close()
    assert empty.describe().resolution_m == 0.1


@BOTH
def test_a_client_that_is_closed_ends_its_watches(server: Server, empty: mrol.Map, begin: Callable[[mrol.Map], Any]) -> None:
    client = mrol.connect(server.address)
    m = client.map(empty.name)
    other = client.with_timeout(5).map(empty.name)
    readers = [Reader(begin(of)) for of in (m, m.with_timeout(5), other)]
    idle = begin(m)
    next(idle)
    for reader in readers:
        reader.must_wait(told=1)
    client.close()
    for reader in readers:
        reader.must_end()
    assert next(idle, None) is None
    # It opens other connections if it is used again.
    assert next(begin(m)) is not None


def test_a_client_of_another_time_ends_its_own_watches_alone(client: mrol.Client, empty: mrol.Map) -> None:
    reader = Reader(empty.watch())
    reader.must_wait(told=1)
    with client.with_timeout(5) as quick:
        own = Reader(quick.map(empty.name).watch())
        own.must_wait(told=1)
    own.must_end()
    assert reader.is_alive()
    client.close()
    reader.must_end()


@BOTH
def test_the_thread_that_iterates_closes_a_watch(empty: mrol.Map, begin: "Callable[[mrol.Map], mrol.Watch[Any]]") -> None:
    before = len(os.listdir("/proc/self/fd"))
    with begin(empty) as events:
        assert next(events) is not None
    assert list(events) == []
    assert len(os.listdir("/proc/self/fd")) <= before + 1
    for event in (events := begin(empty)):
        assert event is not None
        events.close()


def test_a_handler_of_a_signal_closes_a_watch(empty: mrol.Map) -> None:
    events = empty.watch()
    before = signal.signal(signal.SIGALRM, lambda *_: events.close())
    try:
        next(events)
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        began = time.monotonic()
        assert list(events) == []
        assert time.monotonic() - began < 0.2 + CLOSED_S
    finally:
        signal.signal(signal.SIGALRM, before)


def test_a_watch_is_closed_while_its_server_is_away(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        m = mrol.connect(server.address).map("m", resolution=0.1)
        readers = [Reader(m.watch()), Reader(m.watch_events())]
        readers[0].must_wait(told=1)
        server.kill()
        time.sleep(0.5)
        for reader in readers:
            assert reader.is_alive()
            reader.events.close()  # type: ignore[attr-defined]
            reader.must_end()


def test_a_watch_over_tls_is_closed(tmp_path: Path) -> None:
    pem, key = certificate(tmp_path, "localhost")
    with serving(tmp_path, "--tls-certificate", str(pem), "--tls-key", str(key)) as server:
        port = server.address.rsplit(":", 1)[1]
        client = mrol.connect(f"https://localhost:{port}", ca=pem)
        reader = Reader(client.map("m", resolution=0.1).watch())
        reader.must_wait(told=1)
        client.close()
        reader.must_end()


def test_a_watch_over_a_socket_is_closed(tmp_path: Path) -> None:
    with serving(tmp_path, "--http-socket", str(tmp_path / "s")):
        client = mrol.connect(f"unix:{tmp_path / 's'}")
        reader = Reader(client.map("m", resolution=0.1).watch())
        reader.must_wait(told=1)
        client.close()
        reader.must_end()


def test_a_watch_is_closed_that_the_server_does_not_begin() -> None:
    def hangs(_: socket.socket, over: threading.Event) -> None:
        over.wait()

    with ScriptedServer(hangs) as server:
        events = map_of(server, timeout_s=30).watch()
        reader = Reader(events)
        reader.must_wait(told=0)
        events.close()
        reader.must_end()


def test_a_watch_is_closed_while_it_connects() -> None:
    """A server that takes no connection any more, whose queue is full."""
    with socket.create_server(("127.0.0.1", 0), backlog=0) as listener:
        address = listener.getsockname()

        def greet() -> None:
            taken, _ = listener.accept()
            with taken:
                taken.recv(65_536)
                taken.sendall(answer(b"ok", b"connection: close"))

        greeting = threading.Thread(target=greet, daemon=True)
        greeting.start()
        client = mrol.connect(f"{address[0]}:{address[1]}")
        greeting.join()
        waiting = []
        for _ in range(8):
            sock = socket.socket()
            sock.setblocking(False)
            with suppress(BlockingIOError):
                sock.connect(address)
            waiting.append(sock)
        events = mrol.Map(client._caller, "m", "r", client._sessions).watch()  # noqa: SLF001
        reader = Reader(events)
        time.sleep(0.5)
        assert reader.is_alive(), reader.error
        events.close()
        reader.must_end()
        for sock in waiting:
            sock.close()


def test_a_child_that_closes_ends_nothing_of_its_parent(client: mrol.Client, empty: mrol.Map) -> None:
    events = empty.watch()
    reader = Reader(events)
    reader.must_wait(told=1)
    idle = empty.watch()
    next(idle)

    def work() -> None:
        client.close()
        events.close()

    must_end_well(child_of(work))
    empty.keep_out("k", sphere=([0, 0, 0], 1))
    reader.must_wait(told=2)
    assert isinstance(next(idle), mrol.WatchedChange)
    client.close()
    reader.must_end()


def test_a_second_thread_that_iterates_is_refused(empty: mrol.Map) -> None:
    events = empty.watch()
    reader = Reader(events)
    reader.must_wait(told=1)
    with pytest.raises(mrol.ArgumentError, match="must be iterated by one thread at a time"):
        next(events)
    events.close()
    reader.must_end()
    assert repr(events) == "<mrol watch, closed>"
