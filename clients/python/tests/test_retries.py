"""Connections that break: nothing is done twice, and nothing is lost."""

import copy
import itertools
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest

import mrol

from .support.proxy import DroppingProxy
from .support.scripted import ScriptedServer, answer, answering
from .support.server import scan_ids, serving
from .test_hostile_servers import map_of

DROPS = 1000
SCAN_POINTS = 200
ANSWER_BYTES = 1200
"""About as many bytes as an answer to a scan has with its headers."""


def test_a_thousand_connections_dropped_in_mid_insert(tmp_path: Path) -> None:
    """Each connection is dropped somewhere in one of its first scans, or of the answers to them, until a thousand were."""
    rng = np.random.default_rng(1)
    scan_bytes = 12 * SCAN_POINTS + 300

    def plan(number: int) -> tuple[int, int] | None:
        if number == 0:
            # Connecting itself is not tried again.
            return 1 << 30, 3000
        is_answer = bool(rng.integers(2))
        there = 1 << 30 if is_answer else int(rng.integers(1, 3 * scan_bytes))
        return there, int(rng.integers(1, 3 * ANSWER_BYTES)) if is_answer else 1 << 30

    with serving(tmp_path, "--durability", "1s") as server, DroppingProxy(server.address, plan) as proxy:
        direct = mrol.connect(server.address).map("m", resolution=0.1)
        m = mrol.connect(proxy.address).map("m", resolution=0.1)
        sent: list[mrol.ScanAnswer] = []
        replayed = 0
        while proxy.dropped < DROPS:
            points = np.full((SCAN_POINTS, 3), len(sent) * 0.1 + 0.05)
            scan = m.insert(points, guess=mrol.Pose.identity(), align=False, force=True)
            replayed += scan.replayed
            sent.append(scan)
        in_map = scan_ids(direct)
        assert in_map == [(scan.session, scan.scan_id) for scan in sent]
        assert [scan.scan_id for scan in sent] == list(range(1, len(sent) + 1))
        assert [scan.revision for scan in sent] == list(range(1, len(sent) + 1))
        assert direct.count_voxels() == len(sent)
        # Both kinds of loss came up: scans that had been taken, and scans that had not.
        assert 0 < replayed < proxy.dropped
        # A deletion, an undo and a keep-out through the same.
        before = direct.describe().revision
        deleted = m.delete([[0.05, 0.05, 0.05]])
        m.undo(deleted)
        m.keep_out("k", sphere=([0, 0, 0], 1))
        assert direct.describe().revision == before + 3


def test_after_the_last_try_the_same_scan_can_be_sent_again(client: mrol.Client, empty: mrol.Map) -> None:
    host = client.address.removeprefix("http://")
    is_broken = False
    with DroppingProxy(host, lambda _: (1 << 30, 20) if is_broken else (1 << 30, 100_000)) as proxy:
        through = mrol.connect(proxy.address, patience_s=0.2)
        m = through.map(empty.name)
        through.close()
        is_broken = True
        with pytest.raises(mrol.ConnectionLost) as lost:
            m.insert([[1, 0, 0]], align=False)
    assert set(lost.value.repeat_with) == {"session", "scan_id"}
    again = empty.insert([[1, 0, 0]], align=False, **lost.value.repeat_with)
    assert again.replayed
    assert len(empty.trajectory()) == 1


def test_what_has_no_id_is_not_sent_twice() -> None:
    def drop(*_: object) -> None:
        """Answers nothing."""

    with ScriptedServer(drop) as server:
        client = mrol.connect(server.address)
        with pytest.raises(mrol.ConnectionLost):
            client.delete_map("m")
        assert server.requests == 1
        with pytest.raises(mrol.ConnectionLost):
            client.restore("m", b"x" * 100)
        assert server.requests == 2


@pytest.mark.parametrize("reason", ["overloaded", "starting", "draining", "catalog_busy"])
def test_refusals_that_pass_are_waited_for(reason: str) -> None:
    refusal = b'{"code":"unavailable","reason":"%s","detail":"later"}' % reason.encode()
    answers = itertools.chain(
        [answer(refusal, b"retry-after: 0", status=b"503 Not Now")] * 3, itertools.repeat(answer(b'{"maps":[]}'))
    )
    with ScriptedServer(lambda sock, _: sock.sendall(next(answers))) as server:
        client = mrol.connect(server.address)
        assert client.maps().maps == ()
        assert server.requests == 4


