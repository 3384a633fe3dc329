"""Servers that answer garbage, or hang: errors, in time and in bounded memory."""

import json
import resource
import struct
import time
from collections.abc import Callable
from pathlib import Path
from socket import socket
from threading import Event
from typing import Any

import numpy as np
import pytest

import mrol

from .support.scripted import Script, ScriptedServer, answer, answering

UUID = b"mrol-map-uuid: 6f0f4c9e-0000-4000-8000-000000000000"
VERSION = [b"mrol-revision: 1", UUID]

Call = Callable[[mrol.Map], object]


def query(m: mrol.Map) -> object:
    """A call whose answer is bytes and headers."""
    return m.query([[0, 0, 0]])


def describe(m: mrol.Map) -> object:
    """A call whose answer is JSON."""
    return m.describe()


def rays(m: mrol.Map) -> object:
    """A call whose answer is a head and arrays."""
    return m.cast_rays([0, 0, 0], [[1, 0, 0]])


def told(*names: str, **counts: int) -> dict[str, object]:
    """The head of an answer about five: bits, a byte for each name, and numbers of four bytes behind them."""
    places = {name: {"at": at, "bytes": 1} for at, name in enumerate(names)}
    return {"revision": 1, "map_uuid": "u", **counts, **places}


FIVE = np.zeros((5, 3), np.float32)


def five_points(m: mrol.Map) -> object:
    """A query of five points."""
    return m.query(FIVE)


def five_states(m: mrol.Map) -> object:
    """A classification of five points."""
    return m.classify(FIVE)


def five_poses(m: mrol.Map) -> object:
    """A check of five poses."""
    return m.check_poses([[0, 0, 0, 1]], FIVE)


def five_motions(m: mrol.Map) -> object:
    """A check of five motions."""
    return m.check_motions([[0, 0, 0, 1]], np.zeros((5, 2, 3)))


def watch(m: mrol.Map) -> object:
    """A call whose answer has no end."""
    return next(m.watch(silence_max_s=0.5))


def map_of(server: ScriptedServer, **options: Any) -> mrol.Map:
    """A map that nobody has asked the server for."""
    client = mrol.connect(server.address, **{"timeout_s": 2.0, "patience_s": 0.1, **options})
    return mrol.Map(client._caller, "m", "r", client._sessions)  # noqa: SLF001


CHUNKED = b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n"


def chunked(*chunks: bytes) -> bytes:
    """An answer in chunks."""
    return CHUNKED + b"".join(b"%x\r\n%s\r\n" % (len(chunk), chunk) for chunk in chunks) + b"0\r\n\r\n"


def headed(head: object, arrays: bytes = b"") -> bytes:
    """The answer to a question."""
    text = json.dumps(head).encode()
    return answer(struct.pack("<I", len(text)) + text + arrays)


RAYS = {"rays": 1, "hits": 0, "revision": 1, "map_uuid": "u", "hit": {"at": 0, "bytes": 1}, "distances_m": {"at": 1, "bytes": 4}}

MET: dict[str, object] = {
    **told("hit", rays=1, hits=1),
    "distances_m": {"at": 1, "bytes": 4},
    "voxels": {"at": 5, "bytes": 8},
}
MET_BY = b"\x01" + bytes(12)

FIELD = [*VERSION, b"mrol-level: 0", b"mrol-resolution-m: 1", b"mrol-cap: 4", b"mrol-origin: 0,0,0"]

