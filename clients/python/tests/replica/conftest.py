"""Fixtures of what needs the extension: a server, a map in it, and a replica of that."""

import signal
from collections.abc import Iterator

import pytest

import mrol
import mrol.replica

from ..support.scenes import room
from ..support.server import Server, serving

# A shell lets what it runs in the background ignore Ctrl-C, and so would the programs that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that tests share."""
    with serving(tmp_path_factory.mktemp("server")) as started:
        yield started


@pytest.fixture(scope="session")
def hall(server: Server) -> mrol.Map:
    """A map of the room with a keep-out in it."""
    made = mrol.connect(server.address).map("hall", resolution=0.1, levels=4)
    for number, x in enumerate((0.0, 1.0)):
        made.insert(room((x, 0, 0), seed=number), guess=mrol.Pose.of([x, 0, 0, 0, 0, 0, 1]), align=False)
    made.keep_out("shelf", box=mrol.Box([-3, -2, -1], [-2, -1, 0]))
    return made


@pytest.fixture(scope="session")
def replica(server: Server, hall: mrol.Map) -> Iterator[mrol.replica.Replica]:
    """A copy of it."""
    with mrol.replica.Replica(f"http://{server.grpc}", hall.name, bloom=True) as opened:
        yield opened
