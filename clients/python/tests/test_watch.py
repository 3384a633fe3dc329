"""Watches: every kind of change, levels and boxes, and what ends them."""

import dataclasses
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import mrol

from .support.server import serving


def following(m: mrol.Map, events: Iterator[mrol.WatchEvent]) -> mrol.WatchedChange:
    """The next change."""
    event = next(events)
    assert isinstance(event, mrol.WatchedChange), m
    return event


def test_a_watch_tells_the_state_and_then_each_change(empty: mrol.Map) -> None:
    empty.keep_out("k", prism=mrol.Prism([[0, 0], [1, 0], [0, 1]], 0, 1))
    empty.insert([[1, 0, 0]], align=False)
    told: list[int] = []
    events = empty.watch(viewpoints=True, progress=lambda done, _: told.append(done))
    state = next(events)
    assert isinstance(state, mrol.WatchedState)
    assert told
    assert state.version == empty.describe().version
    assert (state.resolution_m, state.levels, state.level) == (0.1, 4, 0)
    assert state.indices().tolist() == empty.voxels().indices.tolist()
    assert [of.name for of in state.keep_outs] == ["k"]

    scan = empty.insert([[2, 0, 0]], align=False, guess=[0, 0, 1, 0, 0, 0, 1], timestamp_ns=-7, robot="r2")
    change = following(empty, events)
    assert change.version == scan.version
    assert isinstance(change.cause, mrol.WatchedScan)
    cause = change.cause
    assert (cause.robot, cause.session, cause.scan_id, cause.timestamp_ns) == ("r2", scan.session, scan.scan_id, -7)
    np.testing.assert_allclose(cause.map_from_sensor.translation_m, [0, 0, 1])
    assert change.added().tolist() == [[20, 0, 10]]
    assert change.removed().size == 0

    deletion = empty.delete([[1, 0, 0]])
    change = following(empty, events)
    assert isinstance(change.cause, mrol.WatchedDeletion)
    assert change.removed().tolist() == [[10, 0, 0]]

    empty.undo(deletion)
    change = following(empty, events)
    assert change.cause == mrol.WatchedUndo((), (deletion.revision,))
    assert change.added().tolist() == [[10, 0, 0]]

    empty.keep_out("l", oriented_box=mrol.OrientedBox([1, 0, 0, 0, 0, 0, 1], [1, 1, 1]))
    change = following(empty, events)
    assert isinstance(change.cause, mrol.WatchedKeepOut)
    assert change.cause.put is not None
    assert isinstance(change.cause.put.shape, mrol.OrientedBox)
    empty.remove_keep_out("l")
    cause_of_removal = following(empty, events).cause
    assert isinstance(cause_of_removal, mrol.WatchedKeepOut)
    assert (cause_of_removal.name, cause_of_removal.put) == ("l", None)
    assert following.__name__
    events.close()


def test_a_watch_goes_on_from_a_version(empty: mrol.Map) -> None:
    first = empty.insert([[1, 0, 0]], align=False)
    second = empty.insert([[2, 0, 0]], align=False, guess=np.eye(4))
    event = next(empty.watch(since=first))
    assert isinstance(event, mrol.WatchedChange)
    assert event.revision == second.revision
    assert event.map_uuid == second.map_uuid
    beyond = mrol.Version(first.revision, "00000000-0000-0000-0000-000000000001")
    assert isinstance(next(empty.watch(since=beyond)), mrol.WatchedState)
    # With another content hash it is what was lost when an older data folder was put back.
    assert first.version.content_hash is not None
    lost = dataclasses.replace(first.version, content_hash=first.version.content_hash ^ 1)
    assert isinstance(next(empty.watch(since=lost)), mrol.WatchedState)
    with pytest.raises(mrol.ArgumentError, match="since.content_hash"):
        empty.watch(since=dataclasses.replace(first.version, content_hash=-1))
    with pytest.raises(mrol.ArgumentError, match="since.state_hash"):
        empty.watch(since=dataclasses.replace(first.version, state_hash=1 << 64))


