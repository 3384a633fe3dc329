"""A map without a server is the map that a server would have."""

import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrol
import mrol.replica

from ..support.scenes import room
from ..support.server import Server

START = mrol.Pose.identity()


@pytest.fixture(scope="session")
def mapped() -> mrol.replica.LocalMap:
    """The room, seen from two places."""
    m = mrol.replica.LocalMap(resolution=0.1, levels=4)
    assert m.insert(room(), guess=START).accepted
    assert m.insert(room((0.4, 0.2, 0), seed=2), guess=mrol.Pose.of([0.3, 0.1, 0, 0, 0, 0, 1])).accepted
    return m


def test_it_is_what_a_server_makes_of_the_same_scans(server: Server, mapped: mrol.replica.LocalMap) -> None:
    m = mrol.connect(server.address).map("same", resolution=0.1, levels=4)
    m.insert(room(), guess=START)
    theirs = m.insert(room((0.4, 0.2, 0), seed=2), guess=mrol.Pose.of([0.3, 0.1, 0, 0, 0, 0, 1]))
    ours = mapped.query([[0, 0, 0]]).version
    assert ours.content_hash == theirs.version.content_hash
    assert ours.revision == theirs.revision


def test_a_scan_is_aligned_and_tells_all(mapped: mrol.replica.LocalMap) -> None:
    truth = (0.5, -0.3, 0.1)
    before = mapped.query([[0, 0, 0]]).version
    scan = np.concatenate([room(truth, seed=4), np.full((50, 3), 0.5, np.float32)]).reshape(-1, 2, 3)
    answer = mapped.align(scan, guess=mrol.Pose.of([0.6, -0.2, 0.05, 0, 0, 0, 1]), foreground_level=1)
    assert answer.accepted, answer.reason
    np.testing.assert_allclose(answer.map_from_sensor.translation_m, truth, atol=0.03)
    assert answer.information is not None
    assert answer.information.shape == (6, 6)
    assert answer.foreground is not None
    assert answer.foreground.shape == scan.shape[:-1]
    assert answer.foreground.reshape(-1)[-50:].all()
    assert 0.9 < answer.overlap == answer.level_overlaps[0]
    assert answer.version == before == mapped.query([[0, 0, 0]]).version


def test_a_scan_that_does_not_fit_is_an_answer(mapped: mrol.replica.LocalMap) -> None:
    before = mapped.query([[0, 0, 0]]).version
    answer = mapped.insert(np.random.default_rng(1).uniform(-1, 1, (2000, 3)), guess=np.eye(4), robot="lost")
    assert not answer.accepted
    assert answer.verdict != "accepted"
    assert answer.reason
    assert mapped.query([[0, 0, 0]]).version == before


def test_it_finds_where_a_scan_was_taken(mapped: mrol.replica.LocalMap) -> None:
    truth = (-0.6, 0.5, 0.0)
    # The room is nearly the same from its other side.
    half = [[-4, -3, -1.5], [0, 3, 1.5]]
    found = mapped.localize(room(truth, seed=5), gravity_in_sensor=[0, 0, -1], search_box=half, time_limit_s=30)
    assert found.accepted, found.reason
    assert found.map_from_sensor is not None
    np.testing.assert_allclose(found.map_from_sensor.translation_m, truth, atol=0.05)
    best = found.candidates[0].rays
    assert best is not None
    assert best.of_scan.share > 0.9
    anywhere = mapped.localize(room(truth, seed=5), gravity_in_sensor=[0, 0, -1], time_limit_s=30)
    assert bool(anywhere.rivals) == (anywhere.verdict == "ambiguous")


def test_files_go_to_a_server_and_back(server: Server, mapped: mrol.replica.LocalMap, tmp_path: Path) -> None:
    file = tmp_path / "room.mrol"
    mapped.save(file)
    mapped.save(file)
    assert [path.name for path in tmp_path.iterdir()] == ["room.mrol"]
    client = mrol.connect(server.address)
    restored = client.restore("restored", file)
    assert restored.describe().version.content_hash == mapped.query([[0, 0, 0]]).version.content_hash
    loaded = mrol.replica.LocalMap.load(file)
    np.testing.assert_array_equal(np.sort(loaded.voxels().indices, axis=0), np.sort(mapped.voxels().indices, axis=0))
    # What was known of the robot goes on.
    assert loaded.insert(room((0.4, 0.2, 0), seed=6)).accepted