def test_a_refusal_that_stays_is_raised_at_once_with_all_that_it_says() -> None:
    refusal = b'{"code":"resource_exhausted","reason":"map_full","detail":"the map is full","status":429}'
    with ScriptedServer(lambda sock, _: sock.sendall(answer(refusal, b"retry-after: 7", status=b"429 Much"))) as server:
        with pytest.raises(mrol.ResourceExhausted) as refused:
            mrol.connect(server.address).maps()
        assert server.requests == 1
    error = refused.value
    assert (error.status, error.code, error.reason, error.message) == (429, "resource_exhausted", "map_full", "the map is full")
    assert error.retry_after_s == 7
    assert str(error) == "the map is full (map_full)"


def test_no_server_is_told_at_once_and_waited_for_on_request(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        address = server.address
    with pytest.raises(mrol.ConnectFailed, match=r"is `mrol serve` running there\?"):
        mrol.connect(address)
    with pytest.raises(mrol.ConnectFailed):
        mrol.connect(address, wait_s=0.3)
    with pytest.raises(mrol.ConnectFailed):
        mrol.connect(f"unix:{tmp_path}/nothing.sock")


def test_a_server_that_hangs_is_not_waited_for_longer_than_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as hanging:
        began = time.monotonic()
        with pytest.raises(mrol.TimedOut):
            mrol.connect(f"127.0.0.1:{hanging.getsockname()[1]}", wait_s=0.5, timeout_s=20)
        assert 0.5 < time.monotonic() - began < 5


@contextmanager
def taking_no_connection(host: str, port: int = 0) -> Iterator[int]:
    """A port at which connections are neither taken nor refused: those that wait there are as many as it lets wait."""
    with socket.socket() as listener, ExitStack() as waiting:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(0)
        for _ in range(4):
            one = waiting.enter_context(socket.socket())
            one.setblocking(False)
            one.connect_ex(listener.getsockname())
        yield listener.getsockname()[1]


def test_all_addresses_of_a_host_have_one_deadline(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[tuple[str, int]] = []

    def places(*_: object, **__: object) -> list[object]:
        return [(socket.AF_INET, socket.SOCK_STREAM, 0, "", place) for place in found]

    monkeypatch.setattr(socket, "getaddrinfo", places)
    with (
        taking_no_connection("127.0.0.1") as port,
        taking_no_connection("127.0.0.2", port),
        taking_no_connection("127.0.0.3", port),
    ):
        found += [(f"127.0.0.{number}", port) for number in (1, 2, 3)]
        began = time.monotonic()
        with pytest.raises(mrol.ConnectFailed, match="no answer within 0.6 s"):
            mrol.connect(f"robot-7:{port}", timeout_s=0.6)
        assert 0.5 < time.monotonic() - began < 1.5
        # The first of them leaves time for the one that answers.
        with ScriptedServer(answering(answer(b"{}"))) as server:
            host, answering_port = server.address.split(":")
            found[1] = (host, int(answering_port))
            assert mrol.connect(f"robot-7:{port}", timeout_s=3.0).address == f"http://robot-7:{port}"


def test_what_may_have_been_done_can_be_repeated() -> None:
    problem = b'{"code": "deadline_exceeded", "reason": "time_limit", "detail": "too slow"}'
    said = [
        answer(problem, b"content-type: application/problem+json", status=b"504 Gateway Timeout"),
        answer(b"{", status=b"502 Bad"),
    ]
    for data in said:
        with ScriptedServer(answering(data)) as server:
            m = map_of(server)
            with pytest.raises(mrol.MrolError) as failed:
                m.insert([[0, 0, 0]])
            assert set(failed.value.repeat_with) == {"session", "scan_id"}
            assert copy.copy(failed.value).repeat_with == failed.value.repeat_with
    refused = answer(b'{"code": "invalid_argument", "reason": "bad_query", "detail": "no"}', status=b"400 Bad Request")
    with ScriptedServer(answering(refused)) as server, pytest.raises(mrol.InvalidArgument) as failed:
        map_of(server).insert([[0, 0, 0]])
    assert not failed.value.repeat_with