def test_a_watch_that_comes_back_has_the_keep_outs_after_an_older_data_folder_was_put_back(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        m = mrol.connect(server.address).map("m", resolution=0.1)
        m.insert([[1, 0, 0]], align=False)
        server.stop()
        shutil.copytree(tmp_path / "data", tmp_path / "cold")
        server.start()
        states, since = m.watch(), m.watch(since=m.describe(), heartbeats=True)
        next(states)
        next(since)
        m.keep_out("lost", sphere=([0, 0, 0], 1))
        for events in (states, since):
            following(m, events)
        server.stop()
        shutil.rmtree(tmp_path / "data")
        shutil.copytree(tmp_path / "cold", tmp_path / "data")
        server.start()
        m.keep_out("spill", sphere=([3, 0, 0], 1))
        m.keep_out("dock", sphere=([0, 3, 0], 1))
        for events in (states, since):
            told = next(events)
            assert isinstance(told, mrol.WatchedState)
            assert [of.name for of in told.keep_outs] == ["dock", "spill"]


def test_a_version_of_an_answer_gets_its_state_hash_from_the_first_heartbeat(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        m = mrol.connect(server.address).map("m", resolution=0.1)
        m.insert([[1, 0, 0]], align=False)
        server.stop()
        shutil.copytree(tmp_path / "data", tmp_path / "cold")
        server.start()
        m.keep_out("lost", sphere=([0, 0, 0], 1))
        # A watch tells of what is durable: once it does, so does another.
        next(m.watch())
        events = m.watch(since=m.describe(), heartbeats=True)
        assert isinstance(next(events), mrol.Heartbeat)
        server.stop()
        shutil.rmtree(tmp_path / "data")
        shutil.copytree(tmp_path / "cold", tmp_path / "data")
        server.start()
        m.keep_out("spill", sphere=([3, 0, 0], 1))
        told = next(event for event in events if not isinstance(event, mrol.Heartbeat))
        assert isinstance(told, mrol.WatchedState)
        assert [of.name for of in told.keep_outs] == ["spill"]


def test_a_watch_of_a_level_and_a_box_tells_those_alone(empty: mrol.Map) -> None:
    empty.insert([[1.05, 0.05, 0.05], [7.05, 0.05, 0.05]], align=False)
    state = next(empty.watch(delta_level=1, box=[[0, -1, -1], [2, 1, 1]]))
    assert isinstance(state, mrol.WatchedState)
    assert (state.level, state.indices().tolist()) == (1, [[5, 0, 0]])


def test_a_copy_by_a_watch_is_equal_to_the_map(hall: mrol.Map) -> None:
    events = hall.watch()
    state = next(events)
    assert isinstance(state, mrol.WatchedState)
    copy = {tuple(index) for index in state.indices().tolist()}
    deletion = hall.delete(box=[[3, -9, -9], [9, 9, 9]])
    hall.insert([[0.5, 0.5, 0.5]], guess=np.eye(4), align=False)
    last = hall.undo(deletion)
    while state.revision < last.revision:
        state = following(hall, events)
        copy -= {tuple(index) for index in state.removed().tolist()}
        copy |= {tuple(index) for index in state.added().tolist()}
    assert copy == {tuple(index) for index in hall.voxels().indices.tolist()}


def test_a_watch_ends_when_its_map_is_deleted(client: mrol.Client) -> None:
    m = client.map("watched", resolution=0.1)
    events = m.watch()
    next(events)
    client.delete_map("watched")
    with pytest.raises(mrol.NotFound) as gone:
        next(events)
    assert gone.value.reason == "map_not_found"
    with pytest.raises(mrol.NotFound):
        next(m.watch())


def test_a_watch_goes_on_with_a_map_that_takes_the_place(client: mrol.Client, empty: mrol.Map, tmp_path: Path) -> None:
    empty.insert([[1, 0, 0]], align=False)
    empty.snapshot(tmp_path / "a.mrol")
    empty.insert([[2, 0, 0]], align=False, guess=np.eye(4), force=True)
    events, answers = empty.watch(), empty.watch_events()
    before = next(events)
    assert before.revision == 2
    assert [next(answers).scan_id for _ in range(2)] == [1, 2]
    replaced = empty.restore(tmp_path / "a.mrol")
    state = next(events)
    assert isinstance(state, mrol.WatchedState)
    assert state.version == replaced.version
    assert state.map_uuid != before.map_uuid
    assert state.indices().tolist() == [[10, 0, 0]]
    empty.insert([[3, 0, 0]], align=False, guess=np.eye(4), force=True)
    assert following(empty, events).added().tolist() == [[30, 0, 0]]
    assert next(answers).scan_id == 3
    client.delete_map(f"{empty.name}-replaced-2")


def test_arguments_of_a_watch_are_refused_at_once(empty: mrol.Map) -> None:
    with pytest.raises(mrol.ArgumentError, match="silence_max_s must be a number of seconds"):
        empty.watch(silence_max_s=0)
    with pytest.raises(mrol.ArgumentError, match="viewpoints must be True or False"):
        empty.watch(viewpoints=1)
