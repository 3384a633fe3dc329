"""Scans: inserted, aligned, localized, undone; trajectories."""

import numpy as np
import pytest

import mrol

from .support.scenes import room
from .support.server import scan_ids


def test_a_scan_is_aligned_to_the_map(hall: mrol.Map) -> None:
    truth = (0.4, -0.3, 0.1)
    answer = hall.insert(room(truth, seed=3), guess=mrol.Pose.of([0.5, -0.2, 0.05, 0, 0, 0, 1]), robot="r1")
    assert answer.accepted, answer.reason
    assert answer.verdict == "accepted"
    np.testing.assert_allclose(answer.map_from_sensor.translation_m, truth, atol=0.03)
    assert answer.information is not None
    assert answer.information.shape == (6, 6)
    assert len(answer.level_overlaps) == 4
    assert answer.version == hall.query([[0, 0, 0]]).version
    assert (answer.robot, answer.scan_id, answer.replayed) == ("r1", 1, False)


def test_a_scan_that_does_not_fit_is_an_answer(hall: mrol.Map) -> None:
    before = hall.describe().version
    elsewhere = np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    answer = hall.insert(elsewhere, guess=np.eye(4))
    assert not answer.accepted
    assert answer.verdict != "accepted"
    assert answer.reason
    assert hall.describe().version == before


def test_alignment_changes_nothing_and_tells_what_is_new(hall: mrol.Map) -> None:
    before = hall.describe().version
    scan = np.concatenate([room(seed=4), np.full((50, 3), 0.5, np.float32)]).reshape(-1, 2, 3)
    answer = hall.align(scan, guess=np.eye(4), foreground_level=1)
    assert answer.accepted, answer.reason
    assert answer.foreground is not None
    assert answer.foreground.shape == scan.shape[:-1]
    assert answer.foreground.reshape(-1)[-50:].all()
    assert hall.describe().version == before
    assert hall.align(scan, guess=np.eye(4)).foreground is None


def test_every_option_of_a_scan_reaches_the_server(hall: mrol.Map) -> None:
    points = room((0.1, 0, 0), seed=5)
    answer = hall.insert(
        points,
        guess=(np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])),
        timestamp_ns=1_700_000_000_000_000_000,
        point_times=np.linspace(-0.05, 0.05, len(points)),
        point_times_from_sweep_start=False,
        gravity_in_sensor=[0, 0, -9.81],
        guess_covariance=np.eye(6) * 0.01,
        recover=False,
        carve=False,
        force=True,
        method="overlap",
        range_min_m=0.2,
        range_max_m=20,
        body_m=[[-0.3, -0.3, -0.3], [0.3, 0.3, 0.3]],
        sensor="spinning 2 4 -10 10",
        strict=True,
    )
    assert answer.accepted
    assert 'sensor model "spinning 2 4 -10 10" is not used' in answer.reason
    scan = hall.trajectory().scans[-1]
    assert scan.timestamp_ns == 1_700_000_000_000_000_000
    moved = hall.align(room((0.3, 0, 0), seed=6), motion=[0.2, 0, 0, 0, 0, 0, 1])
    np.testing.assert_allclose(moved.map_from_sensor.translation_m, [0.3, 0, 0], atol=0.05)
    assert hall.align(room((0.3, 0, 0), seed=6), constant_velocity=True).accepted


def test_points_that_are_not_finite_are_no_returns(empty: mrol.Map) -> None:
    answer = empty.insert([[1, 0, 0], [np.nan, 0, 0], [0, np.inf, 0]], align=False)
    assert (answer.points_skipped, answer.new_voxels) == (2, 1)
    with pytest.raises(mrol.InvalidArgument) as refused:
        empty.insert([[1, 0, 0], [np.nan, 0, 0]], strict=True, align=False)
    assert refused.value.reason == "point_not_finite"


