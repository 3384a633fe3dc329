"""The smaller parts: the queue, the correction, gravity, the grid, the copy of the voxels, the options."""

import math
from threading import Event, Thread
from types import SimpleNamespace

import mrol
import numpy as np
import pytest
from mrol import Pose

from mrol_ros.correction import LEAST_STD, OPEN_VARIANCE, Correction, covariance_of, guess_covariance, moved_covariance
from mrol_ros.gravity import G, GravityWindow
from mrol_ros.lost import LostClouds
from mrol_ros.newest import NewestQueue
from mrol_ros.occupancy_grid import grid_cells
from mrol_ros.options import DESCRIPTIONS, OptionError, Options
from mrol_ros.voxel_set import VoxelSet


def test_the_newest_item_wins_and_what_it_replaced_is_counted():
    queue = NewestQueue()
    for item in range(5):
        queue.put(item)
    assert queue.take(0) == 4
    assert queue.take(0) is None
    assert (queue.received, queue.dropped) == (5, 4)


def test_whoever_waits_for_an_item_gets_it_and_a_close_ends_the_waiting():
    queue, taken, got = NewestQueue(), [], Event()

    def take():
        taken.append(queue.take(30))
        got.set()
        taken.append(queue.take(30))

    thread = Thread(target=take)
    thread.start()
    queue.put("item")
    assert got.wait(10)
    queue.close()
    thread.join(10)
    assert taken == ["item", None]


@pytest.mark.parametrize(
    ("numbers", "publishers", "count"),
    [
        ([34, 35, 37, 40], 1, 3),
        ([34, 35, 36], 1, 0),
        # Two publishers, one that was started again, and a middleware without numbers.
        ([500, 1, 501, 2, 502], 2, 0),
        ([500, 1, 2], 1, 0),
        ([2**64 - 1] * 3, 1, 0),
    ],
)
def test_clouds_that_never_came_are_counted_where_one_publisher_numbers_them(numbers, publishers, count):
    lost = LostClouds()
    lost.settle(publishers)
    for number in numbers:
        lost.see(number)
    lost.settle(publishers)
    lost.settle(publishers)
    assert lost.count == count
    # From then on as usual.
    lost.settle(1)
    lost.see(numbers[-1] + 2)
    lost.settle(1)
    assert lost.count == count + 1


def turned(x, y, degrees):
    half = math.radians(degrees) / 2
    return Pose.of([x, y, 0, 0, 0, math.sin(half), math.cos(half)])


def test_map_from_odom_times_odom_from_sensor_is_the_servers_pose():
    correction = Correction(200)
    odom_from_sensor, map_from_sensor = turned(3, -2, 40), turned(5, 1, -70)
    found = correction.update(1000, map_from_sensor, odom_from_sensor)
    assert found.stamp_ns == 1200
    assert np.abs((found.map_from_odom @ odom_from_sensor).matrix - map_from_sensor.matrix).max() < 1e-12


def test_stamps_ascend_while_the_server_is_away_and_when_it_is_back():
    correction = Correction(200)
    assert correction.keep_alive(1000, 50) is None
    correction.update(1000, turned(1, 0, 0), turned(0, 0, 0))
    assert correction.keep_alive(1100, 50) is None
    assert correction.keep_alive(1151, 50).stamp_ns == 1351
    assert correction.keep_alive(1152, 50) is None
    # The answer to an old cloud is in force at once.
    late = correction.update(1010, turned(2, 0, 0), turned(0, 0, 0))
    assert late.stamp_ns == 1352
    assert late.map_from_odom.translation_m[0] == 2
    correction.clock_was_set_back()
    assert correction.keep_alive(5, 50).stamp_ns == 205
    correction.forget()
    assert correction.keep_alive(10_000, 50) is None


def test_a_covariance_is_carried_along_the_lever():
    information = np.diag([1e4, 1e4, 1e4, 1e6, 1e6, 1e6])
    at_sensor = covariance_of(information, np.zeros(3))
    assert np.allclose(at_sensor, np.diag([1e-4] * 3 + [1e-6] * 3))
    # A turn about z by s moves what lies 2 m ahead by 2 s to the left.
    carried = covariance_of(information, np.array([2.0, 0, 0]))
    assert carried[1, 1] == pytest.approx(1e-4 + 4e-6)
    assert carried[1, 5] == pytest.approx(2e-6)
    # Of points that turn with the body.
    rng = np.random.default_rng(1)
    lever = np.array([0.3, -0.4, 0.9])
    drawn = rng.multivariate_normal(np.zeros(6), at_sensor * 100, 200_000)
    moved = drawn.copy()
    moved[:, :3] += np.cross(drawn[:, 3:], lever)
    assert np.allclose(np.cov(moved.T), moved_covariance(at_sensor * 100, lever), atol=3e-4)


def test_a_direction_that_is_open_has_a_large_variance():
    information = np.diag([1e4, 0, 1e4, 1e6, 1e6, 1e6])
    found = covariance_of(information, np.zeros(3))
    assert found[1, 1] == pytest.approx(OPEN_VARIANCE)
    assert found[0, 0] == pytest.approx(1e-4)


