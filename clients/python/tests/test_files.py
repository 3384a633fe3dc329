"""Map files: where they are written, what of the file before stays, and functions that are told how far it is."""

import errno
import itertools
import os
import signal
import socket
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import mrol

from .support.interrupts import is_interrupted_at, within
from .support.proxy import DroppingProxy
from .support.scripted import ScriptedServer, answer
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


@pytest.mark.parametrize("name", ["newdir/", "newdir/.", "newdir/.."])
def test_the_name_of_a_folder_is_none_of_a_file(hall: mrol.Map, tmp_path: Path, name: str) -> None:
    with pytest.raises(mrol.ArgumentError, match="name of a folder"):
        hall.snapshot(f"{tmp_path}/{name}")
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.geteuid() != 0, reason="a file of another group takes root to make")
@pytest.mark.parametrize(
    ("refuses", "mode", "kept"),
    [
        ("nothing", 0o660, (4001, 5000, 0o660)),
        ("the owner", 0o660, (0, 5000, 0o660)),
        ("the owner", 0o6750, (0, 5000, 0o750)),
        ("both", 0o660, (0, 0, 0o600)),
        ("both", 0o664, (0, 0, 0o644)),
        ("both", 0o604, (0, 0, 0o600)),
        ("both", 0o755, (0, 0, 0o755)),
    ],
)
def test_owner_and_group_stay_as_far_as_they_may(  # noqa: PLR0917
    hall: mrol.Map, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refuses: str, mode: int, kept: tuple[int, int, int]
) -> None:
    file = tmp_path / "there.mrol"
    file.write_bytes(b"what was there")
    os.chown(file, 4001, 5000)
    file.chmod(mode)
    fchown = os.fchown
    seen: list[int] = []

    def refusing(descriptor: int, uid: int, gid: int) -> None:
        if refuses == "both" or (refuses == "the owner" and uid != -1):
            raise PermissionError(errno.EPERM, "not the owner")
        fchown(descriptor, uid, gid)

    def told(*_: object) -> None:
        seen.extend(mode_of(part) for part in tmp_path.iterdir() if part != file)

    monkeypatch.setattr(os, "fchown", refusing)
    hall.snapshot(file, progress=told)
    found = file.stat()
    assert (found.st_uid, found.st_gid, mode_of(file)) == kept
    assert set(seen) == {kept[2]}


# What is destroyed in the middle of a line closes itself, and says so.
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_ctrl_c_at_any_line_of_a_snapshot_leaves_nothing(hall: mrol.Map, tmp_path: Path) -> None:
    file = tmp_path / "a.mrol"
    hall.snapshot(file)
    whole, open_files = file.read_bytes(), len(os.listdir("/proc/self/fd"))
    for line in itertools.count(1):
        if not is_interrupted_at(line, lambda: hall.snapshot(file)):
            break
        assert [entry.name for entry in tmp_path.iterdir()] == ["a.mrol"], line
        assert file.read_bytes() == whole
    assert line > 100
    assert len(os.listdir("/proc/self/fd")) <= open_files + 1


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
    assert len(hall._caller._servers.current._connections.used) == 0  # noqa: SLF001


def test_a_server_that_hangs_up_is_told_as_such(tmp_path: Path) -> None:
    with ScriptedServer(lambda sock, _: sock.sendall(b"HTTP/1.1 200 OK\r\ncontent-length: 10\r\n\r\nhalf")) as server:
        told: list[int] = []
        with pytest.raises(mrol.ConnectionLost):
            map_of(server).snapshot(tmp_path / "a.mrol", progress=lambda done, _: told.append(done))
    assert list(tmp_path.iterdir()) == []


LARGE = 5_000_000


