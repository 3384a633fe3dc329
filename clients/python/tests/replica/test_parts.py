"""Questions about more elements than are taken at once, and about none."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import mrol
import mrol.replica
from mrol.questions import parts
from mrol.replica.backend import NativeBackend

from ..support.scenes import room
from ..support.server import serving

BALL = [[0.0, 0.0, 0.0, 0.3]]
TWO_LINKS = mrol.Body([mrol.Link(spheres=BALL), mrol.Link(points=[[0, 0, 0]], padding_m=0.1)])
POINTS = np.random.default_rng(5).uniform([-4.2, -3.2, -1.7], [4.2, 3.2, 1.7], (60, 3)).astype(np.float32)
SPHERES = np.concatenate([POINTS, np.full((60, 1), 0.2, np.float32)], axis=1)
DIRECTIONS = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
SIZES = [1, 0, 5, 4, 20, 0, 0, 3, 2, 25]
PAIRS = np.stack([POINTS, POINTS[::-1]], axis=1)

Questions = Any
"""A replica, a map without a server, or a map of a server."""

QUESTIONS: dict[str, Callable[[Questions], Any]] = {
    "points": lambda m: m.query(POINTS.reshape(4, 15, 3), level=1),
    "classification": lambda m: m.classify(POINTS),
    "nearest": lambda m: m.nearest(POINTS.reshape(30, 2, 3), 1.0),
    "rays from one origin": lambda m: m.cast_rays([0, 0, 0], DIRECTIONS),
    "rays from many": lambda m: m.cast_rays(POINTS[::-1], ends=POINTS),
    "poses": lambda m: m.check_poses(BALL, POINTS, answer="first_hit"),
    "poses of two links": lambda m: m.check_poses(TWO_LINKS, PAIRS, answer="clearance", clearance_max_m=1),
    "groups of spheres": lambda m: m.check_spheres(SPHERES, sizes=SIZES, answer="first_hit"),
    "motions": lambda m: m.check_motions(BALL, POINTS.reshape(30, 2, 3), clearance_max_m=1.0),
    "motions of two links": lambda m: m.check_motions(TWO_LINKS, PAIRS.reshape(20, 3, 2, 3)),
    "motions of many lengths": lambda m: m.check_motions(BALL, POINTS, lengths=[2, 3, 5, 10, 20, 15, 5]),
}

NOTHING = np.zeros((0, 3))

EMPTY: dict[str, Callable[[Questions], Any]] = {
    "points": lambda m: m.query([]),
    "points of three axes": lambda m: m.query(np.zeros((0, 4, 3))),
    "classification": lambda m: m.classify(NOTHING),
    "nearest": lambda m: m.nearest([], 1.0),
    "rays": lambda m: m.cast_rays([0, 0, 0], []),
    "poses": lambda m: m.check_poses(BALL, [], answer="first_hit"),
    "poses of two links": lambda m: m.check_poses(TWO_LINKS, np.zeros((0, 2, 7)), answer="clearance", clearance_max_m=1),
    "spheres": lambda m: m.check_spheres([]),
    "groups of spheres": lambda m: m.check_spheres([], sizes=np.zeros(0, int)),
    "motions": lambda m: m.check_motions(BALL, [], clearance_max_m=1.0),
    "motions of two links": lambda m: m.check_motions(TWO_LINKS, np.zeros((0, 2, 2, 3))),
}


@pytest.fixture(scope="module", params=["a replica", "a map without a server"])
def asked(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Questions]:
    """A map of the room, in this process."""
    if request.param != "a replica":
        with mrol.replica.LocalMap(resolution=0.1) as local:
            local.insert(room(), align=False)
            yield local
        return
    with serving(tmp_path_factory.mktemp("server")) as server:
        mrol.connect(server.address).map("room", resolution=0.1).insert(room(), align=False)
        with mrol.replica.Replica(server.grpc, "room") as replica:
            yield replica


def flat(answer: Any) -> dict[str, Any]:
    """The arrays and numbers of an answer."""
    found: dict[str, Any] = {}
    for name, value in vars(answer).items():
        if isinstance(value, mrol.FirstHits | mrol.Clearances):
            found |= {f"{name}.{of}": inner for of, inner in vars(value).items()}
        elif name not in ("version", "version_of_first"):
            found[name] = value
    return found


@pytest.mark.parametrize("question", QUESTIONS)
def test_parts_are_joined_to_the_answer_of_the_whole(asked: Questions, monkeypatch: pytest.MonkeyPatch, question: str) -> None:
    whole = QUESTIONS[question](asked)
    monkeypatch.setattr(parts, "ELEMENTS_MAX", 7)
    monkeypatch.setattr(parts, "BYTES_MAX", 200)
    joined = QUESTIONS[question](asked)
    assert joined.version == joined.first_version == whole.version
    found, expected = flat(joined), flat(whole)
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)
        assert np.shape(found[name]) == np.shape(value), name


@pytest.mark.parametrize("question", EMPTY)
def test_nothing_is_answered_by_nothing(asked: Questions, question: str) -> None:
    answer = EMPTY[question](asked)
    assert answer.version == asked.query(POINTS).version
    for name, value in flat(answer).items():
        if isinstance(value, np.ndarray):
            assert value.shape[0] == 0, name
        else:
            assert value in (0, None), name


def test_millions_are_asked_about(asked: Questions) -> None:
    points = np.tile(POINTS, (50_000, 1))
    expected = asked.query(POINTS)
    found = asked.query(points)
    assert found.count == 50_000 * expected.count
    np.testing.assert_array_equal(found.occupied.reshape(-1, 60), np.broadcast_to(expected.occupied, (50_000, 60)))
    assert asked.check_motions(BALL, np.zeros((1_100_000, 2, 3), np.float32)).free.all()


def test_groups_of_no_sphere_meet_nothing(asked: Questions) -> None:
    found = asked.check_spheres(np.zeros((0, 4)), sizes=[0, 0, 0], answer="first_hit")
    assert (found.colliding.tolist(), found.count) == ([False] * 3, 0)


def test_a_map_that_is_replaced_between_parts_is_not_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    maps = [mrol.replica.LocalMap(resolution=0.1) for _ in range(3)]
    for m in maps:
        m.insert(POINTS, align=False)
    asked, others = maps[0], maps[1:]

    class Changing(NativeBackend):
        """Answers of one map, then of another one."""

        def query(self, *arguments: Any) -> Any:
            return others.pop()._backend.query(*arguments)  # noqa: SLF001

    monkeypatch.setattr(parts, "ELEMENTS_MAX", 40)
    monkeypatch.setattr(asked, "_backend", Changing(asked._native))  # noqa: SLF001
    with pytest.raises(mrol.FailedPrecondition) as replaced:
        asked.query(POINTS)
    assert replaced.value.reason == "map_replaced"
