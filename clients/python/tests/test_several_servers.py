"""Clients that are given the addresses of several servers."""

import json
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

import mrol
from mrol._revisions import Revisions
from mrol._sessions import Sessions

from .support.proxy import DroppingProxy
from .support.scripted import ScriptedServer, answer, answering
from .support.server import Server, run, serving

WHOLE = 1 << 30
POINT = [[0.05, 0.05, 0.05]]


def fill(m: mrol.Map, count: int) -> mrol.ScanAnswer:
    """Puts a row of points into a map as they are."""
    row = np.stack([np.arange(count) * 0.1 + 0.05, np.full(count, 0.05), np.full(count, 0.05)], axis=-1)
    return m.insert(row, guess=mrol.Pose.identity(), align=False, force=True)


@contextmanager
def two_of(folder: Path, *options: str) -> Iterator[tuple[Server, Server]]:
    """A server, and one with the same map a revision behind."""
    with serving(folder / "former") as former:
        fill(mrol.connect(former.address).map("m", resolution=0.1, levels=4), 3)
        former.stop()
        for name in ("ahead", "behind"):
            shutil.copytree(folder / "former", folder / name)
    with serving(folder / "ahead", *options) as ahead, serving(folder / "behind", *options) as behind:
        fill(mrol.connect(ahead.address).map("m"), 5)
        yield ahead, behind


@pytest.fixture(autouse=True)
def folders(tmp_path: Path) -> None:
    """The folder of the first server."""
    (tmp_path / "former").mkdir()


def test_questions_go_on_elsewhere_when_a_server_is_gone_between_and_during_them(tmp_path: Path) -> None:
    with two_of(tmp_path) as (ahead, behind):
        fill(mrol.connect(behind.address).map("m"), 5)
        client = mrol.connect([ahead.address, behind.address])
        m = client.map("m")
        assert m.query(POINT).occupied.all()
        assert client.address == f"http://{ahead.address}"
        ended = Event()

        def ask() -> int:
            asked = 0
            while not ended.is_set():
                assert m.query(POINT).occupied.all()
                assert len(m.voxels()) == 5
                asked += 1
            return asked

        counts: list[int] = []
        asking = [Thread(target=lambda: counts.append(ask())) for _ in range(3)]
        for thread in asking:
            thread.start()
        time.sleep(0.3)
        ahead.kill()
        began = time.monotonic()
        assert m.query(POINT).occupied.all()
        assert time.monotonic() - began < 1
        time.sleep(0.3)
        ahead.start()
        behind.kill()
        time.sleep(0.3)
        ended.set()
        for thread in asking:
            thread.join()
        assert len(counts) == 3
        assert min(counts) > 3
        assert client.address == f"http://{ahead.address}"


def test_all_addresses_are_named_where_no_server_is_there(tmp_path: Path) -> None:
    with serving(tmp_path / "former") as server:
        gone = [server.address]
        with serving_again(tmp_path) as other:
            gone.append(other.address)
    with pytest.raises(mrol.ConnectFailed) as failed:
        mrol.connect(", ".join(gone))
    assert all(f"http://{address}" in str(failed.value) for address in gone)
    assert str(failed.value).count("is `mrol serve` running there?") == 1


@contextmanager
def serving_again(folder: Path) -> Iterator[Server]:
    (folder / "other").mkdir()
    with serving(folder / "other") as server:
        yield server


def test_a_change_is_made_once_and_one_without_an_id_is_not_sent_again(tmp_path: Path) -> None:
    is_broken = False
    with (
        serving(tmp_path / "former") as server,
        DroppingProxy(server.address, lambda _: (WHOLE, 20) if is_broken else None) as proxy,
    ):
        direct = mrol.connect(server.address)
        fill(direct.map("m", resolution=0.1), 3)
        client, through = (mrol.connect([proxy.address, other_name_of(server)], patience_s=0) for _ in range(2))
        m = client.map("m")
        client.close()
        through.close()
        is_broken = True
        # Its answer was lost on the way.
        deleted = m.delete(POINT)
        assert deleted.replayed
        assert (deleted.revision, direct.map("m").describe().revision) == (2, 2)
        before = proxy.connections
        with pytest.raises(mrol.ConnectionLost):
            through.rename_map("m", "n")
        assert proxy.connections == before + 1
        assert [info.name for info in direct.maps().maps] == ["n"]


