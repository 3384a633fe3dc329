"""Map files: where they are written, what of the file before stays, and functions that are told how far it is."""

import errno
import os
import stat
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import mrol

from .support.scripted import ScriptedServer
from .test_hostile_servers import map_of


@pytest.fixture
def umask() -> Iterator[int]:
    """A umask that is not the usual one."""
    former = os.umask(0o026)
    yield 0o026
    os.umask(former)


def mode_of(file: Path) -> int:
    """The mode of a file."""
    return stat.S_IMODE(file.stat().st_mode)


def test_a_new_file_has_the_mode_that_the_umask_leaves(hall: mrol.Map, tmp_path: Path, umask: int) -> None:
    hall.snapshot(tmp_path / "new.mrol")
    assert mode_of(tmp_path / "new.mrol") == 0o666 & ~umask


@pytest.mark.parametrize("mode", [0o644, 0o600, 0o640, 0o666, 0o444])
def test_a_file_that_is_replaced_keeps_its_mode(hall: mrol.Map, tmp_path: Path, umask: int, mode: int) -> None:
    file = tmp_path / "there.mrol"
    file.write_bytes(b"what was there")
    file.chmod(mode)
    seen: list[int] = []

    def told(*_: object) -> None:
        seen.extend(mode_of(part) for part in tmp_path.iterdir() if part != file)

    hall.snapshot(file, progress=told)
    assert mode_of(file) == mode
    assert file.stat().st_size > 100
    # What is not whole yet is readable by nobody else either.
    assert set(seen) == {mode}


@pytest.mark.parametrize("is_relative", [True, False])
def test_a_symbolic_link_stays_one(hall: mrol.Map, tmp_path: Path, is_relative: bool) -> None:
    there = tmp_path / "disk" / "there.mrol"
    there.parent.mkdir()
    there.write_bytes(b"what was there")
    for number, target in enumerate((there, tmp_path / "disk" / "none-yet.mrol")):
        link = tmp_path / f"link-{number}.mrol"
        link.symlink_to(os.path.relpath(target, tmp_path) if is_relative else target)
        hall.snapshot(link)
        assert link.is_symlink()
        assert target.stat().st_size > 100
        assert not target.is_symlink()
    assert sorted(entry.name for entry in there.parent.iterdir()) == ["none-yet.mrol", "there.mrol"]


def test_what_is_no_file_is_not_replaced(hall: mrol.Map, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", tmp_path, Path("/dev/null")):
        with pytest.raises(mrol.ArgumentError, match="file must be the path of a file, or of none yet"):
            hall.snapshot(place)
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    assert os.listdir(tmp_path) == ["pipe"]


def test_a_file_is_on_the_disk_before_it_has_its_name(hall: mrol.Map, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[tuple[str, int]] = []
    fsync, replace = os.fsync, os.replace

    def synced(descriptor: int) -> None:
        found = os.fstat(descriptor)
        done.append(("folder" if stat.S_ISDIR(found.st_mode) else "file", found.st_size))
        fsync(descriptor)

    def replaced(source: str, target: str) -> None:
        done.append(("name", 0))
        replace(source, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", replaced)
    hall.snapshot(tmp_path / "a.mrol")
    assert [what for what, _ in done] == ["file", "name", "folder"]
    assert done[0][1] == (tmp_path / "a.mrol").stat().st_size


def test_a_disk_that_is_full_leaves_what_was_there(hall: mrol.Map, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "a.mrol"
    file.write_bytes(b"what was there")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "no space left")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space left"):
        hall.snapshot(file)
    assert file.read_bytes() == b"what was there"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mrol"]


def test_a_number_is_no_file(hall: mrol.Map, client: mrol.Client, tmp_path: Path) -> None:
    (tmp_path / "open").write_bytes(b"x")
    with (tmp_path / "open").open("rb") as opened:
        number = opened.fileno()
        calls: dict[str, Callable[[], object]] = {
            "source": lambda: hall.restore(number),
            "source ": lambda: client.restore("never", number),
            "file": lambda: hall.snapshot(number),
            "file ": lambda: hall.snapshot(True),
            "key_file": lambda: mrol.connect(client.address, key_file=number),
            "ca": lambda: mrol.connect("https://localhost:1", ca=number),
            "client_cert": lambda: mrol.connect("https://localhost:1", client_cert=number),
        }
        for name, call in calls.items():
            with pytest.raises(mrol.ArgumentError) as refused:
                call()
            assert refused.value.argument == name.strip()
        # A file object is no path either, and stays open.
        with pytest.raises(mrol.ArgumentError, match="source must be the path of a map file"):
            hall.restore(opened)
        assert opened.read() == b"x"


ERRORS = [
    OSError(errno.ENOSPC, "the log is full"),
    ConnectionError("the dashboard is gone"),
    TimeoutError("the dashboard is slow"),
    ValueError("no such stage"),
    KeyError("stage"),
    StopIteration(7),
    mrol.ConnectionLost("another server is gone"),
    mrol.ConnectFailed("another server is not there"),
    mrol.Unauthenticated(401, "unauthenticated", "key_missing", "another server"),
    KeyboardInterrupt(),
    SystemExit(3),
]
"""What a function may raise that writes a log, or tells a dashboard."""


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_what_a_progress_raises_comes_out_unchanged(hall: mrol.Map, tmp_path: Path, error: BaseException) -> None:
    file, of_hall = tmp_path / "a.mrol", hall.snapshot(tmp_path / "hall.mrol")
    file.write_bytes(b"what was there")
    whole = (tmp_path / "hall.mrol").read_bytes()
    calls = 0

    def told(*_: object) -> None:
        nonlocal calls
        calls += 1
        raise error

    begun: list[Callable[[], object]] = [
        lambda: hall.snapshot(file, progress=told),
        lambda: hall.restore(whole, progress=told),
        lambda: hall.restore(tmp_path / "hall.mrol", progress=told),
    ]
    if not isinstance(error, StopIteration):
        # A generator cannot raise that one.
        begun.append(lambda: next(hall.watch(progress=told)))
    threads = threading.active_count()
    for begin in begun:
        calls = 0
        with pytest.raises(type(error)) as raised:
            begin()
        assert raised.value is error
        assert error.__context__ is None
        assert error.__cause__ is None
        assert calls == 1
        error.__traceback__ = None
    assert file.read_bytes() == b"what was there"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a.mrol", "hall.mrol"]
    assert hall.describe().version == of_hall
    assert threading.active_count() == threads
    assert len(hall._caller._pool._connections.used) == 0  # noqa: SLF001


def test_a_server_that_hangs_up_is_told_as_such(tmp_path: Path) -> None:
    with ScriptedServer(lambda sock, _: sock.sendall(b"HTTP/1.1 200 OK\r\ncontent-length: 10\r\n\r\nhalf")) as server:
        told: list[int] = []
        with pytest.raises(mrol.ConnectionLost):
            map_of(server).snapshot(tmp_path / "a.mrol", progress=lambda done, _: told.append(done))
    assert list(tmp_path.iterdir()) == []