def test_ids_ascend_robot_by_robot_and_the_same_id_is_the_same_scan(empty: mrol.Map) -> None:
    scans = [empty.insert([[x, 0, 0]], align=False, guess=np.eye(4), force=True) for x in (1, 2, 3)]
    assert [scan.scan_id for scan in scans] == [1, 2, 3]
    assert empty.insert([[1, 0, 0]], align=False, guess=np.eye(4), force=True, robot="other").scan_id == 1
    again = empty.insert([[2, 0, 0]], align=False, guess=np.eye(4), force=True, scan_id=2)
    assert again.replayed
    assert again.revision == scans[1].revision
    with pytest.raises(mrol.Conflict) as taken:
        empty.insert([[9, 0, 0]], align=False, guess=np.eye(4), scan_id=2)
    assert taken.value.reason == "scan_id_taken"
    assert empty.insert([[4, 0, 0]], align=False, guess=np.eye(4), scan_id=10, force=True).scan_id == 10
    assert empty.insert([[5, 0, 0]], align=False, guess=np.eye(4), force=True).scan_id == 11
    own = empty.insert([[6, 0, 0]], align=False, guess=np.eye(4), session="run-7", scan_id=0, force=True)
    assert (own.session, own.scan_id) == ("run-7", 0)
    assert len(set(scan_ids(empty))) == len(scan_ids(empty)) - 1  # the other robot has the same session


def test_a_robot_that_is_lost_is_localized(hall: mrol.Map) -> None:
    truth = (-1.0, 0.5, 0.0)
    found = hall.with_timeout(60).localize(room(truth, seed=7), gravity_in_sensor=[0, 0, -1], candidates=3)
    # The room looks nearly the same from the other side, so it may be told as ambiguous.
    assert found.exhaustive
    assert 1 <= len(found.candidates) <= 3
    best = found.candidates[0]
    assert found.map_from_sensor is (best.map_from_sensor if found.accepted else None)
    np.testing.assert_allclose(best.map_from_sensor.translation_m, truth, atol=0.2)
    assert best.rays is not None
    assert best.rays.of_scan.share > 0.9
    assert best.rays.of_map.evidence > 0.05
    assert bool(found.rivals) == (found.verdict == "ambiguous")
    boxed = hall.localize(room(truth, seed=7), search_box=[[-2, 0, -1], [0, 1, 1]], gravity_in_sensor=[0, 0, -1], time_limit_s=5)
    np.testing.assert_allclose(boxed.candidates[0].map_from_sensor.translation_m, truth, atol=0.2)


def test_a_place_that_is_as_likely_is_told_as_a_rival(empty: mrol.Map) -> None:
    # A room of a floor, four walls and nothing in it looks the same after half a turn.
    along = np.linspace(-1, 1, 81)
    x, y, z = (side.reshape(-1) for side in np.meshgrid(along * 4, along * 3, along))
    walls = np.stack([x, y, z], 1)[(np.abs(x) == 4) | (np.abs(y) == 3) | (z == -1)].astype(np.float32)
    empty.insert(walls, align=False)
    moved = np.array([0.6, -0.4, 0], np.float32)
    found = empty.with_timeout(60).localize(walls - moved, gravity_in_sensor=[0, 0, -1], candidates=1, time_limit_s=30)
    assert found.verdict == "ambiguous", found.reason
    assert found.map_from_sensor is None
    assert len(found.candidates) == 1
    places = [found.candidates[0].map_from_sensor.translation_m, *(rival.map_from_sensor.translation_m for rival in found.rivals)]
    for expected in (moved, -moved):
        assert any(np.allclose(place[:2], expected[:2], atol=0.1) for place in places), places
    assert all(rival.rays.of_scan.share > 0.9 for rival in found.rivals)


