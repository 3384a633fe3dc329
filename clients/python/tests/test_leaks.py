"""Ten thousand calls leave nothing behind: no memory, no connection, no open file."""

import gc
import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mrol

from .support.scripted import ScriptedServer, answer

CALLS = 10_000
WARM_UP = 500
LEFT_MAX = 64_000
"""Bytes that may be left after the calls: six a call, less than any object has."""


OPEN_MAX = 20
"""Descriptors that may be open beyond those before: a server of the test has some, too. One a call would be hundreds."""


def resident_bytes() -> int:
    """Memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def open_files() -> int:
    """Open descriptors of this process."""
    return len(os.listdir("/proc/self/fd"))


def leaves_nothing(call: Callable[[], object], calls: int) -> None:
    """Calls often, and looks at what is left."""
    for _ in range(WARM_UP):
        call()
    gc.collect()
    files, resident = open_files(), resident_bytes()
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for _ in range(calls):
            call()
        gc.collect()
        left = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert left < LEFT_MAX
    assert open_files() < files + OPEN_MAX
    assert resident_bytes() - resident < 16_000_000


def test_ten_thousand_calls_leave_nothing(hall: mrol.Map) -> None:
    points = np.random.default_rng(1).uniform(-4, 4, (2000, 3)).astype(np.float32)
    body = [[0.0, 0.0, 0.0, 0.2]]
    calls: list[Callable[[], object]] = [
        lambda: hall.query(points),
        lambda: hall.check_motions(body, points[:40].reshape(-1, 2, 3)),
        lambda: hall.cast_rays([0, 0, 0], [[1, 0, 0]]),
        hall.describe,
    ]
    turn = iter(range(10 * CALLS))
    leaves_nothing(lambda: calls[next(turn) % len(calls)](), CALLS)


def test_a_thousand_refusals_and_clients_leave_nothing(hall: mrol.Map, client: mrol.Client) -> None:
    address = client.address

    def call() -> None:
        with pytest.raises(mrol.InvalidArgument):
            hall.query([[np.nan, 0, 0]])
        # Dropped without a close.
        mrol.connect(address).health()

    leaves_nothing(call, 1000)


def test_a_thousand_answers_that_are_none_leave_nothing() -> None:
    with ScriptedServer(lambda sock, _: sock.sendall(answer(b"{" * 5000))) as server:
        client = mrol.connect(server.address)

        def call() -> None:
            with pytest.raises(mrol.BadAnswer):
                client.maps()

        leaves_nothing(call, 1000)


def test_watches_that_are_left_leave_nothing(hall: mrol.Map) -> None:
    leaves_nothing(lambda: next(hall.watch()), 200)