def test_an_initial_pose_of_rviz_gets_variances_where_it_tells_none():
    of_rviz = np.zeros((6, 6))
    of_rviz[0, 0] = of_rviz[1, 1] = 0.25
    of_rviz[5, 5] = 0.0685
    found = guess_covariance(of_rviz)
    assert np.diag(found).tolist() == [0.25, 0.25, *(LEAST_STD[2:5] ** 2).tolist(), 0.0685]
    for bad in (np.full((6, 6), np.nan), np.diag([-1.0] * 6)):
        with pytest.raises(ValueError, match="covariance"):
            guess_covariance(bad)


@pytest.mark.parametrize(("one_g", "is_told"), [(G, True), (1.0, True), (G * 1.029, True), (G * 1.031, False), (0.0, False)])
def test_gravity_is_told_in_the_sensor_frame_while_it_is_1_g(one_g, is_told):
    upside_down = Pose.of([1, 2, 3, 1, 0, 0, 0])
    window = GravityWindow()
    window.note(0, (7.0, 0.0, 0.0))
    window.note(1_000_000_000, (0.0, 0.0, one_g))
    down = window.at(1_100_000_000, upside_down)
    assert (down is not None) == is_told
    if is_told:
        assert np.allclose(down / np.linalg.norm(down), [0, 0, 1])
    assert GravityWindow().at(0, upside_down) is None


def grid(occupied, free):
    return SimpleNamespace(occupied=np.array(occupied, bool), free=None if free is None else np.array(free, bool))


def test_cells_are_occupied_free_or_unknown_row_by_row():
    assert grid_cells(grid([[1, 0, 0], [0, 0, 1]], [[0, 1, 0], [1, 0, 1]])).tolist() == [100, 0, -1, 0, -1, 100]
    assert grid_cells(grid([[1, 0]], None)).tolist() == [100, 0]


def version(revision):
    return mrol.Version(revision, "u")


class State(mrol.WatchedState):
    """A state of these voxels."""

    def __init__(self, indices):
        object.__setattr__(self, "version", version(1))
        object.__setattr__(self, "given", np.array(indices, np.int32).reshape(-1, 3))

    def indices(self):
        return self.given


class Change(mrol.WatchedChange):
    """A change of these voxels."""

    def __init__(self, revision, removed, added):
        object.__setattr__(self, "version", version(revision))
        object.__setattr__(self, "given", [np.array(of, np.int32).reshape(-1, 3) for of in (removed, added)])

    def removed(self):
        return self.given[0]

    def added(self):
        return self.given[1]


def test_the_copy_of_the_voxels_is_that_of_all_changes_in_order():
    rng = np.random.default_rng(5)
    copied, expected = VoxelSet(), set()
    assert copied.revision is None
    copied.take(State([]))
    for revision in range(2, 60):
        removed, added = (rng.integers(-4, 4, (20, 3)) for _ in range(2))
        copied.take(Change(revision, removed, added))
        expected = (expected - set(map(tuple, removed.tolist()))) | set(map(tuple, added.tolist()))
        if revision % 7 == 0:
            assert set(map(tuple, copied.indices().tolist())) == expected
    assert copied.revision == 59
    copied.take(State([[1, -2, 3]]))
    assert copied.indices().tolist() == [[1, -2, 3]]


def test_every_option_is_described_and_what_cannot_be_is_refused():
    assert set(DESCRIPTIONS) == set(Options.__dataclass_fields__)
    for values, words in [
        ({"transform_period_s": 0.0}, "transform_period_s must be 0.001 to 60 s, got 0.0"),
        ({"resolution": -1.0}, "resolution must be 0 or more, got -1.0"),
        ({"occupancy_min_z": 3.0}, "occupancy_min_z must be below occupancy_max_z, 2.0, got 3.0"),
        ({"occupancy_z_from": "sky"}, "occupancy_z_from must be floor or map, got sky"),
        ({"extrinsics": [1.0, 2.0]}, "extrinsics must be empty or 7 numbers"),
        ({"initial_pose": [0.0] * 7}, "initial_pose"),
        ({"times": "t:h:stamp"}, "times must be FIELD:UNIT:FROM"),
        ({"range_max_m": math.nan}, "range_max_m must be finite"),
        ({"range_max_m": "far"}, "range_max_m must be a number, got far"),
        ({"range_max_m": True}, "range_max_m must be a number, got True"),
        ({"map": 7}, "map must be text, got 7"),
        ({"publish_tf": 1}, "publish_tf must be true or false, got 1"),
        ({"octomap_free_level": 0.5}, "octomap_free_level must be a whole number, got 0.5"),
        ({"body_m": "abcdef"}, "body_m must be numbers, got abcdef"),
    ]:
        with pytest.raises(OptionError) as error:
            Options.of(values)
        assert words in str(error.value)


def test_whole_numbers_are_taken_for_others():
    options = Options.of({"resolution": 1, "extrinsics": [0, 0, 1, 0, 0, 0, 1], "initial_pose": None})
    assert (options.resolution, options.extrinsics, options.initial_pose) == (1.0, (0, 0, 1, 0, 0, 0, 1), ())


def test_robots_are_named_by_their_namespaces_and_frames_have_prefixes():
    options = Options(frame_prefix="r1/", base_frame_id="/base_footprint")
    assert (options.odom, options.base, options.map_frame) == ("r1/odom", "r1/base_footprint", "map")
    assert options.robot_name("/r1") == "r1"
    assert options.robot_name("/fleet/r 2") == "fleet.r-2"
    assert options.robot_name("/")
    assert Options(robot="cart").robot_name("/r1") == "cart"