@pytest.mark.parametrize("refusal", ["map_not_found", "guess_required", "overloaded"])
def test_a_change_that_was_lost_is_not_told_as_refused_by_another_server(tmp_path: Path, refusal: str) -> None:
    is_broken = False
    with (
        serving(tmp_path / "former") as server,
        DroppingProxy(server.address, lambda _: (WHOLE, 20) if is_broken else None) as proxy,
        ScriptedServer(answering(refused(refusal))) as other,
    ):
        direct = mrol.connect(server.address).map("m", resolution=0.1)
        fill(direct, 3)
        client = mrol.connect([proxy.address, other.address], patience_s=0)
        m = client.map("m")
        client.close()
        is_broken = True
        with pytest.raises(mrol.MrolError) as failed:
            m.delete(POINT)
        assert failed.value.repeat_with.keys() == {"request_id"}
        assert direct.describe().revision == 2
        assert direct.delete(POINT, **failed.value.repeat_with).replayed
        # What changes nothing was refused, whatever came before.
        with pytest.raises(mrol.ServerError) as failed:
            m.query(POINT)
        assert not failed.value.repeat_with


def refused(reason: str) -> bytes:
    """The answer of a server that refuses."""
    body = json.dumps({"code": "unavailable", "reason": reason, "detail": "no"}).encode()
    return answer(body, status=b"503 Service Unavailable")


def other_name_of(server: Server) -> str:
    """Another name of a server, which makes it another address."""
    return server.address.replace("127.0.0.1", "localhost")


def test_what_was_not_sent_is_sent_elsewhere_without_an_id(tmp_path: Path) -> None:
    with two_of(tmp_path) as (ahead, behind):
        client = mrol.connect([ahead.address, behind.address], patience_s=0)
        ahead.kill()
        client.rename_map("m", "n")
        assert client.map("n").describe().name == "n"


def test_with_one_address_nothing_is_added_to_a_request(server: Server) -> None:
    heads: list[bytes] = []

    def said(sock: Any, _: Event) -> None:
        heads.append(scripted.head)
        sock.sendall(answer(b"\x01", b"mrol-points: 1", b"mrol-points-occupied: 1", b"mrol-revision: 7", b"mrol-map-uuid: u"))

    with ScriptedServer(said) as scripted:
        one = mrol.Map(mrol.connect(scripted.address)._caller, "m", "r", *shared())  # noqa: SLF001
        for _ in range(2):
            one.query(POINT)
        assert heads[0] == heads[1]
        assert heads[0].startswith(b"POST /v1/maps/m/occupancy HTTP/1.1\r\n")
        several = mrol.Map(mrol.connect([scripted.address, server.address])._caller, "m", "r", *shared())  # noqa: SLF001
        for _ in range(2):
            several.query(POINT)
        assert heads[2] == heads[0]
        assert heads[3].startswith(b"POST /v1/maps/m/occupancy?min_revision=7&map_uuid=u HTTP/1.1\r\n")


def shared() -> tuple[Sessions, Revisions]:
    """What maps of one client share."""
    return Sessions(), Revisions()


def test_a_reader_never_sees_the_map_go_back(tmp_path: Path) -> None:
    settings = tmp_path / "mrol.toml"
    settings.write_text("[limits]\nmin_revision_wait_max_s = 0.3\n")
    with two_of(tmp_path, "--config", str(settings)) as (ahead, behind):
        m = mrol.connect([ahead.address, behind.address], patience_s=0.5).map("m")
        told = m.query(POINT).version
        assert told.revision == 2
        ahead.kill()
        for ask in (lambda: m.query(POINT), lambda: m.nearest(POINT, radius_m=1), m.whole_grid):
            with pytest.raises(mrol.DeadlineExceeded) as late:
                ask()
            assert late.value.reason == "revision_not_reached"
        fill(mrol.connect(behind.address).map("m"), 5)
        assert m.query(POINT).version.revision == 2
        with pytest.raises(mrol.DeadlineExceeded):
            m.query(POINT, min_revision=3)
        assert m.query(POINT, min_revision=1).version.map_uuid == told.map_uuid


