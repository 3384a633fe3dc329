"""Arrays and other arguments: converted, or refused with a word that says which, what and what belongs there."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mrol
from mrol._transport.caller import Caller
from mrol._transport.request import Request

from .support.odd import Malicious

POINTS = np.random.default_rng(1).uniform(-5, 5, (1000, 3)).astype("<f4")


ODD: dict[str, Callable[[], Any]] = {
    "Fortran order": lambda: np.asfortranarray(POINTS),
    "float64": lambda: POINTS.astype("<f8"),
    "big-endian": lambda: POINTS.astype(">f4"),
    "float128": lambda: POINTS.astype(np.longdouble),
    "a list": lambda: POINTS.tolist(),
    "read-only": lambda: np.frombuffer(POINTS.tobytes(), "<f4").reshape(-1, 3),
    "negative strides": lambda: POINTS[::-1][::-1],
    "every other row of more": lambda: np.repeat(POINTS, 2, axis=0)[::2],
    "columns of more": lambda: np.hstack([POINTS, POINTS])[:, :3],
    "negative strides along an axis": lambda: np.ascontiguousarray(POINTS[:, ::-1])[:, ::-1],
    "not aligned": lambda: np.frombuffer(b"x" + POINTS.tobytes(), "<f4", offset=1).reshape(-1, 3),
    "a matrix": lambda: np.asmatrix(POINTS),
    "three axes": lambda: POINTS.reshape(10, 100, 3),
    "a masked array without masks": lambda: np.ma.array(POINTS),
    "a list of masked arrays without masks": lambda: [np.ma.array(point) for point in POINTS],
    "records": lambda: np.rec.fromarrays([POINTS[:, 2], POINTS[:, 1], POINTS[:, 0]], names="z,y,x"),
    "a memoryview": lambda: memoryview(POINTS),
    "a subclass": lambda: POINTS.view(type("Mine", (np.ndarray,), {})),
}


@pytest.mark.parametrize("name", ODD)
@pytest.mark.filterwarnings("ignore:the matrix subclass:PendingDeprecationWarning")
def test_arrays_of_every_layout_mean_their_numbers(empty: mrol.Map, name: str) -> None:
    empty.insert(POINTS[::2], align=False)
    expected = empty.query(POINTS).occupied
    assert expected.any()
    assert empty.query(ODD[name]()).occupied.reshape(-1).tolist() == expected.tolist()


@pytest.mark.parametrize("kind", ["f2", "i1", "u1", "i4", "u8", "i8"])
def test_numbers_of_every_kind_are_converted(empty: mrol.Map, kind: str) -> None:
    whole = np.array([[1, 2, 3], [4, 5, 6]])
    empty.insert(whole[:1] + 0.05, align=False)
    assert empty.query(whole.astype(kind), map_from_points=[0.05, 0.05, 0.05, 0, 0, 0, 1]).occupied.tolist() == [True, False]


def test_contiguous_float32_is_not_copied(hall: mrol.Map, monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[int] = []
    call = Caller.call

    def spy(caller: Caller, request: Request, *others: Any) -> Any:
        assert isinstance(request.body, list)
        sent.extend(np.frombuffer(piece, np.uint8).__array_interface__["data"][0] for piece in request.body)
        return call(caller, request, *others)

    monkeypatch.setattr(Caller, "call", spy)
    hall.query(POINTS)
    hall.query(POINTS.reshape(10, 100, 3))
    assert sent == [POINTS.__array_interface__["data"][0]] * 2


REFUSED: dict[str, Callable[[], Any]] = {
    "shape (3, 2)": lambda: np.zeros((3, 2)),
    "shape (2,)": lambda: [1, 2],
    "shape ()": lambda: 7.0,
    "complex128": lambda: np.zeros((1, 3), complex),
    "bool": lambda: np.zeros((1, 3), bool),
    "object": lambda: np.array([[None, 1, 2]]),
    "<U1": lambda: [["a", "b", "c"]],
    "datetime64": lambda: np.zeros((1, 3), "M8[s]"),
    "|V3": lambda: np.zeros(3, "V3"),
    "masked values": lambda: np.ma.array(POINTS, mask=POINTS > 0),
    "with masked values": lambda: [np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0])],
    "array with masked values": lambda: ([[1, 2, 3]], [np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0])]),
    "an array with masked values": lambda: np.ma.array(
        [(1, 2, 3)], mask=[(0, 1, 0)], dtype=[("x", "f4"), ("y", "f4"), ("z", "f4")]
    ),
    "list": lambda: [[1, 2, 3], [1, 2]],
    "no array today": Malicious,
    "1e+39": lambda: np.array([[0, 1e39, 0]]),
    "bytes of float32": lambda: np.broadcast_to(np.float32(0), (10**9, 3)),
    "an array of object": lambda: None,
    "[('x'": lambda: np.zeros(3, [("x", "U3"), ("y", "f4"), ("z", "f4")]),
}


@pytest.mark.parametrize("word", REFUSED)
def test_what_is_no_array_of_points_is_refused_with_a_word(hall: mrol.Map, word: str) -> None:
    bad = REFUSED[word]()
    for call in (hall.query, hall.insert, hall.classify, hall.align, hall.localize, hall.delete):
        if bad is None and call == hall.delete:
            continue
        with pytest.raises(mrol.ArgumentError) as refused:
            call(bad)
        error = refused.value
        assert error.argument == "points"
        assert error.expected
        assert word in error.value
        assert isinstance(error, ValueError)
    with pytest.raises(mrol.ArgumentError, match="points must be"):
        hall.nearest(bad, 1.0)


def test_what_the_server_refuses_of_points_is_told_by_it(hall: mrol.Map) -> None:
    for points, reason in (
        ([[0, 0, 0], [np.nan, 0, 0]], "point_not_finite"),
        ([[0, 0, np.inf]], "point_not_finite"),
        ([[1e9, 0, 0]], "point_out_of_range"),
    ):
        with pytest.raises(mrol.InvalidArgument) as refused:
            hall.query(points)
        assert refused.value.reason == reason
        assert refused.value.message
    assert hall.query([[0, 0, 0]]).count == 0


EYE = np.eye(4)


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("level", lambda m: m.query(POINTS, level=-1)),
        ("level", lambda m: m.query(POINTS, level=1.5)),
        ("level", lambda m: m.query(POINTS, level=True)),
        ("keep_out", lambda m: m.query(POINTS, keep_out=1)),
        ("lookup", lambda m: m.query(POINTS, lookup=7)),
        ("min_revision", lambda m: m.query(POINTS, min_revision=-1)),
        ("map_from_points", lambda m: m.query(POINTS, map_from_points=np.zeros((4, 4)))),
        ("map_from_points", lambda m: m.query(POINTS, map_from_points=[0, 0, 0, 0, 0, 0, 2])),
        ("guess", lambda m: m.insert(POINTS, guess=EYE * [1, 1, 1, np.nan])),
        ("guess", lambda m: m.insert(POINTS, guess=-EYE)),
        ("guess", lambda m: m.insert(POINTS, guess=([0, 0, 0], [0, 0, 1]))),
        ("guess", lambda m: m.insert(POINTS, guess=EYE, motion=EYE)),
        ("align", lambda m: m.insert(POINTS, align="no")),
        ("robot", lambda m: m.insert(POINTS, robot="")),
        ("scan_id", lambda m: m.insert(POINTS, scan_id=-1)),
        ("session", lambda m: m.insert(POINTS, session="s")),
        ("timestamp_ns", lambda m: m.insert(POINTS, timestamp_ns=1.5)),
        ("point_times", lambda m: m.insert(POINTS, point_times=[0.0])),
        ("guess_covariance", lambda m: m.insert(POINTS, guess_covariance=np.eye(3))),
        ("gravity_in_sensor", lambda m: m.insert(POINTS, gravity_in_sensor=[0, 0])),
        ("range_min_m", lambda m: m.insert(POINTS, range_min_m=np.nan)),
        ("body_m", lambda m: m.insert(POINTS, body_m=[1, 2, 3])),
        ("sensor", lambda m: m.insert(POINTS, sensor=64)),
        ("gravity_in_map", lambda m: m.localize(POINTS, gravity_in_map=[0, 0, 1])),
        ("candidates", lambda m: m.localize(POINTS, candidates=0)),
        ("body.links[0].spheres", lambda m: m.check_poses([[1, 2, 3]], EYE)),
        ("body.links[0]", lambda m: m.check_poses(mrol.Body(["arm"]), EYE)),
        ("configurations", lambda m: m.check_poses([[0, 0, 0, 1]], np.zeros((2, 5)))),
        ("configurations", lambda m: m.check_poses([[0, 0, 0, 1]], np.zeros((2, 4, 4)))),
        ("ignored[0]", lambda m: m.check_poses([[0, 0, 0, 1]], EYE, ignored=["wall"])),
        ("ignored[0].radius_m", lambda m: m.check_poses([[0, 0, 0, 1]], EYE, ignored=[mrol.Sphere([0, 0, 0], np.inf)])),
        ("clearance_max_m", lambda m: m.check_poses([[0, 0, 0, 1]], EYE, clearance_max_m="1")),
        ("configurations", lambda m: m.check_motions([[0, 0, 0, 1]], mrol.Pose.identity())),
        ("lengths", lambda m: m.check_motions([[0, 0, 0, 1]], np.zeros((2, 3)), lengths=[2.0])),
        ("sizes", lambda m: m.check_spheres(np.zeros((2, 4)), sizes=[-1, 3])),
        ("origins", lambda m: m.cast_rays(np.zeros((2, 3)), np.zeros((3, 3)))),
        ("radius_m", lambda m: m.nearest(POINTS, None)),
        ("box", lambda m: m.frontiers([0, 0, 0])),
        ("area", lambda m: m.grid([[0, 0, 0], [1, 1, 1]])),
        ("band_from", lambda m: m.grid(band_from="roof")),
        ("box.size_m", lambda m: m.voxels(box=mrol.OrientedBox(EYE, [1, 2]))),
        ("view.fov_rad", lambda m: m.voxels(view=mrol.View(EYE, [1], [1, 2]))),
        ("point", lambda m: m.observers()),
        ("limit", lambda m: m.trajectory(limit=-1)),
        ("sphere", lambda m: m.delete(sphere=7)),
        ("request_id", lambda m: m.delete(POINTS, request_id="")),
        ("change", lambda m: m.undo("it")),
        ("change", lambda m: m.undo(m.delete(POINTS), revision=1)),
        ("the shape", lambda m: m.keep_out("k")),
        ("prism", lambda m: m.keep_out("k", prism="wall")),
        ("prism.corners_m", lambda m: m.keep_out("k", prism=mrol.Prism([1, 2], 0, 1))),
        ("name", lambda m: m.keep_out("..", sphere=([0, 0, 0], 1))),
        ("expires_at", lambda m: m.keep_out("k", sphere=([0, 0, 0], 1), expires_at="noon")),
        ("progress", lambda m: m.snapshot("/tmp/never", progress="yes")),
        ("timeout_s", lambda m: m.with_timeout(0)),
        ("timeout_s", lambda m: m.with_timeout(np.nan)),
    ],
)
def test_arguments_that_cannot_be_sent_are_named(hall: mrol.Map, argument: str, call: Callable[[mrol.Map], Any]) -> None:
    before = hall.describe().voxels.tolist()
    with pytest.raises(mrol.ArgumentError) as refused:
        call(hall)
    assert refused.value.argument == argument
    assert str(refused.value).startswith(f"{argument} must be ")
    if argument != "change":
        assert hall.describe().voxels.tolist() == before


MASKED = np.ma.array([0.0, 0.0, 0.0], mask=[1, 0, 0])


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("configurations", lambda m: m.check_poses([[0, 0, 0, 1]], [MASKED])),
        ("configurations", lambda m: m.check_motions([[0, 0, 0, 1]], [[0.0, 0.0, 0.0], MASKED])),
        ("body.links[0].spheres", lambda m: m.check_poses([np.ma.array([0, 0, 0, 1.0], mask=[0, 0, 0, 1])], EYE)),
        ("spheres", lambda m: m.check_spheres([np.ma.array([0, 0, 0, 1.0], mask=[0, 0, 0, 1])])),
        ("sizes", lambda m: m.check_spheres([[0, 0, 0, 1]], sizes=np.ma.array([1], mask=[1]))),
        ("origins", lambda m: m.cast_rays([MASKED], ends=POINTS[:1])),
        ("ends", lambda m: m.cast_rays(POINTS[0], ends=[MASKED])),
        ("guess", lambda m: m.insert(POINTS, guess=(MASKED, [0, 0, 0, 1]))),
        ("point_times", lambda m: m.insert(POINTS[:3], point_times=MASKED)),
        ("gravity_in_sensor", lambda m: m.insert(POINTS, gravity_in_sensor=MASKED)),
        ("box", lambda m: m.voxels(box=[MASKED, [1.0, 1.0, 1.0]])),
        ("box.min_m", lambda m: m.voxels(box=mrol.Box(MASKED, [1, 1, 1]))),
        ("area", lambda m: m.grid([MASKED[:2], MASKED[:2] + 1])),
        ("point", lambda m: m.observers(MASKED)),
        ("sphere.center_m", lambda m: m.delete(sphere=(MASKED, 1))),
        ("voxels", lambda m: m.delete(voxels=[np.ma.array([1, 2, 3], mask=[1, 0, 0])])),
        ("prism.corners_m", lambda m: m.keep_out("k", prism=mrol.Prism([MASKED[:2], [1.0, 0.0], [0.0, 1.0]], 0, 1))),
        ("translation_m", lambda _: mrol.Pose(MASKED, [0, 0, 0, 1])),
        ("points", lambda _: mrol.Pose.identity().apply([MASKED])),
    ],
)
def test_masked_values_are_refused_wherever_arrays_go(hall: mrol.Map, argument: str, call: Callable[[mrol.Map], Any]) -> None:
    with pytest.raises(mrol.ArgumentError, match=r"\.filled\(numpy\.nan\)") as refused:
        call(hall)
    assert refused.value.argument == argument


def test_names_with_every_character_stay_names(client: mrol.Client, hall: mrol.Map) -> None:
    for name in ("../maps", "a/b", "a?b=c", "a%2fb", "a b", "ü", "a\r\nb", "a#b", "x" * 5000):
        with pytest.raises(mrol.ServerError) as refused:
            client.map(name)
        assert refused.value.reason == "bad_name" or refused.value.status in (400, 414, 431)
        with pytest.raises(mrol.ServerError) as refused:
            hall.insert(POINTS, robot=name)
        assert refused.value.reason == "bad_name" or refused.value.status in (400, 414, 431)
    with pytest.raises(mrol.ArgumentError, match="name must be a name"):
        client.map("\ud800")


def test_answers_cannot_be_changed(hall: mrol.Map) -> None:
    found = hall.query(POINTS)
    with pytest.raises(ValueError, match="read-only"):
        found.occupied[0] = True
    with pytest.raises(AttributeError):
        found.count = 7  # type: ignore[misc]