def test_voxels_and_deletions(tmp_path: Path) -> None:
    m = mrol.replica.LocalMap(resolution=0.5, levels=2, bloom=False, moments=False)
    m.insert([[0.1, 0.1, 0.1], [3.1, 0.1, 0.1], [6.1, 0.1, 0.1]], align=False)
    np.testing.assert_allclose(sorted(m.voxels().centers_m[:, 0]), [0.25, 3.25, 6.25])
    assert len(m.voxels(level=1, box=[[0, 0, 0], [4, 1, 1]])) == 2
    assert m.delete(mrol.Sphere([3.2, 0.2, 0.2], 0.4)).removed == 1
    assert m.query([[0.1, 0.1, 0.1], [3.1, 0.1, 0.1]]).occupied.tolist() == [True, False]
    with pytest.raises(mrol.InvalidArgument, match="level_out_of_range"):
        m.voxels(level=2)


def test_what_makes_no_map() -> None:
    for resolution in (0, -1, 1e9):
        with pytest.raises(mrol.InvalidArgument, match="resolution_m"):
            mrol.replica.LocalMap(resolution)
    with pytest.raises(mrol.ArgumentError, match="resolution"):
        mrol.replica.LocalMap(float("nan"))
    with pytest.raises(mrol.InvalidArgument, match="levels"):
        mrol.replica.LocalMap(0.1, levels=0)


def test_a_file_is_replaced_as_a_server_s_is(tmp_path: Path, mapped: mrol.replica.LocalMap) -> None:
    file, link = tmp_path / "a.mrol", tmp_path / "link.mrol"
    file.write_bytes(b"what was there")
    file.chmod(0o640)
    link.symlink_to("a.mrol")
    mapped.save(link)
    assert link.is_symlink()
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    former = os.umask(0o022)
    try:
        mapped.save(tmp_path / "new.mrol")
    finally:
        os.umask(former)
    assert stat.S_IMODE((tmp_path / "new.mrol").stat().st_mode) == 0o644
    assert (tmp_path / "new.mrol").read_bytes()[:4] == file.read_bytes()[:4]
    for no_file in (5, True, tmp_path, b"a.mrol", ""):
        with pytest.raises(mrol.ArgumentError, match="file must be"):
            mapped.save(no_file)  # type: ignore[arg-type]
    with (tmp_path / "new.mrol").open("rb") as opened:
        with pytest.raises(mrol.ArgumentError, match="file must be a path"):
            mrol.replica.LocalMap.load(opened.fileno())  # type: ignore[arg-type]
        assert opened.read(1)


def test_what_makes_no_file(tmp_path: Path, mapped: mrol.replica.LocalMap) -> None:
    file = tmp_path / "a.mrol"
    mapped.save(file)
    whole = file.read_bytes()
    for damaged in (b"", whole[: len(whole) // 2], whole[:-40] + bytes(40), b"x" * 1000):
        file.write_bytes(damaged)
        with pytest.raises(mrol.InvalidArgument, match="bad_map_file"):
            mrol.replica.LocalMap.load(file)
    with pytest.raises(FileNotFoundError):
        mapped.save(tmp_path / "nowhere" / "a.mrol")


def test_what_has_no_end_is_no_file(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    link = tmp_path / "link"
    link.symlink_to("/dev/zero")
    with ThreadPoolExecutor(1) as one:
        try:
            for endless in (pipe, link, "/dev/zero", "/dev/full", "/dev/null"):
                loading = one.submit(mrol.replica.LocalMap.load, endless)
                with pytest.raises(OSError, match="it is no regular file"):
                    loading.result(timeout=30)
        finally:
            # Lets go whoever waits for it.
            os.close(os.open(pipe, os.O_RDWR))
    with pytest.raises(IsADirectoryError):
        mrol.replica.LocalMap.load(tmp_path)


def test_guesses_exclude_each_other(mapped: mrol.replica.LocalMap) -> None:
    with pytest.raises(mrol.ArgumentError, match="several of guess"):
        mapped.align(room(), guess=START, motion=START)
    with pytest.raises(mrol.FailedPrecondition, match="guess_required"):
        mapped.insert(room(), robot="unheard-of")


def test_arguments_of_scans_are_named(mapped: mrol.replica.LocalMap) -> None:
    for name, value in [("robot", None), ("align", "no"), ("carve", 1), ("method", "best"), ("timestamp_ns", 1 << 70)]:
        given: dict[str, Any] = {name: value}
        with pytest.raises(mrol.ArgumentError, match=name):
            mapped.insert(room(), **given)