def test_a_map_that_was_made_again_starts_anew(tmp_path: Path) -> None:
    with two_of(tmp_path) as (ahead, behind):
        m = mrol.connect([ahead.address, behind.address]).map("m")
        former = m.query(POINT).version
        other = mrol.connect(ahead.address)
        other.delete_map("m")
        other.map("m", resolution=0.1)
        now = m.query(POINT).version
        assert (now.revision, now.map_uuid == former.map_uuid) == (0, False)
        with pytest.raises(mrol.FailedPrecondition) as replaced:
            m.query(POINT, map_uuid=former.map_uuid)
        assert replaced.value.reason == "map_replaced"


def test_a_watch_goes_on_elsewhere_without_a_step_back(tmp_path: Path) -> None:
    with two_of(tmp_path) as (ahead, behind):
        m = mrol.connect([ahead.address, behind.address]).map("m")
        events = m.watch()
        assert next(events).revision == 2
        ahead.kill()
        through = mrol.connect(behind.address).map("m")
        filling = Thread(target=lambda: (time.sleep(1), [fill(through, count) for count in (5, 7)]))
        filling.start()
        # The state may come again, but no older one.
        told = [2]
        while told[-1] < 3:
            told.append(next(events).revision)
        assert sorted(told) == told
        filling.join()


REDIRECT = b"307 Temporary Redirect"


def sent_on(location: str) -> bytes:
    return answer(
        b'{"code":"unavailable","reason":"map_elsewhere","detail":"there"}', b"location: " + location.encode(), status=REDIRECT
    )


Ask = Callable[[mrol.Client], object]


@pytest.mark.parametrize("ask", [lambda client: client.map("m").query(POINT), lambda client: client.map("m").snapshot("m.mrol")])
def test_a_request_is_sent_on_to_an_address_of_the_list(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, server: Server, client: mrol.Client, ask: Ask
) -> None:
    monkeypatch.chdir(tmp_path)
    client.map("m", resolution=0.1)
    with ScriptedServer(answering(sent_on(f"http://{server.address}/v1/elsewhere"))) as first:
        ask(mrol.connect([first.address, server.address], patience_s=0))
        assert first.requests == 2
    client.delete_map("m")


def test_a_change_without_an_id_is_sent_on_as_it_is(server: Server, client: mrol.Client) -> None:
    client.map("before", resolution=0.1)
    with ScriptedServer(answering(sent_on(f"http://{server.address}/"))) as first:
        mrol.connect([first.address, server.address], patience_s=0).rename_map("before", "after")
    client.delete_map("after")


@pytest.mark.parametrize(
    "where",
    [
        "{stranger}",
        "http://{stranger}/v1/maps",
        "//{stranger}/",
        "/v1/maps",
        "",
        "ftp://{first}/",
        "https://{other}/",
        "http://x@{other}/",
        "http://{other}.evil/",
        "http://evil\\@{other}/",
    ],
)
def test_a_request_is_not_sent_on_to_a_stranger(where: str) -> None:
    with (
        ScriptedServer(answering(answer(b'{"maps":[]}'))) as stranger,
        ScriptedServer(answering(answer(b'{"maps":[]}'))) as other,
        ScriptedServer(lambda sock, _: sock.sendall(sent_on(location))) as first,
    ):
        location = where.format(stranger=stranger.address, first=first.address, other=other.address)
        client = mrol.connect([first.address, other.address], key="mrol_secret_of_a_robot", patience_s=0)
        with pytest.raises(mrol.BadAnswer, match="none of this client's addresses: nothing was sent there"):
            client.maps()
        assert b"Bearer mrol_secret_of_a_robot" in first.head
        assert (first.requests, other.requests, stranger.requests) == (1, 0, 0)


def test_a_request_is_sent_on_to_the_one_of_those_that_are_named_that_is_known() -> None:
    with (
        ScriptedServer(answering(answer(b'{"maps":[]}'))) as stranger,
        ScriptedServer(answering(answer(b'{"maps":[]}'))) as other,
        ScriptedServer(lambda sock, _: sock.sendall(named)) as first,
    ):
        holders = [{"node": "n", "http": f"http://{at.address}", "grpc": ""} for at in (stranger, other)]
        problem = {"code": "unavailable", "reason": "map_elsewhere", "detail": "there", "elsewhere": [*holders, {"http": 1}]}
        named = answer(json.dumps(problem).encode(), f"location: http://{stranger.address}/v1/maps".encode(), status=REDIRECT)
        mrol.connect([first.address, other.address], patience_s=0).maps()
        assert (first.requests, other.requests, stranger.requests) == (1, 1, 0)


