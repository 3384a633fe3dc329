"""Fixtures: a server for all tests, a client of it, and maps in it."""

import itertools
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

import mrol

from .support.scenes import room
from .support.server import Server, serving

_numbers = itertools.count()

# A shell lets what it runs in the background ignore Ctrl-C, and so would the programs that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that tests share, each with maps of its own."""
    with serving(tmp_path_factory.mktemp("server")) as started:
        yield started


@pytest.fixture
def client(server: Server) -> Iterator[mrol.Client]:
    """A client of the shared server."""
    with mrol.connect(server.address) as connected:
        yield connected


@pytest.fixture
def empty(client: mrol.Client) -> Iterator[mrol.Map]:
    """A map without a scan."""
    name = f"empty-{next(_numbers)}"
    yield client.map(name, resolution=0.1, levels=4)
    try:
        client.delete_map(name)
    except mrol.NotFound:
        # The test has deleted it.
        return


@pytest.fixture(scope="session")
def room_file(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map file of the room, seen from two places."""
    file = tmp_path_factory.mktemp("maps") / "room.mrol"
    with mrol.connect(server.address) as connected:
        made = connected.map("room-for-a-file", resolution=0.1, levels=4)
        made.insert(room(), guess=mrol.Pose.identity(), align=False)
        made.insert(room((1, 0, 0), seed=2), guess=mrol.Pose.of([1, 0, 0, 0, 0, 0, 1]), align=False)
        made.snapshot(file)
        connected.delete_map(made.name)
    return file


@pytest.fixture
def hall(client: mrol.Client, room_file: Path) -> Iterator[mrol.Map]:
    """A map of the room."""
    name = f"hall-{next(_numbers)}"
    yield client.restore(name, room_file)
    client.delete_map(name)
