"""Threads, forks and Ctrl-C."""

import gc
import itertools
import os
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import mrol

from .support.interrupts import is_interrupted_at
from .support.scripted import ScriptedServer
from .support.server import scan_ids


def forked(work: Callable[[], None]) -> None:
    """Does work in a child, which must end well."""
    must_end_well(child_of(work))


def child_of(work: Callable[[], None]) -> int:
    """A child that does work."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            work()
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    return child


def must_end_well(child: int) -> None:
    """Waits for a child."""
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0


def test_threads_share_a_map(empty: mrol.Map) -> None:
    def work(number: int) -> tuple[int | None, bool]:
        scan = empty.insert([[number, 1, 0]], align=False, guess=np.eye(4), force=True)
        return scan.scan_id, bool(empty.query([[number, 1, 0]], min_revision=scan.revision).occupied[0])

    with ThreadPoolExecutor(8) as threads:
        done = list(threads.map(work, range(200)))
    assert sorted(number for number, _ in done if number is not None) == list(range(1, 201))
    assert all(is_there for _, is_there in done)
    assert len(empty.trajectory()) == 200


def test_a_child_has_connections_and_a_session_of_its_own(client: mrol.Client, empty: mrol.Map) -> None:
    before = empty.insert([[1, 0, 0]], align=False)
    parents = client.session

    def work() -> None:
        assert client.session != parents
        scan = empty.insert([[2, 0, 0]], align=False, guess=np.eye(4), force=True)
        assert (scan.scan_id, scan.session) == (1, client.session)
        assert empty.query([[1, 0, 0], [2, 0, 0]]).occupied.all()

    for _ in range(3):
        forked(work)
        # The parent's connection is as it was.
        assert empty.query([[1, 0, 0]]).occupied.all()
    after = empty.insert([[3, 0, 0]], align=False, guess=np.eye(4), force=True)
    assert (after.scan_id, after.session) == (2, before.session)
    assert len(set(scan_ids(empty))) == 5


def test_a_fork_in_the_middle_of_other_threads_calls(client: mrol.Client, empty: mrol.Map) -> None:
    empty.insert([[1, 0, 0]], align=False)
    points = np.random.default_rng(1).uniform(-9, 9, (50_000, 3)).astype(np.float32)
    expected = empty.query(points).count
    over = threading.Event()
    wrong: list[int] = []

    def ask() -> None:
        while not over.is_set():
            count = empty.query(points).count
            if count != expected:
                wrong.append(count)

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    try:
        for _ in range(20):
            forked(lambda: [empty.query(points) for _ in range(3)] and None)
    finally:
        over.set()
        for thread in threads:
            thread.join()
    assert wrong == []
    assert client.health().ready


# A watch is closed by name: what an interrupt raises while Python itself closes a forgotten one is only told ("Exception
# ignored in"), as from any destructor.
INTERRUPTED = """
import sys, numpy as np, mrol
from contextlib import closing
client = mrol.connect(sys.argv[1])
m = client.map(sys.argv[2])
points = np.random.default_rng(1).uniform(-9, 9, (1_000_000, 3)).astype("f4")
first = m.query(points).count
print("ready", flush=True)
interrupted = 0
while interrupted < 5:
    try:
        while True:
            assert m.query(points).count == first
            with closing(m.watch()) as events:
                next(events)
    except KeyboardInterrupt:
        interrupted += 1
        print("interrupted", flush=True)
assert m.query(points).count == first
"""


def test_ctrl_c_ends_a_call_and_the_client_works_on(client: mrol.Client, hall: mrol.Map, tmp_path: Path) -> None:
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED)
    command = [sys.executable, str(script), client.address, hall.name]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        for number in range(5):
            # At another moment of the calls each time.
            time.sleep(0.013 * (number + 1))
            process.send_signal(signal.SIGINT)
            assert process.stdout.readline() == "interrupted\n"
        assert process.wait(30) == 0


def test_ctrl_c_ends_a_call_to_a_server_that_hangs() -> None:
    with ScriptedServer(lambda _, over: over.wait(60) and None) as server:
        m = mrol.Map(mrol.connect(server.address)._caller, "m", "r", mrol.connect(server.address)._sessions)  # noqa: SLF001
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        began = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            m.query([[0, 0, 0]])
        timer.join()
        assert time.monotonic() - began < 20


# A socket that no connection has yet closes itself, and says so.
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_ctrl_c_at_any_line_of_a_call_leaves_no_connection_in_use(hall: mrol.Map) -> None:
    """Each line that is run for a query is interrupted once, before its first instruction."""
    pool = hall._caller._servers.current  # noqa: SLF001
    pool.close()
    for is_kept in (True, False):
        for line in itertools.count(1):
            hall.query([[0, 0, 0]])
            if not is_kept:
                pool.close()
            if not is_interrupted_at(line, lambda: hall.query([[0, 0, 0]])):
                break
            gc.collect()
            of_process = pool._connections  # noqa: SLF001
            assert len(of_process.used) == 0, line
            assert len(of_process.kept) <= 1, line
        assert line > 100
    open_files = len(os.listdir("/proc/self/fd"))
    hall.query([[0, 0, 0]])
    assert len(os.listdir("/proc/self/fd")) <= open_files + 1


def test_a_client_is_closed_and_used_again(client: mrol.Client, empty: mrol.Map) -> None:
    with client:
        assert empty.describe().scans == 0
    assert empty.describe().scans == 0


def test_a_child_that_goes_on_with_a_watch_takes_nothing_from_its_parent(empty: mrol.Map) -> None:
    empty.insert([[1, 0, 0]], align=False)
    events = empty.watch()
    next(events)
    last = 12

    def told() -> list[int]:
        revisions = []
        for event in events:
            revisions.append(event.revision)
            if event.revision == last:
                return revisions
        return revisions

    def work() -> None:
        assert told() == list(range(2, last + 1))

    child = child_of(work)
    for number in range(2, last + 1):
        empty.insert([[number, 0, 0]], align=False, guess=np.eye(4), force=True)
    work()
    must_end_well(child)


def test_a_key_does_not_go_in_the_clear_where_files_of_tls_were_given(client: mrol.Client, tmp_path: Path) -> None:
    for name in ("ca", "client_cert", "client_key"):
        files: dict[str, Path] = {name: tmp_path / "nowhere.pem"}
        with pytest.raises(mrol.ArgumentError, match=name):
            mrol.connect(client.address, key="mrol_secret", **files)  # type: ignore[arg-type]