@pytest.mark.parametrize("becomes", [0, 4096, 3 << 20, LARGE - 1, LARGE + 1])
def test_a_file_that_changes_its_length_while_it_is_sent_is_not_restored(
    client: mrol.Client, hall: mrol.Map, tmp_path: Path, becomes: int
) -> None:
    file, before = tmp_path / "a.mrol", hall.describe().version
    file.write_bytes(os.urandom(LARGE))
    for restore in (lambda: hall.restore(file, progress=change), lambda: client.restore("never", file, progress=change)):
        os.truncate(file, LARGE)

        def change(*_: object) -> None:
            os.truncate(file, becomes)

        with pytest.raises(mrol.MrolError, match=f"a.mrol' changed while it was sent: it had {LARGE} bytes, and has {becomes}"):
            restore()
    assert hall.describe().version == before
    assert "never" not in [info.name for info in client.maps().maps]


def test_a_file_that_was_refused_for_now_is_sent_again_from_its_beginning(tmp_path: Path) -> None:
    file = tmp_path / "a.mrol"
    file.write_bytes(bytes(LARGE))
    later = answer(b'{"code":"unavailable","reason":"starting","detail":"later"}', status=b"503 Not Now")
    answers = itertools.chain([later], itertools.repeat(answer(b"{}")))
    told: list[int] = []
    with ScriptedServer(lambda sock, _: sock.sendall(next(answers))) as server, pytest.raises(mrol.BadAnswer):
        map_of(server, patience_s=5.0).restore(file, progress=lambda done, _: told.append(done))
    assert told[: len(told) // 2] == told[len(told) // 2 :]
    assert told[-1] == LARGE


@contextmanager
def not_reading() -> Iterator[str]:
    """A server that says that it lives, and reads nothing else but what the system takes for it."""
    over = threading.Event()

    def script(client: socket.socket) -> bytes | None:
        head = client.recv(4096)
        if b"/livez" not in head:
            over.wait(30)
            return None
        return head

    server = ScriptedServer(lambda *_: None)
    server._request = script  # type: ignore[method-assign] # noqa: SLF001
    with server:
        try:
            yield server.address
        finally:
            over.set()


def test_what_ends_the_sending_of_a_file_is_told_as_it_is(client: mrol.Client, tmp_path: Path) -> None:
    file = tmp_path / "a.mrol"
    with file.open("wb") as made:
        made.truncate(50_000_000)
    open_files = len(os.listdir("/proc/self/fd"))
    host = client.address.removeprefix("http://")
    with (
        DroppingProxy(host, lambda number: None if number == 0 else (3_000_000, 1 << 30)) as proxy,
        pytest.raises(mrol.ConnectionLost),
    ):
        mrol.connect(proxy.address).restore("never", file)
    with not_reading() as address:
        with pytest.raises(mrol.TimedOut):
            mrol.connect(address).restore("never", file, timeout_s=0.5)
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with pytest.raises(KeyboardInterrupt), within(10):
            mrol.connect(address).restore("never", file)
        timer.join()
    assert not [place for place in Path("/proc/self/maps").read_text().splitlines() if str(file) in place]
    assert str(file) not in [os.path.realpath(f"/proc/self/fd/{number}") for number in os.listdir("/proc/self/fd")]
    assert len(os.listdir("/proc/self/fd")) <= open_files + 8


@pytest.mark.parametrize("argument", ["source", "key_file", "ca", "client_cert"])
def test_pipes_and_devices_are_not_read(client: mrol.Client, tmp_path: Path, argument: str) -> None:
    calls: dict[str, Callable[[Any], object]] = {
        "source": lambda place: client.restore("never", place),
        "key_file": lambda place: mrol.connect(client.address, key_file=place),
        "ca": lambda place: mrol.connect("https://localhost:1", ca=place),
        "client_cert": lambda place: mrol.connect("https://localhost:1", client_cert=place),
    }
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", "/dev/zero", tmp_path):
        with within(5), pytest.raises(mrol.ArgumentError, match="no regular file|directory") as refused:
            calls[argument](place)
        assert refused.value.argument == argument


def test_a_key_file_has_an_end(client: mrol.Client, tmp_path: Path) -> None:
    with (tmp_path / "key").open("wb") as made:
        made.truncate(1 << 40)
    with pytest.raises(mrol.ArgumentError, match="more than 16777216 bytes"):
        mrol.connect(client.address, key_file=tmp_path / "key")
