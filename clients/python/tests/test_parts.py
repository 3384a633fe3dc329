"""Questions about more elements than the server takes at once, and about none."""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrol
from mrol.operations.backend import ServerBackend
from mrol.questions import group, parts

from .support.scenes import room
from .support.server import serving

BALL = [[0.0, 0.0, 0.0, 0.3]]
TWO_LINKS = mrol.Body([mrol.Link(spheres=BALL), mrol.Link(points=[[0, 0, 0]], padding_m=0.1)])
POINTS = np.random.default_rng(5).uniform([-4.2, -3.2, -1.7], [4.2, 3.2, 1.7], (60, 3)).astype(np.float32)
SPHERES = np.concatenate([POINTS, np.full((60, 1), 0.2, np.float32)], axis=1)
DIRECTIONS = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
SIZES = [1, 0, 5, 4, 20, 0, 0, 3, 2, 25]

QUESTIONS: dict[str, Callable[[mrol.Map], Any]] = {
    "points": lambda m: m.query(POINTS),
    "points of three axes": lambda m: m.query(POINTS.reshape(4, 15, 3), level=1),
    "classification": lambda m: m.classify(POINTS.reshape(30, 2, 3)),
    "nearest": lambda m: m.nearest(POINTS, 1.0),
    "rays from one origin": lambda m: m.cast_rays([0, 0, 0], DIRECTIONS),
    "rays from many": lambda m: m.cast_rays(POINTS[::-1], ends=POINTS),
    "poses": lambda m: m.check_poses(BALL, POINTS),
    "poses, what they meet": lambda m: m.check_poses(BALL, POINTS.reshape(2, 30, 3), answer="first_hit"),
    "poses of two links, their space": lambda m: m.check_poses(
        TWO_LINKS, np.stack([POINTS, POINTS[::-1]], axis=1), answer="clearance", clearance_max_m=1
    ),
    "spheres": lambda m: m.check_spheres(SPHERES, answer="first_hit"),
    "groups of spheres": lambda m: m.check_spheres(SPHERES, sizes=SIZES),
    "motions": lambda m: m.check_motions(BALL, POINTS.reshape(30, 2, 3), clearance_max_m=1.0),
    "motions of two links": lambda m: m.check_motions(TWO_LINKS, np.stack([POINTS, POINTS[::-1]], axis=1).reshape(20, 3, 2, 3)),
    "motions of many lengths": lambda m: m.check_motions(BALL, POINTS, lengths=[2, 3, 5, 10, 20, 15, 5]),
}


def arrays_of(answer: Any) -> dict[str, Any]:
    """All that an answer has but its versions."""
    found: dict[str, Any] = {}
    for of in fields(answer):
        value = getattr(answer, of.name)
        if is_dataclass(value) and not isinstance(value, mrol.Version):
            found |= {f"{of.name}.{name}": inner for name, inner in arrays_of(value).items()}
        elif of.name not in ("version", "version_of_first"):
            found[of.name] = value
    return found


@pytest.mark.parametrize("question", QUESTIONS)
def test_parts_are_joined_to_the_answer_of_the_whole(hall: mrol.Map, monkeypatch: pytest.MonkeyPatch, question: str) -> None:
    hall.keep_out("spill", box=[[-0.5, -1.5, -1], [0.5, -0.5, 1]])
    ask = QUESTIONS[question]
    whole = ask(hall)
    assert whole.first_version == whole.version
    asked: list[int] = []

    def spy(ask: Callable[..., Any], *others: Any) -> Any:
        def counted(part: slice, *options: Any) -> Any:
            asked.append(part.stop - part.start)
            return ask(part, *options)

        return parts.ask_in_parts(counted, *others)

    monkeypatch.setattr(group, "ask_in_parts", spy)
    monkeypatch.setattr(parts, "ELEMENTS_MAX", 7)
    joined = ask(hall)
    monkeypatch.undo()
    monkeypatch.setattr(parts, "BYTES_MAX", 100)
    by_bytes = ask(hall)
    assert len(asked) >= 1 if "lengths" in question else len(asked) > 1
    assert max(asked) <= 7
    expected = arrays_of(whole)
    for answer in (joined, by_bytes):
        assert answer.first_version == answer.version == whole.version
        found = arrays_of(answer)
        assert found.keys() == expected.keys()
        for name, value in expected.items():
            np.testing.assert_array_equal(found[name], value, err_msg=name)
            if isinstance(value, np.ndarray):
                assert (found[name].shape, found[name].dtype) == (value.shape, value.dtype), name


