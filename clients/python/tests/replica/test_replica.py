"""A replica answers what the server answers, and follows it."""

import os
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrol
import mrol.replica

from ..support.scenes import room
from ..support.server import Server, run, serving

RNG = np.random.default_rng(7)
POINTS = RNG.uniform([-4.5, -3.5, -2], [4.5, 3.5, 2], (4000, 3)).astype(np.float32)
POSES = np.concatenate([POINTS[:500], np.tile([0, 0, 0, 1], (500, 1))], axis=1).astype(np.float32)
BODY = mrol.Body([mrol.Link(spheres=[[0, 0, 0, 0.3]]), mrol.Link(points=[[0, 0, 0.1]], padding_m=0.05)])
TWO = np.repeat(POSES[:, None], 2, axis=1)


def equal(ours: Any, theirs: Any) -> None:
    """All arrays of two answers, and their versions."""
    assert type(ours) is type(theirs)
    for name, value in vars(theirs).items():
        other = vars(ours)[name]
        if isinstance(value, np.ndarray):
            assert other.dtype == value.dtype or value.dtype.kind in "iu", name
            np.testing.assert_array_equal(other, value, err_msg=name)
        elif hasattr(value, "__dict__"):
            equal(other, value)
        else:
            assert other == value, name


def test_points(hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    pose = mrol.Pose.of([0.3, -0.2, 0.1, 0, 0, np.sin(0.3), np.cos(0.3)])
    for options in [{}, {"level": 2}, {"keep_out": True}, {"map_from_points": pose}]:
        equal(replica.query(POINTS, **options), hall.query(POINTS, **options))
    assert 0 < replica.query(POINTS).count < len(POINTS)
    # A filter says "occupied" of more, and of all that is.
    bloom, exact = replica.query(POINTS, lookup="bloom").occupied, replica.query(POINTS).occupied
    assert (bloom | ~exact).all()


def test_shapes_are_kept(replica: mrol.replica.Replica) -> None:
    assert replica.query(POINTS.reshape(40, 100, 3)).occupied.shape == (40, 100)
    assert replica.query(POINTS[0]).occupied.shape == ()
    assert replica.nearest(POINTS[:12].reshape(3, 4, 3), 1.0).away.shape == (3, 4, 3)
    assert replica.query(np.zeros((0, 3))).occupied.shape == (0,)


def test_bodies(hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    prepared = mrol.replica.PreparedBody(BODY)
    ignored = [mrol.Sphere([1.5, 1, 0], 0.8), mrol.OrientedBox([3, 0, 0, 0, 0, 0, 1], [1, 1, 1])]
    several: list[dict[str, Any]] = [
        {},
        {"answer": "first_hit"},
        {"answer": "clearance", "clearance_max_m": 0.5},
        {"unknown": "occupied", "level": 1},
        {"ignored": ignored, "ignore_keep_outs": True},
    ]
    for options in several:
        theirs = hall.check_poses(BODY, TWO, **options)
        equal(replica.check_poses(BODY, TWO, **options), theirs)
        equal(replica.check_poses(prepared, TWO, **options), theirs)
    spheres = np.concatenate([POINTS, np.full((len(POINTS), 1), 0.2)], axis=1)
    equal(replica.check_spheres(spheres, answer="first_hit"), hall.check_spheres(spheres, answer="first_hit"))
    sizes = np.full(len(POINTS) // 4, 4)
    equal(replica.check_spheres(spheres, sizes=sizes), hall.check_spheres(spheres, sizes=sizes))


def test_a_limit_of_clearances_that_are_not_asked_for_is_refused_as_a_server_does(
    hall: mrol.Map, replica: mrol.replica.Replica
) -> None:
    told: list[tuple[str, str]] = []
    every: list[mrol.Questions] = [hall, replica, mrol.replica.LocalMap(0.1, levels=4)]
    for asked in every:
        for answer in ("colliding", "first_hit"):
            limit: dict[str, Any] = {"answer": answer, "clearance_max_m": 0.5}
            for ask in (
                partial(asked.check_poses, BODY, TWO, **limit),
                partial(asked.check_spheres, [[0, 0, 0, 0.2]], **limit),
            ):
                with pytest.raises(mrol.InvalidArgument, match="clearance_max_m goes with the answer clearance") as refused:
                    ask()
                told.append((refused.value.reason, str(refused.value)))
    assert len(set(told)) == 1, set(told)


def test_motions(hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    ball = [[0.0, 0.0, 0.0, 0.25]]
    edges = POSES.reshape(250, 2, 7)
    theirs = hall.check_motions(ball, edges, clearance_max_m=0.4)
    equal(replica.check_motions(ball, edges, clearance_max_m=0.4), theirs)
    lengths = [2, 3, 5, 490]
    equal(replica.check_motions(ball, POSES, lengths=lengths), hall.check_motions(ball, POSES, lengths=lengths))
    body = mrol.replica.PreparedBody(ball)
    one_by_one = [replica.motion_is_free(body, edge) for edge in edges]
    np.testing.assert_array_equal(one_by_one, theirs.free)
    assert 0 < theirs.count < 250


def test_rays_distances_and_states(hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    directions = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
    for options in [{}, {"unknown": "occupied"}, {"range_m": 2.0, "ignore_keep_outs": True}, {"level": 1}]:
        equal(replica.cast_rays([0, 0, 0], directions, **options), hall.cast_rays([0, 0, 0], directions, **options))
    equal(replica.cast_rays(POINTS, ends=-POINTS), hall.cast_rays(POINTS, ends=-POINTS))
    equal(replica.nearest(POINTS, 1.0), hall.nearest(POINTS, 1.0))
    equal(replica.nearest(POINTS, 1.0, to="centers", level=1), hall.nearest(POINTS, 1.0, to="centers", level=1))
    states = replica.classify(POINTS)
    equal(states, hall.classify(POINTS))
    assert states.free.any()
    assert states.unknown.any()


def test_grids_and_frontiers(hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    several: list[dict[str, Any]] = [
        {},
        {"area": [[-2, -2], [3, 2]], "min_z_m": -1, "max_z_m": 1, "cell_m": 0.2, "tell_unknown": True},
        {"level": 1, "ignore_keep_outs": True},
    ]
    for options in several:
        equal(replica.grid(**options), hall.grid(**options))
    ours, theirs = (asked.frontiers([[-6, -5, -2], [6, 5, 2]], size_min=1, level=1) for asked in (replica, hall))
    assert ours.frontiers_total == theirs.frontiers_total > 0
    assert (ours.voxels_total, ours.version) == (theirs.voxels_total, theirs.version)
    for our, their in zip(ours.frontiers, theirs.frontiers, strict=True):
        equal(our, their)
    with pytest.raises(mrol.InvalidArgument, match="bad_grid"):
        replica.grid(min_z_m=1, max_z_m=-1)


def test_a_revision_and_a_map_are_asked_for(server: Server, hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    here = hall.describe().version
    local = mrol.replica.LocalMap(0.1, levels=4)
    local.insert(POINTS[:10], align=False)
    of_local = local.query(POINTS).version
    every: list[tuple[mrol.Questions, mrol.Version]] = [(replica, here), (local, of_local)]
    for asked, version in every:
        known: dict[str, Any] = {"min_revision": version.revision, "map_uuid": version.map_uuid}
        for ask in (partial(asked.query, POINTS), partial(asked.classify, POINTS), asked.grid):
            assert ask(**known).version == version
            with pytest.raises(mrol.FailedPrecondition, match="map_replaced"):
                ask(map_uuid="00000000-0000-0000-0000-000000000000")
            with pytest.raises(mrol.InvalidArgument, match="bad_uuid"):
                ask(map_uuid="that one")
    with pytest.raises(mrol.DeadlineExceeded, match="revision_not_reached"):
        replica.query(POINTS, min_revision=here.revision + 1)


def test_wrong_options_are_named(replica: mrol.replica.Replica) -> None:
    body, way = mrol.replica.PreparedBody([[0, 0, 0, 0.25]]), np.ascontiguousarray(POSES[:2])
    wrong: dict[str, Any] = {"levl": 1}
    several: list[Callable[..., object]] = [
        partial(replica.query, POINTS),
        partial(replica.nearest, POINTS, 1.0),
        lambda **scope: replica.motion_is_free(body, way, scope=scope),  # type: ignore[arg-type]
    ]
    for ask in several:
        with pytest.raises(TypeError, match="got an unexpected keyword argument 'levl'"):
            ask(**wrong)
        for name, value in {"level": -1, "min_revision": 0.5, "map_uuid": 5}.items():
            with pytest.raises(mrol.ArgumentError) as refused:
                ask(**{name: value})
            assert refused.value.argument == name
    here = replica.status.version
    known: mrol.QuestionScope = {"level": 0, "ignore_keep_outs": True, "min_revision": here.revision, "map_uuid": here.map_uuid}
    assert replica.motion_is_free(body, way, scope=known) == replica.check_motions(body, way, ignore_keep_outs=True).free
    with pytest.raises(mrol.FailedPrecondition, match="map_replaced"):
        replica.motion_is_free(body, way, scope={"map_uuid": "00000000-0000-0000-0000-000000000000"})
    # On the class, whose documentation it has, it is the same.
    assert mrol.replica.Replica.motion_is_free(replica, body, way) == replica.motion_is_free(body, way)


def test_it_needs_numpy_and_the_extension_alone() -> None:
    program = "import sys, mrol.replica; print('mrol_native' in sys.modules, 'typing_extensions' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "False"]


def test_a_prepared_body_is_a_body(hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    prepared = mrol.replica.PreparedBody(BODY)
    assert isinstance(prepared, mrol.Body)
    assert len(prepared.links) == 2
    equal(hall.check_poses(prepared, TWO), replica.check_poses(prepared, TWO))
    np.testing.assert_array_equal(
        replica.check_poses(mrol.replica.PreparedBody(prepared), TWO).colliding, hall.check_poses(BODY, TWO).colliding
    )


def test_it_follows_and_comes_back(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        m = mrol.connect(server.address).map("a", resolution=0.1, levels=2)
        m.insert([[1, 0, 0]], align=False)
        with mrol.replica.Replica(server.grpc, "a") as replica:
            assert replica.query([[1, 0, 0], [2, 0, 0]]).occupied.tolist() == [True, False]
            second = m.insert([[2, 0, 0]], align=False, guess=np.eye(4), force=True)
            replica.wait_for_revision(second.revision)
            assert replica.query([[1, 0, 0], [2, 0, 0]]).occupied.all()
            with pytest.raises(mrol.DeadlineExceeded, match="revision_not_reached"):
                replica.wait_for_revision(second.revision + 1, timeout_s=0.1)
            server.kill()
            assert replica.query([[1, 0, 0]]).occupied.all()
            server.start()
            third = m.insert([[3, 0, 0]], align=False, guess=np.eye(4), force=True)
            replica.wait_for_revision(third.revision, timeout_s=30)
            assert replica.query([[3, 0, 0]]).version == third.version
            status = replica.status
            assert (status.is_connected, status.resets, status.version) == (True, 1, third.version)


def test_what_cannot_be_opened(server: Server, hall: mrol.Map) -> None:
    with pytest.raises(mrol.NotFound, match="map_not_found"):
        mrol.replica.Replica(server.grpc, "nowhere")
    with pytest.raises(mrol.ConnectFailed):
        mrol.replica.Replica("127.0.0.1:9", "a")
    with pytest.raises(mrol.InvalidArgument, match="bad_name"):
        mrol.replica.Replica(server.grpc, "../a")
    with pytest.raises(ValueError, match="address"):
        mrol.replica.Replica("http://", "a")
    with pytest.raises(mrol.MrolError):
        mrol.replica.Replica(server.address, hall.name, timeout_s=5)
    with pytest.raises(mrol.ArgumentError, match="timeout_s"):
        mrol.replica.Replica(server.grpc, hall.name, timeout_s=float("nan"))
    with pytest.raises(mrol.ArgumentError, match="ca must be a file of certificates"):
        mrol.replica.Replica(server.grpc, hall.name, ca="/nowhere.pem")
    with pytest.raises(mrol.ArgumentError, match="private_key must be given together with certificate"):
        mrol.replica.Replica(server.grpc, hall.name, certificate="/nowhere.pem")


def test_a_region_answers_what_it_knows(server: Server, hall: mrol.Map) -> None:
    with mrol.replica.Replica(server.grpc, hall.name, region=[[-5, -4, -2], [0, 4, 2]]) as part:
        inside = POINTS[POINTS[:, 0] < -0.5]
        np.testing.assert_array_equal(part.query(inside).occupied, hall.query(inside).occupied)
        assert part.query(inside).version.content_hash is None
        with pytest.raises(mrol.InvalidArgument, match="point_out_of_range"):
            part.query([[1, 0, 0]])


def test_keys(tmp_path: Path) -> None:
    keys = tmp_path / "keys.toml"
    secret = run("key", "new", "--name", "p", "--scope", "read", "--file", str(keys)).splitlines()[0]
    with serving(tmp_path, "--keys-file", str(keys)) as server:
        with pytest.raises(mrol.Unauthenticated):
            mrol.replica.Replica(server.grpc, "a")
        with pytest.raises(mrol.NotFound):
            mrol.replica.Replica(server.grpc, "a", key=secret)
        with pytest.raises(mrol.Unauthenticated) as refused:
            mrol.replica.Replica(server.grpc, "a", key=secret + "x")
        assert secret not in repr(refused.value)


def test_a_revoked_key_is_given_up_and_old_answers_are_refused(tmp_path: Path) -> None:
    keys = tmp_path / "keys.toml"

    def secret_of(name: str, scope: str) -> str:
        return run("key", "new", "--name", name, "--scope", scope, "--file", str(keys)).splitlines()[0]

    operator, reader = secret_of("operator", "admin"), secret_of("reader", "read")
    with serving(tmp_path, "--keys-file", str(keys)) as server:
        m = mrol.connect(server.address, key=operator).map("a", resolution=0.1, levels=2)
        m.insert([[1, 0, 0]], align=False)
        with (
            mrol.replica.Replica(server.grpc, "a", key=reader) as lasting,
            mrol.replica.Replica(server.grpc, "a", key=reader, age_max_s=2) as strict,
        ):
            lasting.check_age(60)
            assert not lasting.status.has_ended
            run("key", "revoke", "--name", "reader", "--file", str(keys))
            deadline = time.monotonic() + 60
            while not (lasting.status.has_ended and strict.status.has_ended):
                assert time.monotonic() < deadline, lasting.status
                time.sleep(0.05)
            status = lasting.status
            assert not status.is_connected
            assert status.age_s > 0
            assert status.last_error
            # One that allows any age answers on and says how old it is; the other one refuses.
            while strict.status.age_s <= 2:
                time.sleep(0.05)
            assert lasting.query([[1, 0, 0]]).occupied.all()
            with pytest.raises(mrol.Unavailable, match="replica_stale"):
                lasting.check_age(1)
            with pytest.raises(mrol.Unavailable, match="age_max is 2s"):
                strict.query([[1, 0, 0]])


def test_threads_ask_beside_each_other(hall: mrol.Map, replica: mrol.replica.Replica) -> None:
    expected = hall.query(POINTS).count
    with ThreadPoolExecutor(8) as threads:
        counts = list(threads.map(lambda _: replica.query(POINTS).count, range(200)))
    assert set(counts) == {expected}


def test_other_threads_of_python_go_on(replica: mrol.replica.Replica) -> None:
    many = np.tile(POINTS, (20, 1))
    turns = 0
    over = threading.Event()

    def count() -> None:
        nonlocal turns
        while not over.is_set():
            turns += 1
            time.sleep(0.0005)

    thread = threading.Thread(target=count)
    thread.start()
    before = turns
    for _ in range(3):
        replica.nearest(many, 1.0)
    during = turns - before
    over.set()
    thread.join()
    assert during > 5


def test_a_child_gets_an_error_and_the_parent_goes_on(replica: mrol.replica.Replica) -> None:
    child = os.fork()
    if child == 0:
        code = 1
        try:
            try:
                replica.query([[0, 0, 0]])
            except mrol.replica.Forked:
                code = 0
            replica.close()
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0
    replica.query([[0, 0, 0]])


def test_closed_is_closed(server: Server, hall: mrol.Map) -> None:
    replica = mrol.replica.Replica(server.grpc, hall.name)
    replica.close()
    replica.close()
    for ask in (lambda: replica.query([[0, 0, 0]]), lambda: replica.status, lambda: replica.wait_for_revision(0)):
        with pytest.raises(mrol.replica.Closed):
            ask()


def test_ctrl_c_ends_what_waits(tmp_path: Path) -> None:
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        program = tmp_path / "opens.py"
        program.write_text(
            textwrap.dedent(
                f"""
                import mrol.replica
                print("begins", flush=True)
                try:
                    mrol.replica.Replica("127.0.0.1:{silent.getsockname()[1]}", "a")
                except KeyboardInterrupt:
                    print("interrupted")
                """
            )
        )
        process = subprocess.Popen([sys.executable, str(program)], stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=10)
        assert said == "interrupted\n"


def test_a_silent_server_is_given_up(tmp_path: Path) -> None:
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        begin = time.monotonic()
        with pytest.raises(mrol.TimedOut, match="timeout_s"):
            mrol.replica.Replica(f"127.0.0.1:{silent.getsockname()[1]}", "a", timeout_s=0.5)
        assert time.monotonic() - begin < 5


def test_a_scan_of_the_room_is_all_there(server: Server) -> None:
    m = mrol.connect(server.address).map("whole", resolution=0.1, levels=4)
    scan = room(seed=9)
    answer = m.insert(scan, align=False)
    with mrol.replica.Replica(server.grpc, "whole") as replica:
        found = replica.query(scan)
        assert found.occupied.all()
        assert found.version == answer.version
