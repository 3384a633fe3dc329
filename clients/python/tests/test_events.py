"""What became of the scans that robots sent."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import mrol

from .support.scenes import room
from .support.scripted import ScriptedServer, answer, answering
from .support.server import serving
from .test_hostile_servers import map_of


def test_every_scan_leaves_an_event(hall: mrol.Map) -> None:
    hall.insert(room((0.2, 0, 0), seed=3), guess=np.eye(4), robot="r1")
    refused = hall.insert(np.random.default_rng(1).uniform(-1, 1, (2000, 3)), guess=np.eye(4), robot="r2")
    with pytest.raises(mrol.FailedPrecondition):
        hall.insert(room(), robot="unheard-of")
    first, second, third = hall.events()
    assert (first.robot, first.accepted, first.error) == ("r1", True, None)
    assert first.answer is not None
    assert first.answer.overlap > 0.5
    assert first.guess is not None
    assert (second.robot, second.accepted, second.scan_id, second.session) == ("r2", False, refused.scan_id, refused.session)
    assert second.answer is not None
    assert second.answer.reason == refused.reason
    assert 200 < len(second.sample) <= 300
    assert third.answer is None
    assert third.error is not None
    assert third.error.reason == "guess_required"
    assert first.number < second.number < third.number
    assert [event.number for event in hall.events(robot="r2")] == [second.number]
    assert [event.number for event in hall.events(since_number=second.number)] == [third.number]


def test_events_are_told_as_they_come_through_a_restart(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        m = mrol.connect(server.address).map("a", resolution=0.1, levels=2)
        told: list[int | None] = []
        three = threading.Event()

        def listen(events: Iterator[mrol.ScanEvent]) -> None:
            for event in events:
                told.append(event.scan_id)
                if len(told) == 3:
                    three.set()
                    return

        m.insert([[1, 0, 0]], align=False)
        thread = threading.Thread(target=listen, args=(m.watch_events(),))
        thread.start()
        m.insert([[2, 0, 0]], align=False, guess=np.eye(4), force=True)
        while len(told) < 2:
            time.sleep(0.01)
        server.kill()
        server.start()
        m.insert([[3, 0, 0]], align=False, guess=np.eye(4), force=True)
        assert three.wait(20)
        thread.join()
        assert told == [1, 2, 3]


def test_a_deleted_map_ends_the_stream(client: mrol.Client, empty: mrol.Map) -> None:
    events = empty.watch_events()
    empty.insert([[1, 0, 0]], align=False)
    assert next(events).robot
    client.delete_map(empty.name)
    with pytest.raises(mrol.NotFound, match="map_not_found"):
        next(events)


def test_what_cannot_be_asked(empty: mrol.Map) -> None:
    with pytest.raises(mrol.ArgumentError, match="since_number"):
        empty.events(since_number=-1)
    with pytest.raises(mrol.ArgumentError, match="silence_max_s"):
        empty.watch_events(silence_max_s=-1)


@pytest.mark.parametrize("said", [b"{}\n{", b"nonsense\n", b'{"number": "x"}\n', b"x" * 3000])
def test_a_stream_of_nonsense_is_told(said: bytes) -> None:
    with ScriptedServer(answering(answer(said))) as server:
        m = map_of(server, answer_bytes_max=2000)
        with pytest.raises((mrol.BadAnswer, mrol.TransportError)):
            next(m.watch_events())