def test_five_million_points_are_asked_about(hall: mrol.Map) -> None:
    points = np.tile(room(seed=8)[:50_000], (100, 1))
    found = hall.query(points)
    expected = hall.query(points[:50_000]).occupied
    assert expected.any()
    assert not expected.all()
    assert found.occupied.shape == (5_000_000,)
    np.testing.assert_array_equal(found.occupied.reshape(100, -1), np.broadcast_to(expected, (100, 50_000)))
    assert found.count == 100 * np.count_nonzero(expected)
    nearest = hall.nearest(points[:2_500_000].reshape(50, -1, 3), 0.3)
    np.testing.assert_array_equal(nearest.distances_m, np.broadcast_to(nearest.distances_m[0], nearest.distances_m.shape))


def test_no_groups_and_no_motions_have_empty_answers(hall: mrol.Map) -> None:
    assert hall.check_spheres(np.zeros((0, 4)), sizes=[]).colliding.shape == (0,)
    assert hall.check_motions(BALL, np.zeros((0, 3)), lengths=[]).free.shape == (0,)


def test_a_refusal_says_from_where_its_elements_are_counted(hall: mrol.Map, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "ELEMENTS_MAX", 7)
    points = POINTS.copy()
    points[41] = np.nan
    with pytest.raises(mrol.InvalidArgument, match=r"points\[6\].*; counted from element 35"):
        hall.nearest(points, 1.0)


def test_a_server_that_takes_fewer_gets_fewer(tmp_path: Path) -> None:
    config = tmp_path / "config.toml"
    config.write_text("[limits]\npoints_per_request_max = 3000\n")
    with serving(tmp_path, "--config", str(config)) as server:
        m = mrol.connect(server.address).map("m", resolution=0.1)
        m.insert(POINTS, align=False)
        assert m.query(np.tile(POINTS, (400, 1))).occupied.all()
        assert m.classify(np.tile(POINTS, (400, 1))).occupied.all()
        body = mrol.Body([mrol.Link(spheres=np.tile(SPHERES, (300, 1)))])
        with pytest.raises(mrol.InvalidArgument, match="body_parts_max") as refused:
            m.check_poses(body, [[0, 0, 0]])
        assert refused.value.reason == "batch_too_large"


def test_what_takes_too_long_at_once_is_cut(tmp_path: Path) -> None:
    config = tmp_path / "config.toml"
    config.write_text("[limits]\nquestion_time_max_s = 0.02\n")
    with serving(tmp_path, "--config", str(config)) as server:
        m = mrol.connect(server.address).map("m", resolution=0.1)
        m.insert(room(), align=False)
        edges = np.tile(POINTS.reshape(30, 2, 3), (1000, 1, 1))
        free = m.check_motions(BALL, edges).free
        np.testing.assert_array_equal(free.reshape(1000, 30), np.broadcast_to(free[:30], (1000, 30)))
        assert not free.all()
        # What is too long by itself stays refused.
        with pytest.raises(mrol.DeadlineExceeded) as refused:
            m.check_motions(np.tile(SPHERES, (20, 1)), [[[0, 0, 50], [0, 60, 50]]] * 2, step_m=1e-3)
        assert refused.value.reason == "time_limit"


def between_parts(monkeypatch: pytest.MonkeyPatch, then: Callable[[], object]) -> None:
    """Does something once, after the first part of a query."""
    call, waiting = ServerBackend.query, [then]

    def interrupted(*arguments: Any) -> Any:
        answer = call(*arguments)
        if waiting:
            waiting.pop()()
        return answer

    monkeypatch.setattr(ServerBackend, "query", interrupted)
    monkeypatch.setattr(parts, "ELEMENTS_MAX", 40)


def test_a_change_between_parts_is_told(hall: mrol.Map, monkeypatch: pytest.MonkeyPatch) -> None:
    before = hall.describe().version
    between_parts(monkeypatch, lambda: hall.delete(box=[[3, -1, -1], [5, 1, 1]]))
    found = hall.query(POINTS)
    assert found.first_version == before
    assert found.revision == before.revision + 1