STANDS = {"translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1]}
NUMBERS = ("overlap", "inliers", "fitness", "iterations", "align_ms", "new_voxels", "carved_voxels", "points_skipped")
ALIGNED = {
    **dict.fromkeys(NUMBERS, 0),
    **dict.fromkeys(("accepted", "replayed", "stationary"), False),
    "revision": 1,
    "map_uuid": "u",
    "verdict": "v",
    "reason": "r",
    "map_from_sensor": STANDS,
    "level_overlaps": [0],
    "undetermined": [],
    "rivals": [],
    "foreground": [-1],
}
MAPPED = {
    **dict.fromkeys(("overlap", "new_voxels", "carved_voxels"), 0),
    "robot": "r",
    "session": "s",
    "revision": 1,
    "map_from_sensor": {"translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 1, 1]},
}
TRAJECTORY = {"revision": 1, "map_uuid": "u", "poses": [MAPPED]}

GARBAGE: list[tuple[str, Call, bytes]] = [
    ("no HTTP", describe, b"hello, who is there?\r\n\r\n"),
    ("nothing but zeros", describe, bytes(100_000)),
    ("another protocol", describe, b"HTTP/9.9 200 OK\r\ncontent-length: 2\r\n\r\n{}"),
    ("no number as status", describe, b"HTTP/1.1 abc OK\r\ncontent-length: 2\r\n\r\n{}"),
    ("a status beyond all", describe, b"HTTP/1.1 99999 OK\r\ncontent-length: 2\r\n\r\n{}"),
    ("a redirect", describe, answer(b"", b"location: http://elsewhere/", status=b"302 Found")),
    ("an error of another kind", describe, answer(b"<html>proxy</html>", status=b"502 Bad Gateway")),
    ("an error that says nothing", describe, answer(b"{}", status=b"500 Oh")),
    ("a header line without an end", describe, b"HTTP/1.1 200 OK\r\nx: " + b"y" * 200_000),
    ("more headers than there are", describe, b"HTTP/1.1 200 OK\r\n" + b"x: y\r\n" * 10_000 + b"\r\n"),
    ("no length", describe, b"HTTP/1.1 200 OK\r\n\r\n{}"),
    ("a length below zero", describe, b"HTTP/1.1 200 OK\r\ncontent-length: -5\r\n\r\n{}"),
    ("a length that is none", describe, b"HTTP/1.1 200 OK\r\ncontent-length: many\r\n\r\n{}"),
    ("two lengths", describe, b"HTTP/1.1 200 OK\r\ncontent-length: 2\r\ncontent-length: 3\r\n\r\n{}"),
    ("a length and chunks", describe, b"HTTP/1.1 200 OK\r\ncontent-length: 2\r\ntransfer-encoding: chunked\r\n\r\n2\r\n{}"),
    ("a coding that is not known", describe, b"HTTP/1.1 200 OK\r\ntransfer-encoding: gzip\r\n\r\n{}"),
    ("a header that is none", describe, b"HTTP/1.1 200 OK\r\nx\r\ncontent-length: 2\r\n\r\n{}"),
    ("a length beyond memory", describe, b"HTTP/1.1 200 OK\r\ncontent-length: 99999999999999\r\n\r\n{}"),
    ("a length with too many digits", describe, b"HTTP/1.1 200 OK\r\ncontent-length: " + b"9" * 5000 + b"\r\n\r\n{}"),
    ("a chunk below zero", describe, b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n-9\r\n{}\r\n"),
    ("no JSON", describe, answer(b"{")),
    ("JSON of another kind", describe, answer(b"[1, 2]")),
    ("JSON without fields", describe, answer(b"{}")),
    ("JSON that is deeper than the stack", describe, answer(b'{"a":' + b"[" * 200_000)),
    ("numbers beyond all bounds", describe, answer(b'{"revision":' + b"1" * 20_000 + b"}")),
    ("no UTF-8", describe, answer(b'{"revision":"\xff\xfe"}')),
    ("a query without headers", query, answer(b"\0")),
    ("a query of other points", query, answer(b"\0", b"mrol-points: 2", b"mrol-points-occupied: 0", *VERSION)),
    ("a bitmap that is too short", query, answer(b"", b"mrol-points: 1", b"mrol-points-occupied: 0", *VERSION)),
    ("a bitmap that is too long", query, answer(b"\0\0", b"mrol-points: 1", b"mrol-points-occupied: 0", *VERSION)),
    ("a count that is none", query, answer(b"\0", b"mrol-points: 1", b"mrol-points-occupied: x", *VERSION)),
    ("a hash that is none", query, answer(b"\0", b"mrol-points: 1", b"mrol-points-occupied: 0", *VERSION, b"mrol-content-hash: z")),
    ("bits behind the last point", five_points, answer(b"\x21", b"mrol-points: 5", b"mrol-points-occupied: 1", *VERSION)),
    ("fewer bits than told", five_points, answer(b"\x01", b"mrol-points: 5", b"mrol-points-occupied: 2", *VERSION)),
    ("more bits than told", five_points, answer(b"\x07", b"mrol-points: 5", b"mrol-points-occupied: 2", *VERSION)),
    ("as many bits as a byte has", five_points, answer(b"\x01", b"mrol-points: 8", b"mrol-points-occupied: 1", *VERSION)),
    ("states of more points", five_states, headed(told("occupied", "free", points=6), b"\0\0")),
    ("states behind the last point", five_states, headed(told("occupied", "free", points=5), b"\0\x20")),
    ("other poses than told", five_poses, headed(told("colliding", checked=5, colliding_count=2), b"\x01")),
    ("poses behind the last", five_poses, headed(told("colliding", checked=5, colliding_count=1), b"\x20")),
    (
        "other motions than told",
        five_motions,
        headed({**told("free", motions=5, free_count=0), "first_hits": {"at": 1, "bytes": 20}}, b"\x01" + bytes(20)),
    ),
    ("a name that is not there", rays, headed({**MET, "keep_outs": {"at": 13, "bytes": 4, "names": ["k"]}}, MET_BY + b"\1\0\0\0")),
    ("other hits than told", rays, headed({**MET, "hits": 0}, MET_BY)),
    ("a size below zero", lambda m: m.distances([[0, 0, 0], [1, 1, 1]]), answer(bytes(4), *FIELD, b"mrol-size: -1,2,2")),
    ("a foreground of no point", lambda m: m.align([[0, 0, 0]], foreground_level=0), answer(json.dumps(ALIGNED).encode())),
    ("a pose that is none", lambda m: m.trajectory(), answer(json.dumps(TRAJECTORY).encode())),
    ("an empty head", rays, answer(b"")),
    ("a head that is too long", rays, answer(struct.pack("<I", 1 << 31) + b"{}")),
    ("no arrays", rays, headed({"rays": 1})),
    ("another number of rays", rays, headed({**RAYS, "rays": 2})),
    ("arrays beyond the end", rays, headed({**RAYS, "hit": {"at": 9, "bytes": 1}}, bytes(9))),
    ("arrays before the beginning", rays, headed({**RAYS, "hit": {"at": -1, "bytes": 1}}, bytes(9))),
    ("arrays of no bytes", rays, headed({**RAYS, "hit": {"at": 0, "bytes": -1}}, bytes(9))),
    ("arrays that are lists", rays, headed({**RAYS, "hit": [1]}, bytes(9))),
    ("a message that is none", watch, chunked(struct.pack("<I", 3) + b"\xff\xff\xff")),
    ("a message that is too long", watch, chunked(struct.pack("<I", 0xFFFF_FFFF))),
    ("blocks that are none", watch, chunked(struct.pack("<I", 8) + bytes([0x1A, 6, 0x10, 1, 0x42, 2, 0, 0]))),
    ("a listing without voxels", lambda m: m.voxels(), answer(b'{"voxels_total":0}')),
    ("a listing of other voxels", lambda m: m.voxels(), answer(b'{"voxels_total":2,"voxels":[[1,2,3]]}')),
    ("a listing of no numbers", lambda m: m.voxels(), answer(b'{"voxels_total":1,"voxels":[[1,x,3]]}')),
    ("a block of half a record", lambda m: m.block(), answer(bytes(71), *VERSION, b"mrol-level: 0", b"mrol-resolution-m: 1")),
]


@pytest.mark.parametrize(("call", "data"), [case[1:] for case in GARBAGE], ids=[case[0] for case in GARBAGE])
@pytest.mark.filterwarnings("ignore:string or file could not be read:DeprecationWarning")
def test_garbage_is_told_as_such(call: Call, data: bytes) -> None:
    with ScriptedServer(answering(data)) as server, pytest.raises(mrol.BadAnswer):
        call(map_of(server))


def test_these_answers_would_be_taken_if_they_fit() -> None:
    for call, data in (
        (five_points, answer(b"\x11", b"mrol-points: 5", b"mrol-points-occupied: 2", *VERSION)),
        (five_states, headed(told("occupied", "free", points=5), b"\1\x10")),
        (five_poses, headed(told("colliding", checked=5, colliding_count=2), b"\x11")),
        (rays, headed({**MET, "keep_outs": {"at": 13, "bytes": 4, "names": ["k"]}}, MET_BY + bytes(4))),
        (rays, headed(MET, MET_BY)),
        (lambda m: m.distances([[0, 0, 0], [1, 1, 1]]), answer(bytes(4), *FIELD, b"mrol-size: 1,2,2")),
        (lambda m: m.align([[0, 0, 0]], foreground_level=0), answer(json.dumps({**ALIGNED, "foreground": [0]}).encode())),
        (lambda m: m.trajectory(), answer(json.dumps({**TRAJECTORY, "poses": [{**MAPPED, "map_from_sensor": STANDS}]}).encode())),
    ):
        with ScriptedServer(answering(data)) as server:
            assert call(map_of(server)) is not None


CUT = answer(b'{"map":"m","revision":', status=b"200 OK").replace(b"content-length: 22", b"content-length: 900")


@pytest.mark.parametrize(
    ("call", "data"),
    [
        (describe, b""),
        (describe, b"HTTP/1.1 200"),
        (describe, b"HTTP/1.1 200 OK\r\ncontent-le"),
        (describe, CUT),
        (describe, chunked(b"{" * 100)[:-30]),
        # Cut at the end of the last chunk's size, and between the last two ends of lines.
        (describe, chunked(b"{}")[:-4]),
        (describe, chunked(b"{}")[:-2]),
        (query, answer(b"\0", *VERSION)[:-1]),
        (watch, chunked(struct.pack("<I", 100) + b"abc")[:-10]),
        (watch, chunked(b"")),
    ],
)
def test_an_answer_that_breaks_off_is_a_lost_connection(call: Call, data: bytes) -> None:
    with ScriptedServer(answering(data)) as server:
        with pytest.raises((mrol.ConnectionLost, mrol.BadAnswer)) as lost:
            call(map_of(server))
        # What breaks off among the headers may also be read as an answer without a length.
        if b"\r\n\r\n" in data or not data:
            assert isinstance(lost.value, mrol.ConnectionLost)
            # It changes nothing, so it was tried again.
            assert server.requests > 1


def drip(data: bytes) -> Script:
    """Sends a byte now and then, for ever: no single read is late."""

    def script(sock: socket, over: Event) -> None:
        sock.sendall(data)
        while not over.wait(0.05):
            sock.sendall(b"x")

    return script


def flood(data: bytes, piece: bytes) -> Script:
    """Sends as much as is taken."""

    def script(sock: socket, over: Event) -> None:
        sock.sendall(data)
        while not over.is_set():
            sock.sendall(piece)

    return script


HANGS: dict[str, Script] = {
    "says nothing": lambda _, over: over.wait(60) and None,
    "drips a status": drip(b"HTTP/1.1 "),
    "drips a header": drip(b"HTTP/1.1 200 OK\r\nx: "),
    "drips a body": drip(b"HTTP/1.1 200 OK\r\ncontent-length: 100000\r\n\r\n"),
    "drips a chunk": drip(b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\nfffff\r\n"),
    "says that it goes on": flood(b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
}


@pytest.mark.parametrize("name", HANGS)
def test_a_server_that_hangs_is_left_when_the_time_is_up(name: str) -> None:
    with ScriptedServer(HANGS[name]) as server:
        m = map_of(server, timeout_s=0.4)
        for call in (describe, query, watch):
            began = time.monotonic()
            with pytest.raises((mrol.TimedOut, mrol.BadAnswer)):
                call(m)
            assert time.monotonic() - began < 10
        with pytest.raises((mrol.TimedOut, mrol.BadAnswer)):
            m.insert([[0, 0, 0]])


def test_an_endless_answer_is_left_when_it_is_too_large() -> None:
    endless = {
        "body": flood(b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n", b"10000\r\n" + bytes(65536) + b"\r\n"),
        "chunk": flood(b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\nffffffffff\r\n", bytes(65536)),
        "trailer": flood(b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n0\r\n", b"x: y\r\n" * 10_000),
        "error": flood(b"HTTP/1.1 500 Oh\r\ntransfer-encoding: chunked\r\n\r\n", b"10000\r\n" + bytes(65536) + b"\r\n"),
    }
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for script in endless.values():
        with ScriptedServer(script) as server:
            m = map_of(server, answer_bytes_max=4_000_000, timeout_s=20)
            with pytest.raises(mrol.BadAnswer):
                describe(m)
    # Kilobytes: some times what an answer may have.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 40_000


def test_a_server_that_does_not_read_is_left_when_the_time_is_up() -> None:
    listening = ScriptedServer(lambda _, over: over.wait(60) and None)
    with listening as server:
        m = map_of(server, timeout_s=0.5)
        listening._request = lambda client: b"GET /livez" if False else _hold(client)  # type: ignore[method-assign] # noqa: SLF001
        with pytest.raises(mrol.TimedOut):
            m.query(np.zeros((20_000_000, 3), np.float32))


def _hold(client: socket) -> bytes | None:
    """Reads a little of a request, and no more."""
    client.recv(1)
    time.sleep(3)
    return None


def test_what_nobody_asked_for_is_not_taken_as_the_next_answer() -> None:
    two = answer(b'{"maps":[]}') + answer(b'{"maps":[{"map":"planted"}]}')
    answers = iter([two, answer(b'{"maps":[]}')])

    def script(sock: socket, over: Event) -> None:
        sock.sendall(next(answers))
        over.wait(2)

    with ScriptedServer(script) as server:
        client = mrol.connect(server.address)
        assert client.maps().maps == ()
        assert client.maps().maps == ()


NO_SIZES = [b"-1", b"+2", b"0x2", b"0_2", b" 2", b"", b"zz", b"0" * 16, b"2;" + b"x" * 5000]


@pytest.mark.parametrize("size", NO_SIZES, ids=lambda size: repr(size[:10]))
def test_a_chunk_whose_size_is_none_ends_the_answer(size: bytes, tmp_path: Path) -> None:
    calls: list[Call] = [describe, watch, lambda m: m.snapshot(tmp_path / "a.mrol"), lambda m: next(m.watch_events())]
    with ScriptedServer(answering(CHUNKED + size + b"\r\n{}\r\n0\r\n\r\n")) as server:
        for call in calls:
            with pytest.raises(mrol.BadAnswer, match="between chunks|whose size"):
                call(map_of(server))
    assert not list(tmp_path.iterdir())


def test_chunks_end_where_they_say() -> None:
    with (
        ScriptedServer(answering(CHUNKED + b"2\r\n{}XX0\r\n\r\n")) as server,
        pytest.raises(mrol.BadAnswer, match="behind its end"),
    ):
        describe(map_of(server))
    whole = CHUNKED + b'000c;by=proxy\r\n{"maps":[]}\n\r\n0\r\nx: y\r\n\r\n'
    with ScriptedServer(answering(whole)) as server:
        assert mrol.connect(server.address).maps().maps == ()


def test_a_chunk_below_zero_takes_no_memory(tmp_path: Path) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for call in (describe, watch, lambda m: m.snapshot(tmp_path / "a.mrol")):
        with ScriptedServer(flood(CHUNKED + b"-1\r\n", bytes(1 << 20))) as server, pytest.raises(mrol.BadAnswer):
            call(map_of(server, answer_bytes_max=1_000_000, timeout_s=1.0))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 40_000


def test_what_is_said_before_an_answer_is_passed_over() -> None:
    maps = answer(b'{"maps":[]}')
    early = b"HTTP/1.1 103 Early Hints\r\nlink: x\r\n\r\nHTTP/1.1 102 Processing\r\n\r\n"
    with ScriptedServer(answering(early + maps)) as server:
        assert mrol.connect(server.address).maps().maps == ()
    with ScriptedServer(answering(b"HTTP/1.1 101 Switching Protocols\r\n\r\n" + maps)) as server, pytest.raises(mrol.BadAnswer):
        mrol.connect(server.address).maps()


@pytest.mark.parametrize("page", [b"<html>hello</html>", b"\xff\xfe", b"7", b"[" * 200_000])
def test_the_page_of_a_web_server_is_no_health(page: bytes) -> None:
    with ScriptedServer(answering(answer(page))) as server, pytest.raises(mrol.BadAnswer):
        mrol.connect(server.address).health()


def test_a_map_file_without_a_byte_replaces_none(tmp_path: Path) -> None:
    file = tmp_path / "map.mrol"
    file.write_bytes(b"GOOD")
    for data in (answer(b"", *VERSION), chunked().replace(b"\r\n\r\n", b"\r\n" + b"\r\n".join(VERSION) + b"\r\n\r\n", 1)):
        with ScriptedServer(answering(data)) as server, pytest.raises(mrol.BadAnswer, match="no map file"):
            map_of(server).snapshot(file)
    assert file.read_bytes() == b"GOOD"


def test_a_file_whose_length_nobody_told_replaces_none(tmp_path: Path) -> None:
    file = tmp_path / "map.mrol"
    file.write_bytes(b"GOOD")
    headers = b"HTTP/1.0 200 OK\r\nmrol-revision: 1\r\nmrol-map-uuid: 0ddf1407-a74f-4727-a1c6-6c3ad8c953ba\r\n\r\n"
    with ScriptedServer(answering(headers + b"HALF")) as server, pytest.raises(mrol.BadAnswer):
        map_of(server).snapshot(file)
    assert file.read_bytes() == b"GOOD"
