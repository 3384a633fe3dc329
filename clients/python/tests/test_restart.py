"""Servers that end and start again, and keys that are rotated."""

import time
from pathlib import Path
from threading import Thread

import pytest

import mrol

from .support.server import run, scan_ids, serving


@pytest.mark.parametrize("how", ["kill", "stop"])
def test_calls_wait_for_a_server_that_restarts(tmp_path: Path, how: str) -> None:
    with serving(tmp_path) as server:
        m = mrol.connect(server.address).map("m", resolution=0.1)
        m.insert([[1, 0, 0]], align=False)
        getattr(server, how)()
        restarting = Thread(target=lambda: (time.sleep(0.5), server.start()))
        restarting.start()
        second = m.insert([[2, 0, 0]], align=False, guess=[0, 0, 0, 0, 0, 0, 1], force=True)
        restarting.join()
        assert (second.scan_id, second.revision) == (2, 2)
        # The connections that were kept are of no use now, and nobody notices.
        getattr(server, how)()
        server.start()
        assert m.query([[2, 0, 0]], min_revision=second.revision).occupied.all()
        assert len(scan_ids(m)) == 2


def test_a_server_that_does_not_come_back_is_told_after_the_patience(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        m = mrol.connect(server.address, patience_s=0.3).map("m", resolution=0.1)
        server.kill()
        with pytest.raises(mrol.ConnectFailed):
            m.describe()
        with pytest.raises(mrol.TransportError):
            next(m.watch())
        with pytest.raises(mrol.TransportError) as lost:
            m.insert([[1, 0, 0]], align=False)
        server.start()
        assert m.insert([[1, 0, 0]], align=False, **lost.value.repeat_with).accepted


def test_a_watch_goes_on_after_a_restart_without_a_gap(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        m = mrol.connect(server.address).map("m", resolution=0.1)
        events = m.watch()
        assert isinstance(next(events), mrol.WatchedState)
        first = m.insert([[1, 0, 0]], align=False)
        assert next(events).revision == first.revision
        server.kill()
        server.start()
        second = m.insert([[2, 0, 0]], align=False, guess=[0, 0, 0, 0, 0, 0, 1])
        event = next(events)
        assert isinstance(event, mrol.WatchedChange)
        assert event.revision == second.revision


def test_a_rotated_key_is_read_again_and_a_revoked_one_is_told(tmp_path: Path) -> None:
    keys, secret = tmp_path / "keys.toml", tmp_path / "secret"
    run("key", "new", "--name", "last", "--scope", "read", "--file", str(keys))
    secret.write_text(run("key", "new", "--name", "k", "--scope", "admin", "--file", str(keys)))
    with serving(tmp_path, "--keys-file", str(keys)) as server:
        from_file = mrol.connect(server.address, key_file=secret).map("m", resolution=0.1)
        by_word = mrol.connect(server.address, key=secret.read_text().strip()).map("m")
        watching = from_file.watch()
        next(watching)
        rotated = run("key", "rotate", "--name", "k", "--end-former", "--file", str(keys))
        _until_refused(by_word)
        with pytest.raises(mrol.Unauthenticated) as stale:
            from_file.describe()
        assert stale.value.reason in ("key_unknown", "key_withdrawn")
        secret.write_text(rotated)
        scan = from_file.insert([[1, 0, 0]], align=False)
        assert scan.accepted
        assert next(watching).revision == scan.revision
        with pytest.raises(mrol.Unauthenticated):
            by_word.describe()
        run("key", "revoke", "--name", "k", "--file", str(keys))
        _until_refused(from_file)
        with pytest.raises(mrol.Unauthenticated):
            next(watching)


def _until_refused(m: mrol.Map) -> None:
    """Waits until the server has read the file of keys again."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        try:
            m.describe()
        except mrol.Unauthenticated:
            return
        time.sleep(0.05)
    pytest.fail("the key is still taken")