def test_a_map_that_is_replaced_between_parts_is_not_joined(
    client: mrol.Client, hall: mrol.Map, monkeypatch: pytest.MonkeyPatch
) -> None:
    def replace() -> None:
        client.delete_map(hall.name)
        client.map(hall.name, resolution=0.1)

    between_parts(monkeypatch, replace)
    with pytest.raises(mrol.FailedPrecondition) as replaced:
        hall.query(POINTS)
    assert replaced.value.reason == "map_replaced"


def test_all_parts_together_have_the_time_of_one_call(hall: mrol.Map, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "ELEMENTS_MAX", 1)
    with pytest.raises(mrol.TimedOut):
        hall.with_timeout(0.2).query(np.zeros((100_000, 3), np.float32))


NOTHING = np.zeros((0, 3))

EMPTY: dict[str, Callable[[mrol.Map], Any]] = {
    "points": lambda m: m.query(NOTHING),
    "a list of points": lambda m: m.query([]),
    "points of three axes": lambda m: m.query(np.zeros((4, 0, 3)), level=1, lookup="bloom", keep_out=True),
    "classification": lambda m: m.classify(NOTHING),
    "nearest": lambda m: m.nearest([], 1.0),
    "rays from one origin": lambda m: m.cast_rays([0, 0, 0], NOTHING),
    "rays from many": lambda m: m.cast_rays(NOTHING, ends=NOTHING),
    "poses": lambda m: m.check_poses(BALL, NOTHING, answer="first_hit"),
    "matrices": lambda m: m.check_poses(BALL, np.zeros((0, 4, 4)), answer="clearance", clearance_max_m=1),
    "a list of poses": lambda m: m.check_poses(BALL, []),
    "poses of two links": lambda m: m.check_poses(TWO_LINKS, np.zeros((0, 2, 7))),
    "a list of poses of two links": lambda m: m.check_poses(TWO_LINKS, []),
    "spheres": lambda m: m.check_spheres(np.zeros((0, 4)), answer="first_hit"),
    "groups of spheres": lambda m: m.check_spheres([], sizes=np.zeros(0, int)),
    "motions": lambda m: m.check_motions(BALL, np.zeros((0, 2, 7)), clearance_max_m=1.0),
    "motions of two links": lambda m: m.check_motions(TWO_LINKS, np.zeros((0, 2, 2, 3))),
    "a list of motions": lambda m: m.check_motions(BALL, []),
    "motions of many lengths": lambda m: m.check_motions(BALL, NOTHING, lengths=np.zeros(0, int)),
}


@pytest.mark.parametrize("question", EMPTY)
def test_nothing_is_answered_by_nothing(hall: mrol.Map, question: str) -> None:
    answer = EMPTY[question](hall)
    assert answer.version == answer.first_version == hall.describe().version
    for name, value in arrays_of(answer).items():
        if isinstance(value, np.ndarray):
            assert value.size == 0, name
            assert value.shape[0] == (4 if "three axes" in question else 0), name
        else:
            assert value in (0, None), name


def test_groups_of_no_sphere_meet_nothing(hall: mrol.Map) -> None:
    hall.insert([[0.05, 0.05, 0.05]], align=False, guess=np.eye(4), force=True)
    found = hall.check_spheres(np.zeros((0, 4)), sizes=[0, 0, 0], answer="first_hit")
    assert (found.colliding.tolist(), found.count) == ([False] * 3, 0)
    assert found.first_hits is not None
    assert found.first_hits.links.tolist() == [-1] * 3


def test_a_body_of_nothing_is_none(hall: mrol.Map) -> None:
    empty: list[Any] = [[], np.zeros(0)]
    for body in empty:
        with pytest.raises(mrol.ArgumentError, match=r"body\.links\[0\]\.spheres must be spheres"):
            hall.check_poses(body, [[0, 0, 0]])


def test_of_nothing_too_the_server_checks_the_rest(client: mrol.Client, hall: mrol.Map) -> None:
    with pytest.raises(mrol.InvalidArgument) as refused:
        hall.query([], level=20)
    assert refused.value.reason == "level_out_of_range"
    with pytest.raises(mrol.InvalidArgument):
        hall.nearest([], -1)
    client.map("gone", resolution=0.1)
    gone = client.map("gone")
    client.delete_map("gone")
    with pytest.raises(mrol.NotFound):
        gone.query([])