def test_a_trajectory_has_the_poses_in_pages_or_at_once(empty: mrol.Map) -> None:
    for x in range(5):
        empty.insert([[x, 0, 1]], align=False, guess=[x, 0, 0, 0, 0, 0, 1], robot=f"r{x % 2}")
    all_of_it = empty.trajectory()
    np.testing.assert_allclose(all_of_it.positions_m[:, 0], range(5))
    assert all_of_it.matrices.shape == (5, 4, 4)
    assert len(empty.trajectory(robot="r1")) == 2
    page = empty.trajectory(limit=2)
    assert len(page) == 2
    assert page.next_since_revision is not None
    rest = empty.trajectory(since_revision=page.next_since_revision)
    np.testing.assert_allclose(rest.positions_m[:, 0], [2, 3, 4])
    with pytest.raises(mrol.InvalidArgument) as refused:
        empty.trajectory(limit=0)
    assert refused.value.reason == "page_too_large"


def test_a_scan_is_undone_by_its_answer_and_by_its_names(empty: mrol.Map) -> None:
    first = empty.insert([[1, 0, 0]], align=False)
    second = empty.insert([[2, 0, 0]], align=False, guess=np.eye(4))
    third = empty.insert([[3, 0, 0]], align=False, guess=np.eye(4))
    undone = empty.undo(second)
    assert (undone.scans, undone.removed, undone.deletions, undone.restored) == (1, 1, 0, 0)
    assert empty.query([[1, 0, 0], [2, 0, 0], [3, 0, 0]]).occupied.tolist() == [True, False, True]
    assert empty.undo(robot=third.robot, since_revision=third.revision - 1).scans == 1
    assert empty.undo(robot=first.robot, session=first.session, scan_id=first.scan_id).removed == 1
    with pytest.raises(mrol.NotFound) as gone:
        empty.undo(first)
    assert gone.value.reason == "scan_not_found"
    with pytest.raises(mrol.FailedPrecondition) as withdrawn:
        empty.insert([[1, 0, 0]], align=False, scan_id=first.scan_id)
    assert withdrawn.value.reason == "scan_withdrawn"


def test_an_undo_under_the_same_id_is_done_once(empty: mrol.Map) -> None:
    empty.insert([[1, 0, 0]], align=False)
    undone = empty.undo(revision=1, request_id="u1")
    again = empty.undo(revision=1, request_id="u1")
    assert again.replayed
    assert again.revision == undone.revision


def test_after_the_last_id_there_is_an_error_that_says_what_to_do(client: mrol.Client, empty: mrol.Map) -> None:
    last = (1 << 64) - 1
    with pytest.raises(mrol.ArgumentError, match="points"):
        # What is refused here uses no id up.
        empty.insert("no points", scan_id=last)
    assert empty.insert([[1, 0, 0]], align=False).scan_id == 1
    assert empty.insert([[2, 0, 0]], align=False, guess=np.eye(4), force=True, scan_id=last).accepted
    for _ in range(2):
        with pytest.raises(mrol.ArgumentError, match=r"scan_id must be given with a session of your own") as refused:
            empty.insert([[3, 0, 0]], align=False, guess=np.eye(4), force=True)
        assert refused.value.argument == "scan_id"
    # What was sent under its id is known by it, and what the error says helps.
    assert empty.insert([[2, 0, 0]], align=False, guess=np.eye(4), force=True, scan_id=last).replayed
    own = {"session": "second", "scan_id": 1}
    assert empty.insert([[3, 0, 0]], align=False, guess=np.eye(4), force=True, **own).scan_id == 1
    anew = mrol.connect(client.address).map(empty.name)
    assert anew.insert([[4, 0, 0]], align=False, guess=np.eye(4), force=True).scan_id == 1
    # Other robots go on.
    assert empty.insert([[5, 0, 0]], align=False, guess=np.eye(4), force=True, robot="other").scan_id == 1
    assert len(empty.trajectory()) == 5


def test_points_in_millimeters_are_told_in_the_reason_of_a_refused_scan(hall: mrol.Map) -> None:
    refused = hall.insert(room() * 1000, guess=np.eye(4))
    assert not refused.accepted
    assert "are they in millimeters?" in refused.reason
    assert "millimeters" not in hall.insert(room((0.2, 0, 0), seed=3), guess=np.eye(4)).reason
