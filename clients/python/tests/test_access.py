"""Keys, TLS and Unix sockets."""

import json
import pickle
import socket
import subprocess
import threading
import time
import traceback
import urllib.request
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

import mrol

from .support.odd import error_of
from .support.scripted import LIVE, ScriptedServer, answer, answering
from .support.server import run, serving
from .test_hostile_servers import map_of


def certificate(folder: Path, name: str) -> tuple[Path, Path]:
    """A certificate of its own for a name, and its key."""
    pem, key = folder / f"{name}.pem", folder / f"{name}.key"
    subject = ["-subj", f"/CN={name}", "-addext", f"subjectAltName=DNS:{name}"]
    options = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", *subject]
    files = ["-keyout", str(key), "-out", str(pem), "-addext", "basicConstraints=critical,CA:FALSE"]
    subprocess.run(["openssl", "req", "-x509", *options, *files], check=True, capture_output=True)
    return pem, key


def test_a_server_that_does_not_tell_how_many_poses_it_keeps_is_understood(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        mrol.connect(server.address).map("m", resolution=0.1)
        with urllib.request.urlopen(f"http://{server.address}/v1/maps/m") as response:
            told = json.load(response)
    assert told.pop("poses") == 0
    with ScriptedServer(answering(answer(json.dumps(told).encode()))) as server:
        assert map_of(server).describe().poses is None


def test_keys_open_what_they_are_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keys = tmp_path / "keys.toml"
    new = ["key", "new", "--file", str(keys)]
    admin = run(*new, "--name", "admin", "--scope", "admin").strip()
    reader = run(*new, "--name", "reader", "--scope", "read", "--maps", "a").strip()
    robot = run(*new, "--name", "robot", "--scope", "insert", "--robots", "r1").strip()
    with serving(tmp_path, "--keys-file", str(keys)) as server:
        a = mrol.connect(server.address, key=admin).map("a", resolution=0.1)
        mrol.connect(server.address, key=admin).map("b", resolution=0.1)
        assert a.insert([[1, 0, 0]], align=False, robot="r1").accepted
        anonymous = mrol.connect(server.address)
        assert anonymous.health().ready
        for refused, error, reason in (
            (lambda: anonymous.map("a"), mrol.Unauthenticated, "key_missing"),
            (lambda: mrol.connect(server.address, key="wrong").maps(), mrol.Unauthenticated, "key_unknown"),
            (lambda: mrol.connect(server.address, key=reader).map("b"), mrol.PermissionDenied, "map_not_allowed"),
            (lambda: mrol.connect(server.address, key=reader).map("a", 0.2), mrol.PermissionDenied, "scope_too_small"),
            (lambda: mrol.connect(server.address, key=robot).map("c", 0.1), mrol.PermissionDenied, "scope_too_small"),
            (
                lambda: mrol.connect(server.address, key=robot).map("a").insert([[1, 0, 0]]),
                mrol.PermissionDenied,
                "robot_not_allowed",
            ),
        ):
            with pytest.raises(error) as denied:
                refused()
            assert denied.value.reason == reason
        # The lines of the guide, with a key that may not make maps: the map is there.
        assert mrol.connect(server.address, key=robot).map("a", resolution=0.1, robot="r1").describe().scans == 1
        assert [of.name for of in mrol.connect(server.address, key=reader).maps().maps] == ["a"]
        made = a.keep_out("k", sphere=([0, 0, 0], 1))
        assert a.keep_outs().keep_outs[0].made_by == "admin"
        assert made.revision == 2
        assert mrol.connect(server.address, key=f"{reader}\n").map("a").describe().scans == 1
        monkeypatch.setenv("MROL_KEY", reader)
        told = mrol.connect(server.address).map("a").describe()
        assert (told.scans, told.poses) == (1, 1)
        monkeypatch.delenv("MROL_KEY")
        (tmp_path / "reader.key").write_text(f"{reader}\n")
        monkeypatch.setenv("MROL_KEY_FILE", str(tmp_path / "reader.key"))
        assert mrol.connect(server.address).map("a").describe().scans == 1
        # A large body is refused before it was read.
        with pytest.raises(mrol.Unauthenticated):
            mrol.connect(server.address, key="wrong").restore("x", bytes(100_000_000))


def test_a_key_is_shown_to_the_server_alone(tmp_path: Path) -> None:
    secret = "open-sesame"  # noqa: S105
    with serving(tmp_path) as server:
        client = mrol.connect(server.address, key=secret)
        m = client.map("m", resolution=0.1)
        for shown in (repr(client), repr(m), str(vars(client)), repr(client._caller._key)):  # noqa: SLF001
            assert secret not in shown
        for kept, message in ((m, "the map must be made anew"), (client, "the client must be connected anew in each process")):
            with pytest.raises(mrol.ArgumentError, match=message):
                pickle.dumps(kept)
    for bad in ("", "two\r\nlines", "ü", "tab\t"):
        with pytest.raises(mrol.ArgumentError, match="key must be a secret") as refused:
            mrol.connect(server.address, key=bad)
        assert not bad or bad not in str(refused.value)
    with pytest.raises(mrol.ArgumentError, match="key must be one of the two"):
        mrol.connect(server.address, key=secret, key_file=tmp_path / "f")
    with pytest.raises(mrol.ArgumentError, match="key_file must be the path of a regular file with a secret"):
        mrol.connect(server.address, key_file=tmp_path / "nowhere")


def shown_of(error: BaseException | None) -> str:
    """All that anybody can print of an error: its message, its fields, its traceback, and those of the errors behind it."""
    said = ""
    while error is not None:
        lines = traceback.format_exception(error)
        said += "".join(line for line in lines if "tests/" not in line) + repr(error) + repr(error.args) + repr(vars(error))
        error = error.__cause__ or error.__context__
    return said


def test_no_error_shows_a_key_or_a_password(tmp_path: Path) -> None:
    secret = "mrol_0123456789abcdefghijklmnopqrstuvwxyz"  # noqa: S105
    pem = f"-----BEGIN PRIVATE KEY-----\n{secret}\n-----END PRIVATE KEY-----\n"
    files = {
        "lines": f"{secret}\n{secret}\n",
        "comment": f"# the key of r1\n{secret}",
        "bytes": f"{secret}\0",
        "umlaut": f"{secret}\u00fc",
        "empty": "",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    no_paths: list[Any] = [secret, f"{secret}/...", f"{secret}\n", secret.encode(), [secret], {secret}, "\0" + secret, secret * 500]
    refused: list[tuple[str, dict[str, Any]]] = [
        *[("localhost:1", {"key_file": tmp_path / name}) for name in files],
        *[("localhost:1", {"key_file": of}) for of in no_paths],
        *[("localhost:1", {"key": of}) for of in (f"{secret}\n{secret}", secret.encode(), [secret], f"{secret}\u00fc")],
        *[("https://localhost:1", {name: of}) for name in ("ca", "client_cert") for of in (pem, *no_paths)],
        ("https://localhost:1", {"client_key": pem}),
        ("https://localhost:1", {"client_cert": tmp_path / "lines", "client_key": pem}),
        ("localhost:1", {"ca": pem, "client_cert": pem}),
        ("http://localhost:1", {"ca": pem}),
        (f"http://user:{secret}@host", {}),
        (f"http://:{secret}@host", {}),
        (f"https://user:{secret}@host:port", {}),
        (f"user:{secret}@host", {}),
        (f"http://user:{secret[:30]}/{secret}@host", {}),
        (f"http://user:{secret}@host", {"ca": tmp_path / "lines"}),
        (f"http://host?key={secret}", {}),
        (f"ftp://{secret}@host", {}),
        (f"http://user:{secret}@ho st", {}),
        (f"http://host/{secret}", {}),
        (f"http://host#{secret}", {}),
        (f"host:{secret}", {}),
        (f"host;key={secret}", {}),
        (f"user:{secret}%40host", {}),
        (f"http://user%3A{secret}%40host", {}),
        (f"unix:{secret}", {"ca": tmp_path / "lines"}),
        (f"unix:{secret}\0", {}),
    ]
    for address, options in refused:
        with pytest.raises(mrol.ArgumentError) as error:
            mrol.connect(address, **options)
        assert secret[:20] not in shown_of(error.value), (address, options)
    with pytest.raises(mrol.ArgumentError, match=r"key_file must be the path of a regular file .*lines' with 2 lines in it"):
        mrol.connect("localhost:1", key_file=tmp_path / "lines")


def test_an_address_that_nobody_answers_at_is_shown_without_a_path(tmp_path: Path) -> None:
    secret = "mrol_0123456789abcdefghijklmnopqrstuvwxyz"  # noqa: S105
    with pytest.raises(mrol.ConnectFailed, match="cannot connect to unix:no file that is there") as failed:
        mrol.connect(f"unix:{secret}")
    assert secret[:20] not in shown_of(failed.value)
    (tmp_path / "file").touch()
    with pytest.raises(mrol.ConnectFailed, match=f"cannot connect to unix:'{tmp_path}/file'"):
        mrol.connect(f"unix:{tmp_path}/file")


Echo = Callable[[bytes, bytes], bytes]
"""Makes an answer of a request's head and of the secret in it."""

ECHOES: dict[str, Echo] = {
    "a body that is no refusal": lambda head, _: answer(head * 3, status=b"400 Bad"),
    "a refusal": lambda head, _: answer(
        json.dumps({"code": head.decode(), "reason": head.decode(), "detail": head.decode()}).encode(), status=b"400 Bad"
    ),
    "a status": lambda _, secret: b"Bearer " + secret + b"\r\n\r\n",
    "a header that is none": lambda _, secret: b"HTTP/1.1 200 OK\r\n" + b"x" * 80 + secret + b"\r\n\r\n",
    "a length": lambda _, secret: b"HTTP/1.1 200 OK\r\ncontent-length: " + secret + b"\r\n\r\n",
    "a chunk": lambda _, secret: b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n" + secret + b"\r\n",
    "a header of an answer": lambda _, secret: answer(
        b"\0",
        b"mrol-points: 1",
        b"mrol-points-occupied: 0",
        b"mrol-map-uuid: u",
        b"mrol-revision: 1",
        b"mrol-content-hash: " + secret,
    ),
    "a count": lambda _, secret: answer(b"\0", b"mrol-points: " + secret),
    "another kind of JSON": lambda _, secret: answer(b'["%s"]' % secret),
    "a long text": lambda _, secret: answer(b'["%s%s"]' % (b"x" * 90, secret * 9)),
}


@pytest.mark.parametrize("name", ECHOES)
def test_a_peer_that_says_a_key_again_brings_it_into_no_error(name: str) -> None:
    secret = "mrol_0123456789abcdefghijklmnopqrstuvwxyz"  # noqa: S105
    with ScriptedServer(lambda sock, _: sock.sendall(ECHOES[name](server.head, secret.encode()))) as server:
        m = map_of(server, key=secret)
        for call in (m.describe, lambda: m.query([[0, 0, 0]]), lambda: next(m.watch()), lambda: next(m.watch_events())):
            error = error_of(call)
            assert error is not None or name in {"a header of an answer", "a count"}
            again = pickle.loads(pickle.dumps(error))  # noqa: S301
            assert str(again) == str(error)
            shown = "".join(traceback.format_exception(error)) + repr(error)
            shown += repr(again) + repr(getattr(again, "__dict__", ""))
            # A part of it would do as well.
            assert secret[5:15] not in shown
            assert secret[-10:] not in shown


def test_a_short_key_leaves_messages_readable() -> None:
    said = answer(b"{}", status=b"400 Bad")
    with ScriptedServer(answering(said)) as server, pytest.raises(mrol.BadAnswer, match="the server answers 400, and says"):
        map_of(server, key="s").describe()


class KeyServer(ScriptedServer):
    """Takes one secret; who shows another one is answered when so many have come with another."""

    def __init__(self, secret: str, together: int) -> None:
        self.secret = secret
        self._refused = threading.Barrier(together)
        super().__init__(lambda *_: None)

    def __enter__(self) -> "KeyServer":
        return self

    def _serve(self, client: socket.socket) -> None:
        with client, suppress(OSError):
            while (head := self._request(client)) is not None:
                if b"/livez" in head:
                    client.sendall(LIVE)
                elif f"authorization: Bearer {self.secret}\r\n".encode() in head + b"\r\n":
                    client.sendall(answer(b'{"maps":[]}'))
                else:
                    self._refused.wait(10)
                    said = b'{"code":"unauthenticated","reason":"key_unknown","detail":"no"}'
                    client.sendall(answer(said, status=b"401 Unauthorized"))


def test_threads_that_are_refused_together_all_take_the_new_key(tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_text("the-former")
    with KeyServer("the-new-one", 8) as server:
        client = mrol.connect(server.address, key_file=file)
        file.write_text("the-new-one")
        with ThreadPoolExecutor(8) as threads:
            assert [found.maps for found in threads.map(lambda _: client.maps(), range(8))] == [()] * 8
        server.secret = "another"  # noqa: S105
        with ThreadPoolExecutor(8) as threads:
            for refused in [threads.submit(client.maps) for _ in range(8)]:
                with pytest.raises(mrol.Unauthenticated):
                    refused.result()


def test_snapshots_and_watches_take_the_new_key(tmp_path: Path) -> None:
    keys, file = tmp_path / "keys.toml", tmp_path / "admin.key"
    of_key = ["--name", "admin", "--file", str(keys)]
    file.write_text(run("key", "new", "--scope", "admin", *of_key))
    with serving(tmp_path, "--keys-file", str(keys)) as server:
        m = mrol.connect(server.address, key_file=file).map("m", resolution=0.1)
        m.insert([[1, 0, 0]], align=False)
        events = m.watch(heartbeats=True)
        next(events)
        secret = run("key", "rotate", "--end-former", *of_key).strip().splitlines()[-1]
        # The server looks at its keys now and then.
        while error_of(lambda: m.snapshot(tmp_path / "a.mrol")) is None:
            time.sleep(0.05)
        file.write_text(secret)
        m.snapshot(tmp_path / "a.mrol")
        revision = m.insert([[2, 0, 0]], align=False, guess=[0, 0, 0, 0, 0, 0, 1], force=True).revision
        while next(events).revision < revision:
            pass


def test_tls_is_checked_on_both_sides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pem, key = certificate(tmp_path, "localhost")
    client_pem, client_key = certificate(tmp_path, "client")
    tls = ["--tls-certificate", str(pem), "--tls-key", str(key), "--tls-client-ca", str(client_pem)]
    with serving(tmp_path, *tls) as server:
        address = server.address.replace("127.0.0.1", "localhost")
        shown = {"client_cert": client_pem, "client_key": client_key}
        m = mrol.connect(address, ca=pem, **shown).map("m", resolution=0.1)
        assert m.insert([[x * 0.1 + 0.05, 0, 0] for x in range(100_000)], align=False).new_voxels == 100_000
        assert m.query([[x * 0.1 + 0.05, 0, 0] for x in range(100_000)]).count > 99_000
        monkeypatch.setenv("MROL_CA", str(pem))
        assert mrol.connect(f"https://{address}", **shown).map("m").describe().scans == 1
        monkeypatch.delenv("MROL_CA")
        with pytest.raises(mrol.ConnectFailed, match="CERTIFICATE_VERIFY_FAILED"):
            mrol.connect(f"https://{address}", **shown)
        with pytest.raises(mrol.ConnectFailed, match="not valid for '127.0.0.1'"):
            mrol.connect(f"https://{server.address}", ca=pem, **shown)
        with pytest.raises(mrol.TransportError):
            mrol.connect(f"https://{address}", ca=pem)
        with pytest.raises(mrol.MrolError):
            mrol.connect(f"http://{address}")
    with pytest.raises(mrol.ArgumentError, match="ca must be a file of certificates"):
        mrol.connect("localhost:1", ca=tmp_path / "nowhere")
    with pytest.raises(mrol.ArgumentError, match="client_key must be given with client_cert"):
        mrol.connect("https://localhost:1", client_key=client_key)
    with pytest.raises(mrol.ArgumentError, match="client_cert must be a certificate"):
        mrol.connect("https://localhost:1", client_cert=key, client_key=key)


def test_a_unix_socket_is_as_good_as_a_port(tmp_path: Path) -> None:
    path = tmp_path / "http.sock"
    with serving(tmp_path, "--http-socket", str(path)), mrol.connect(f"unix:{path}") as client:
        m = client.map("m", resolution=0.1)
        assert m.insert([[1, 0, 0]], align=False).accepted
        assert m.query([[1, 0, 0]]).occupied.all()
        assert client.address == f"unix:{path}"
        assert isinstance(next(m.watch()), mrol.WatchedState)


@pytest.mark.parametrize(
    "address",
    [
        "",
        ":7333",
        "ftp://host",
        "host:port",
        "host:99999",
        "http://host/path",
        "http://user@host",
        "unix:",
        "a b:1",
        "host\r\n:1",
        7,
    ],
)
def test_addresses_that_are_none_are_refused(address: str) -> None:
    with pytest.raises(mrol.ArgumentError, match="address must be host:port"):
        mrol.connect(address)


def test_an_ipv6_address_is_one(tmp_path: Path) -> None:
    with pytest.raises(mrol.ConnectFailed, match=r"http://\[::1\]:1"):
        mrol.connect("[::1]:1")