def test_a_request_is_sent_on_three_times_at_most() -> None:
    with (
        ScriptedServer(lambda sock, _: sock.sendall(sent_on(f"http://{second.address}"))) as first,
        ScriptedServer(lambda sock, _: sock.sendall(sent_on(f"http://{first.address}"))) as second,
    ):
        with pytest.raises(mrol.BadAnswer, match="more than 3 times"):
            mrol.connect([first.address, second.address]).maps()
        assert first.requests + second.requests == 4


def test_with_one_address_nothing_is_sent_on() -> None:
    with ScriptedServer(lambda sock, _: sock.sendall(sent_on(f"http://{only.address}"))) as only:
        with pytest.raises(mrol.ServerError, match="map_elsewhere"):
            mrol.connect(only.address).maps()
        assert only.requests == 1


def test_a_server_that_goes_down_is_left_at_once(server: Server) -> None:
    draining = b'{"code":"unavailable","reason":"draining","detail":"later"}'
    with ScriptedServer(answering(answer(draining, b"retry-after: 9", status=b"503 Not Now"))) as first:
        began = time.monotonic()
        client = mrol.connect([first.address, server.address])
        client.maps()
        client.maps()
        assert time.monotonic() - began < 2
        assert (first.requests, client.address) == (1, f"http://{server.address}")


def test_a_connection_that_the_server_closed_while_it_was_kept_is_made_anew_there(server: Server) -> None:
    with ScriptedServer(lambda sock, _: sock.sendall(answer(b'{"maps":[]}'))) as first:
        client = mrol.connect([first.address, server.address])
        for _ in range(50):
            client.maps()
        assert (first.requests, client.address) == (50, f"http://{first.address}")


def test_a_key_is_refused_by_each_server_as_by_one(tmp_path: Path) -> None:
    keys = tmp_path / "keys.toml"
    secret = run("key", "new", "--name", "k", "--scope", "admin", "--file", str(keys)).strip()
    with serving(tmp_path / "former", "--keys-file", str(keys)) as server, serving_again(tmp_path) as other:
        addresses = [server.address, other.address]
        assert mrol.connect(addresses, key=secret).maps().maps == ()
        with pytest.raises(mrol.Unauthenticated):
            mrol.connect(addresses, key="mrol_no_key_at_all").maps()


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("a,b:1", ["http://a:7333", "http://b:1"]),
        (" a , https://b ", ["http://a:7333", "https://b:7333"]),
        (["a", "unix:/x,y"], ["http://a:7333", "unix:/x,y"]),
        ("unix:/x,y", ["unix:/x,y"]),
        ("unix:/x,y, unix:/z,http://a", ["unix:/x,y", "unix:/z", "http://a:7333"]),
        ("a,a", ["http://a:7333"]),
    ],
)
def test_addresses_stand_in_a_list_or_behind_commas(given: "str | list[str]", expected: list[str]) -> None:
    from mrol._transport.address import Address  # noqa: PLC0415

    assert [str(address) for address in Address.parse_all(given)] == expected


@pytest.mark.parametrize("given", [[], "", "a,", ",a", ["a", 3], ["a", "b,c"], {"a"}, 3, "a b", "http://u:SECRET@h,a"])
def test_what_is_no_list_of_addresses_is_refused_without_being_shown(given: object) -> None:
    with pytest.raises(mrol.ArgumentError) as refused:
        mrol.connect(given)
    assert refused.value.argument == "address"
    assert "SECRET" not in str(refused.value)


def test_an_address_in_the_clear_is_refused_beside_files_of_tls(tmp_path: Path) -> None:
    with pytest.raises(mrol.ArgumentError) as refused:
        mrol.connect("https://a,http://b", ca=tmp_path / "ca.pem")
    assert refused.value.argument == "ca"
