"""Addresses of something else than the server's HTTP: the error says what is there, and which address to give."""

import subprocess
import sys
from pathlib import Path

import pytest

import mrol

from .support.scripted import answer, answering_all
from .support.server import Server, serving
from .test_access import certificate

RIGHT = "give the HTTP address that `mrol serve` prints: http://127.0.0.1:7333 unless it is set to another"


def test_the_grpc_port_is_named_as_that(server: Server) -> None:
    with pytest.raises(mrol.WrongPort) as wrong:
        mrol.connect(server.grpc)
    assert str(wrong.value) == f"http://{server.grpc} speaks gRPC, and this package HTTP: {RIGHT}"
    # It is not waited for: the port will not become another.
    with pytest.raises(mrol.WrongPort):
        mrol.connect(server.grpc, wait_s=1000)


def test_tls_and_its_absence_are_told_apart(server: Server, tmp_path: Path) -> None:
    with pytest.raises(mrol.ConnectFailed, match=f"speak no TLS: is it http://{server.address}"):
        mrol.connect(f"https://{server.address}")
    pem, key = certificate(tmp_path, "localhost")
    with serving(tmp_path, "--tls-certificate", str(pem), "--tls-key", str(key)) as encrypted:
        port = encrypted.address.rsplit(":", 1)[1]
        assert mrol.connect(f"https://localhost:{port}", ca=pem).health().ready
        with pytest.raises(mrol.WrongPort, match=f"speaks TLS: give https://localhost:{port}, and as `ca` who"):
            mrol.connect(f"localhost:{port}")
        grpc = encrypted.grpc.rsplit(":", 1)[1]
        with pytest.raises(mrol.WrongPort, match="speaks gRPC.*https://localhost:7333"):
            mrol.connect(f"https://localhost:{grpc}", ca=pem)


@pytest.mark.parametrize(
    ("said", "word"),
    [
        (answer(b"<html>Not found</html>", status=b"404 Not Found"), "answers 404"),
        (answer(b"<html>Welcome</html>"), "says b'<html>Welcome</html>' where that one says b'ok'"),
        (b"SSH-2.0-OpenSSH_9.6\r\n", "SSH-2.0"),
    ],
)
def test_another_server_is_none_of_mrol(said: bytes, word: str) -> None:
    with answering_all(said) as address, pytest.raises(mrol.BadAnswer) as wrong:
        mrol.connect(address)
    assert str(wrong.value).startswith(f"http://{address} is no mrol server: ")
    assert word in str(wrong.value)
    assert RIGHT in str(wrong.value)


def test_a_server_that_only_hangs_up_may_be_another() -> None:
    with answering_all(b"") as address, pytest.raises(mrol.ConnectionLost) as lost:
        mrol.connect(address)
    assert f"http://{address} may be no mrol server; {RIGHT}" in str(lost.value)


def test_the_command_says_so_and_fails(server: Server) -> None:
    def run(address: str) -> tuple[int, str, str]:
        done = subprocess.run([sys.executable, "-m", "mrol", address], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    code, said, wrong = run(server.grpc)
    assert (code, said) == (1, "")
    assert wrong.startswith(f"error: http://{server.grpc} speaks gRPC")
    assert RIGHT in wrong
    code, _, wrong = run("127.0.0.1:1")
    assert code == 1
    assert "is `mrol serve` running there?" in wrong
    code, _, wrong = run("no address")
    assert code == 2
    assert "address must be host:port" in wrong
