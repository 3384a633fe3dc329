"""What no array should be, and ten thousand calls."""

import gc
import os
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrol
import mrol.replica

POINTS = np.random.default_rng(1).uniform(-4, 4, (2000, 3)).astype(np.float32)


def test_arrays_of_any_kind_are_converted_or_refused(hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    expected = hall.query(POINTS).occupied
    wide = np.zeros((2000, 6), np.float32)
    wide[:, ::2] = POINTS
    frozen = POINTS.copy()
    frozen.setflags(write=False)
    for same in (wide[:, ::2], np.asfortranarray(POINTS), POINTS.astype(">f4"), POINTS.tolist(), frozen, POINTS[::-1][::-1]):
        np.testing.assert_array_equal(replica.query(same).occupied, expected)
    np.testing.assert_array_equal(replica.query(POINTS[::-1]).occupied, expected[::-1])
    refused: list[Any] = [
        [[1, 2]],
        [["a", "b", "c"]],
        [[1, 2, 3], [1, 2]],
        np.zeros((2, 3), complex),
        np.zeros((2, 3), bool),
        np.ma.masked_equal(np.zeros((2, 3)), 0),
        None,
        1.0,
        np.full((1, 3), 1e300),
    ]
    for value in refused:
        with pytest.raises(mrol.ArgumentError, match="points"):
            replica.query(value)
    for value in ([[np.nan, 0, 0]], [[np.inf, 0, 0]]):
        with pytest.raises(mrol.InvalidArgument, match="point_not_finite"):
            replica.query(value)


def test_every_question_takes_columns_that_lie_together(replica: mrol.replica.Replica) -> None:
    columns, body = np.asfortranarray(POINTS), [[0, 0, 0, 0.2]]
    spheres = np.concatenate([POINTS, np.full((len(POINTS), 1), 0.2, np.float32)], axis=1)
    asked: list[Callable[[Any, Any], Any]] = [
        lambda points, _: replica.query(points).occupied,
        lambda points, _: replica.classify(points).free,
        lambda points, _: replica.nearest(points, 1.0).distances_m,
        lambda points, _: replica.cast_rays([0, 0, 0], ends=points).distances_m,
        lambda points, _: replica.cast_rays(points, ends=points[::-1]).distances_m,
        lambda points, _: replica.check_poses(body, points).colliding,
        lambda points, _: replica.check_motions(body, points.reshape(-1, 2, 3)).free,
        lambda _, balls: replica.check_spheres(balls).colliding,
        lambda _, balls: replica.check_poses(balls[:3], POINTS).colliding,
    ]
    for ask in asked:
        np.testing.assert_array_equal(ask(columns, np.asfortranarray(spheres)), ask(POINTS, spheres))


def behind_a_header(array: Any) -> Any:
    """The same numbers as they lie in a message behind an odd byte."""
    array = np.asarray(array)
    bytes_of_message = np.frombuffer(b"\0" + array.tobytes(), np.uint8)
    moved = bytes_of_message[1:].view(array.dtype).reshape(array.shape)
    assert not moved.flags.aligned
    return moved


def in_records(array: Any, ring: str, *, is_last: bool) -> Any:
    """The same rows as a field of packed records."""
    array = np.asarray(array)
    fields: list[Any] = [("row", array.dtype, array.shape[1:]), ("ring", ring)]
    records = np.zeros(len(array), fields if is_last else fields[::-1])
    records["row"] = array
    records["ring"] = 77
    return records["row"]


PLACED: dict[str, Callable[[Any], Any]] = {
    "behind a header": behind_a_header,
    **{
        f"records with {ring} {'behind' if is_last else 'before'} the row": partial(in_records, ring=ring, is_last=is_last)
        for ring in ("u1", "u2", "u4", "f8")
        for is_last in (True, False)
    },
}


@pytest.mark.parametrize("placed", PLACED)
def test_arrays_that_lie_anywhere_are_read_as_numpy_reads_them(replica: mrol.replica.Replica, placed: str) -> None:
    place = PLACED[placed]
    body = mrol.replica.PreparedBody([[0, 0, 0, 0.2]])
    spheres = np.concatenate([POINTS, np.full((len(POINTS), 1), 0.2, np.float32)], axis=1)
    sizes = np.full(len(POINTS) // 4, 4, np.uint32)
    edges = np.concatenate([POINTS, np.tile(np.float32([0, 0, 0, 1]), (len(POINTS), 1))], axis=1)
    lengths = np.full(len(POINTS) // 4, 4, np.uint32)
    local = mrol.replica.LocalMap(0.1, levels=2)
    local.insert(POINTS, align=False)
    scan, times = POINTS[:500], np.linspace(0, 0.1, 500, dtype=np.float32)

    def inserted(points: Any, point_times: Any) -> Any:
        another = mrol.replica.LocalMap(0.1, levels=2)
        another.insert(points, point_times=point_times, timestamp_ns=1, align=False)
        return another.query(POINTS).occupied

    asked: list[tuple[Callable[..., Any], list[Any]]] = [
        (lambda points: replica.query(points).occupied, [POINTS]),
        (lambda points: replica.classify(points).free, [POINTS]),
        (lambda points: replica.nearest(points, 1.0).distances_m, [POINTS]),
        (lambda points: replica.cast_rays([0, 0, 0], ends=points).distances_m, [POINTS]),
        (lambda origins, ends: replica.cast_rays(origins, ends=ends).distances_m, [POINTS, POINTS[::-1]]),
        (lambda points: replica.check_poses(body, points).colliding, [POINTS]),
        (lambda sevens: replica.check_poses(body, sevens).colliding, [edges]),
        (lambda sevens: replica.check_motions(body, sevens.reshape(-1, 2, 7)).free, [edges]),
        (lambda sevens, counts: replica.check_motions(body, sevens, lengths=counts).free, [edges, lengths]),
        (lambda balls: replica.check_spheres(balls).colliding, [spheres]),
        (lambda balls, counts: replica.check_spheres(balls, sizes=counts).colliding, [spheres, sizes]),
        (lambda balls: replica.check_poses(mrol.replica.PreparedBody(balls), POINTS).colliding, [spheres[:3]]),
        (lambda points: replica.check_poses(mrol.Link(points=points, padding_m=0.1), POINTS).colliding, [POINTS[:3]]),
        (inserted, [scan, times]),
        (lambda points: local.align(points, guess=np.eye(4)).overlap, [scan]),
        (lambda points: local.localize(points, candidates=1, seed=1, time_limit_s=0).points_skipped, [scan]),
    ]
    for ask, arrays in asked:
        np.testing.assert_array_equal(ask(*map(place, arrays)), ask(*arrays))


def test_arguments_are_named(replica: mrol.replica.Replica) -> None:
    body = [[0, 0, 0, 0.2]]
    asked: list[tuple[str, Callable[[], object]]] = [
        ("level", lambda: replica.query(POINTS, level=-1)),
        ("level", lambda: replica.query(POINTS, level=1 << 40)),
        ("lookup", lambda: replica.query(POINTS, lookup="maybe")),
        ("keep_out", lambda: replica.query(POINTS, keep_out="yes")),
        ("map_from_points", lambda: replica.query(POINTS, map_from_points=np.diag([2, 2, 2, 1]))),
        ("answer", lambda: replica.check_poses(body, POINTS, answer="all")),
        ("configurations", lambda: replica.check_poses(body, POINTS[:, :2])),
        ("ignored", lambda: replica.check_poses(body, POINTS, ignored=["box"])),
        ("body", lambda: replica.check_poses([[0, 0]], POINTS)),
        ("lengths", lambda: replica.check_motions(body, POINTS, lengths=[1, 2])),
        ("sizes", lambda: replica.check_spheres(np.zeros((3, 4)), sizes=[4])),
        ("origins", lambda: replica.cast_rays(POINTS[:5], ends=POINTS)),
        ("directions", lambda: replica.cast_rays([0, 0, 0])),
        ("radius_m", lambda: replica.nearest(POINTS, float("nan"))),
        ("bad_radius", lambda: replica.nearest(POINTS, -1.0)),
        ("radius", lambda: replica.check_poses([[0, 0, 0, -0.2]], POINTS)),
        ("bad_ray", lambda: replica.cast_rays([0, 0, 0], POINTS)),
    ]
    for name, ask in asked:
        with pytest.raises(mrol.MrolError, match=name):
            ask()


def test_the_way_for_planners_takes_what_it_says(replica: mrol.replica.Replica) -> None:
    body = mrol.replica.PreparedBody([[0, 0, 0, 0.2]])
    edge = np.array([[0, 0, 0, 0, 0, 0, 1], [0.5, 0, 0, 0, 0, 0, 1]], np.float32)
    assert replica.motion_is_free(body, edge) is True
    with pytest.raises(mrol.ArgumentError, match="configurations must be an array of float32"):
        replica.motion_is_free(body, edge.astype(np.float64))  # type: ignore[arg-type]
    with pytest.raises(mrol.ArgumentError, match="body must be a PreparedBody"):
        replica.motion_is_free([[0, 0, 0, 0.2]], edge)  # type: ignore[arg-type]
    with pytest.raises(mrol.ArgumentError, match="level must be a whole number"):
        replica.motion_is_free(body, edge, scope={"level": -1})
    with pytest.raises(mrol.ArgumentError, match="scope must be a dict of options"):
        replica.motion_is_free(body, edge, scope=["level"])  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="contiguous"):
        replica.motion_is_free(body, np.repeat(edge, 2, axis=1)[:, ::2])
    with pytest.raises(ValueError, match="contiguous"):
        replica.motion_is_free(body, np.asfortranarray(edge))
    moved = behind_a_header(edge)
    with pytest.raises(ValueError, match="aligned: numpy.require") as refused:
        replica.motion_is_free(body, moved)
    assert isinstance(refused.value, mrol.MrolError)
    assert replica.motion_is_free(body, np.require(moved, np.float32, ["C", "ALIGNED"])) is True
    with pytest.raises(ValueError, match="configurations"):
        replica.motion_is_free(body, edge[:1])
    with pytest.raises(mrol.InvalidArgument):
        replica.motion_is_free(body, np.full_like(edge, np.nan))


def reason_of(call: Callable[[], object]) -> str | None:
    """Why a question is refused, where it is."""
    try:
        call()
    except mrol.InvalidArgument as error:
        return error.reason
    return None


def test_an_array_that_changes_meanwhile_changes_nothing_of_the_question(replica: mrol.replica.Replica) -> None:
    points = np.tile(POINTS, (50, 1))
    over = threading.Event()

    def change() -> None:
        while not over.is_set():
            points[:] = np.nan
            points[:] = 0.25

    thread = threading.Thread(target=change)
    thread.start()
    try:
        for _ in range(50):
            assert reason_of(lambda: replica.query(points)) in (None, "point_not_finite")
    finally:
        over.set()
        thread.join()


def test_a_panic_of_the_extension_is_an_error(replica: mrol.replica.Replica) -> None:
    # The package refuses such times before they come there.
    native = replica._opened  # noqa: SLF001
    options: dict[str, Any] = dict.fromkeys(
        ["key", "ca", "certificate", "private_key", "silence_s", "region", "blocks_max", "age_max_s"], None
    )
    for panics in (
        lambda: native.wait_for_revision(0, float("nan")),
        lambda: native.check_age(float("nan")),
        lambda: type(native)("http://127.0.0.1:9", "m", timeout_s=-1.0, bloom=False, viewpoints=False, **options),
    ):
        with pytest.raises(mrol.MrolError, match="a defect of mrol-replica: it panicked"):
            panics()
    assert replica.query(POINTS).count > 0


def resident_bytes() -> int:
    """Memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_ten_thousand_calls_leave_nothing(replica: mrol.replica.Replica) -> None:
    body = mrol.replica.PreparedBody([[0, 0, 0, 0.2]])
    edge = np.array([[0, 0, 0, 0, 0, 0, 1], [0.5, 0, 0, 0, 0, 0, 1]], np.float32)
    calls: list[Callable[[], object]] = [
        lambda: replica.query(POINTS),
        lambda: replica.motion_is_free(body, edge),
        lambda: replica.check_motions([[0, 0, 0, 0.2]], edge),
        lambda: replica.check_poses(body, POINTS[:50], answer="first_hit"),
        lambda: replica.nearest(POINTS[:50], 0.5),
        lambda: replica.cast_rays([0, 0, 0], ends=POINTS[:50]),
        lambda: replica.status,
    ]

    def refused() -> None:
        with pytest.raises(mrol.InvalidArgument):
            replica.query([[np.nan, 0, 0]])

    for call in [*calls, refused]:
        for _ in range(500):
            call()
        gc.collect()
        before = resident_bytes()
        for _ in range(10_000 // len(calls)):
            call()
        gc.collect()
        assert resident_bytes() - before < 8_000_000


def test_replicas_that_are_opened_and_closed_leave_nothing(replica: mrol.replica.Replica, hall: mrol.Map, server: Any) -> None:
    def opened() -> None:
        with mrol.replica.Replica(server.grpc, hall.name) as another:
            another.query(POINTS)

    for _ in range(10):
        opened()
    gc.collect()
    before, files = resident_bytes(), len(os.listdir("/proc/self/fd"))
    for _ in range(50):
        opened()
    gc.collect()
    assert resident_bytes() - before < 30_000_000
    assert len(os.listdir("/proc/self/fd")) < files + 10


def test_maps_without_a_server_that_are_dropped_leave_nothing() -> None:
    def made() -> None:
        m = mrol.replica.LocalMap(0.1, levels=3)
        m.insert(POINTS, align=False)
        m.query(POINTS)

    for _ in range(5):
        made()
    gc.collect()
    before, threads = resident_bytes(), len(os.listdir("/proc/self/task"))
    for _ in range(40):
        made()
    gc.collect()
    assert resident_bytes() - before < 40_000_000
    assert len(os.listdir("/proc/self/task")) < threads + 10
