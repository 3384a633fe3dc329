"""What others may send by mistake or on purpose: nothing grows, nothing ends, and nothing goes wrong without a word."""

import threading
import time
from contextlib import contextmanager
from threading import Thread
from types import SimpleNamespace

import mrol
import numpy as np
import pytest
from mrol import Pose

from mrol_ros import map_feed as map_feed_module
from mrol_ros.clouds import POINT_STEP_MAX, CloudError, CloudField, CloudLayout, StampedCloud, read_cloud
from mrol_ros.correction import AHEAD_MAX_NS, Correction, guess_covariance
from mrol_ros.diagnosis import Diagnosis
from mrol_ros.frames import POSES_MAX, TREE_POSES_MAX, FrameTree
from mrol_ros.guesses import INITIAL_POSE_TRIES, InitialPose
from mrol_ros.map_feed import MapFeed
from mrol_ros.mapper import NOTED_MAX
from mrol_ros.options import OptionError, Options
from mrol_ros.own_scans import STRANGERS_MIN, OwnScans
from mrol_ros.texts import shown
from mrol_ros.voxel_set import WAITING_MAX, VoxelSet

from .test_mapper import BEGIN_NS, STEP_NS, Robot, cloud, pose, refusal
from .test_parts import Change, State

YEAR_NS = 365 * 86400 * 10**9


def wait_until(is_so):
    end = time.monotonic() + 30
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.005)


def layout(**changes):
    fields = [CloudField(name, 4 * axis, 7) for axis, name in enumerate("xyz")]
    return CloudLayout(
        **{"width": 2, "height": 1, "point_step": 12, "row_step": 24, "is_bigendian": False, "fields": fields, **changes}
    )


@pytest.mark.parametrize("changes", [{"point_step": 2**32 - 1}, {"point_step": 2**31}, {"width": 0, "point_step": 2**32 - 1}])
def test_a_point_of_gigabytes_is_refused_with_its_size(changes):
    with pytest.raises(CloudError, match=f"point_step must be at most {POINT_STEP_MAX} bytes, got"):
        read_cloud(layout(**changes), bytes(24))


def test_names_of_fields_are_told_in_one_short_line():
    fields = [CloudField("a\n[ERROR] all is lost\ud800" + "x" * 65536, 0, 7)] * 50
    with pytest.raises(CloudError) as error:
        read_cloud(layout(fields=fields), bytes(24))
    text = str(error.value)
    assert len(text) < 1000
    assert text.isprintable()


def test_fields_that_overlap_are_read_as_they_say():
    fields = [CloudField("x", 0, 7), CloudField("y", 2, 7), CloudField("z", 0, 8), CloudField("t", 1, 6)]
    found = read_cloud(layout(fields=fields), bytes(24))
    assert found.points.tolist() == [[0, 0, 0]] * 2
    assert not found.returns.any()


def test_a_defect_at_one_cloud_ends_nothing_and_is_told():
    mapped = []

    def fail_first(of):
        mapped.append(of)
        if len(mapped) == 1:
            raise RuntimeError("a number does not fit")

    robot = Robot(on_mapped=fail_first)
    mapping = Thread(target=robot.mapper.run, daemon=True)
    mapping.start()
    robot.mapper.queue.put(cloud(0))
    wait_until(lambda: robot.counts.failed == 1)
    robot.mapper.queue.put(cloud(1))
    wait_until(lambda: len(mapped) == 2)
    robot.mapper.close()
    mapping.join(10)
    assert not mapping.is_alive()
    assert any("a number does not fit" in of for of in robot.notes)


def test_a_stamp_of_another_year_is_left_out_and_one_that_others_follow_is_not():
    robot = Robot()
    requests = robot.step(0, cloud(1, begin_ns=BEGIN_NS + YEAR_NS), 2, 3)
    assert [of["scan_id"] for of in requests] == [BEGIN_NS + k * STEP_NS for k in (0, 2, 3)]
    # What is known of the robot is as before.
    assert "motion" in requests[1]
    assert robot.counts.late == 1
    assert any("8760.0 hours ahead" in of for of in robot.notes)
    ahead = [cloud(k, begin_ns=BEGIN_NS + YEAR_NS) for k in (5, 6, 7)]
    assert [of["scan_id"] for of in robot.step(*ahead)][3:] == [of.stamp_ns for of in ahead[1:]]
    # Nor does one of 1970 change the session in which scans are numbered.
    robot = Robot()
    requests = robot.step(0, cloud(0, begin_ns=1), 1)
    assert [(of["session"], of["scan_id"]) for of in requests] == [("ros2", BEGIN_NS), ("ros2", BEGIN_NS + STEP_NS)]
    simulated = [cloud(k, begin_ns=1) for k in (1, 2, 3)]
    requests = robot.step(*simulated)[2:]
    assert [of["scan_id"] for of in requests] == [of.stamp_ns for of in simulated[1:]]
    assert all(of["session"].startswith("ros2-") for of in requests)


def test_stamps_ahead_of_the_clock_do_not_take_the_maps_frame_along():
    correction = Correction(200)
    now_ns = BEGIN_NS
    here = pose(0)
    assert correction.update(now_ns - 50, here, here, now_ns).stamp_ns == now_ns + 150
    ahead = correction.update(now_ns + YEAR_NS, here, here, now_ns)
    assert ahead.stamp_ns == now_ns + 200 + AHEAD_MAX_NS
    assert correction.ahead_ns == YEAR_NS
    # It goes on as soon as that time is there.
    later_ns = now_ns + 2 * AHEAD_MAX_NS
    assert correction.keep_alive(later_ns, 50).stamp_ns == later_ns + 200
    correction.update(later_ns, here, here, later_ns)
    assert correction.ahead_ns == 0
    # Nothing is known of a simulated clock that nobody publishes.
    assert Correction(200).update(now_ns, here, here, 0).stamp_ns == now_ns + 200


def at(x):
    return (x, 0, 0, 0, 0, 0, 1)


def test_frames_that_two_publishers_tell_differently_are_named():
    frames = FrameTree()
    frames.fix("base_link", "lidar", at(0.2))
    frames.fix("base_link", "lidar", at(0.2004))
    frames.note("odom", "base_link", 0, at(0))
    assert frames.contradictions("lidar") == []
    frames.fix("base_link", "lidar", at(0.5))
    frames.note("odom_combined", "base_link", 1, at(0))
    frames.note("base_link", "lidar", 1, at(0))
    of_lidar, of_base = frames.contradictions("lidar")
    assert "frame 'base_link' hangs on 'odom' and on 'odom_combined'" in of_base
    assert "frame 'lidar' is told by /tf and by /tf_static in 'base_link'" in of_lidar
    frames.fix("base_link", "lidar", at(0.9))
    assert "'lidar' is fixed in 'base_link' at two poses, 0.400 m and 0.0 degrees apart" in frames.contradictions("lidar")[0]
    # Of other frames nothing is said.
    frames.fix("base_link", "camera", at(0))
    assert frames.contradictions("camera") == [of_base]


def test_all_frames_together_keep_so_many_poses():
    frames = FrameTree()
    for k in range(POSES_MAX):
        frames.note("odom", "base_link", k * 10**5, at(k))
    for joint in range(300):
        for k in range(TREE_POSES_MAX // 200):
            frames.note("base_link", f"joint{joint}", k * 10**5, at(k))
    assert frames.poses() <= TREE_POSES_MAX
    # The newest of each are there.
    assert frames.transform("odom", "base_link", (POSES_MAX - 1) * 10**5).translation_m[0] == POSES_MAX - 1


@pytest.mark.parametrize("topic", ["", "odom"])
def test_two_publishers_of_one_odometry_are_told_and_one_that_begins_anew_is_not(topic):
    robot = Robot(has_odometry=False, options=Options(resolution=0.0, odometry_topic=topic))

    def drive(begin, end, other_m, from_m=0.0):
        for k in range(begin, end):
            # The second one tells of the time half a step later.
            for x, half in ((from_m + 0.01 * k, 0), (from_m + 0.01 * k + other_m, 1)):
                stamp_ns, seven = BEGIN_NS + (2 * k + half) * 10_000_000, (x, 0, 0, 0, 0, 0, 1)
                if topic:
                    robot.odometry.note_pose("odom", "base_link", stamp_ns, seven)
                else:
                    robot.odometry.note_transform("odom", "base_link", stamp_ns, seven, is_static=False)

    drive(0, 50, 0.0)
    drive(50, 100, 0.0, from_m=10.0)
    assert robot.odometry.contradictions("lidar") == []
    drive(100, 110, 5.0, from_m=10.0)
    assert robot.odometry.contradictions("lidar") == ["frame 'base_link' jumps to and fro in 'odom': do two publishers tell of it?"]
    drive(110, 700, 0.0, from_m=10.0)
    assert robot.odometry.contradictions("lidar") == []


def test_changes_that_nobody_asks_for_take_no_more_than_the_voxels():
    copied = VoxelSet()
    copied.take(State([[5, 5, 5]]))
    rng = np.random.default_rng(7)
    expected = {(5, 5, 5)}
    for revision in range(2, 200):
        removed, added = rng.integers(-6, 6, (2, WAITING_MAX // 20, 3))
        copied.take(Change(revision, removed, added))
        expected = (expected - set(map(tuple, removed.tolist()))) | set(map(tuple, added.tolist()))
        assert copied.waiting <= WAITING_MAX + WAITING_MAX // 10
    assert set(map(tuple, copied.indices().tolist())) == expected


def test_a_covariance_that_is_none_is_refused_and_does_not_hold_the_robot_up():
    bad = np.diag([1.0] * 6)
    bad[0, 1] = bad[1, 0] = 1000.0
    lopsided = np.diag([1.0] * 6)
    lopsided[0, 1] = 0.5
    for covariance in (bad, lopsided):
        with pytest.raises(ValueError, match="covariance of an initial pose must be"):
            guess_covariance(covariance)
    robot = Robot(*[refusal(mrol.InvalidArgument, "bad_pose", 400)] * INITIAL_POSE_TRIES, None)
    robot.mapper.guesses.begin_at(InitialPose(pose(1e9)))
    requests = robot.step(*range(INITIAL_POSE_TRIES + 1))
    assert [("guess" in of) for of in requests] == [True] * INITIAL_POSE_TRIES + [False]
    assert any("counts no more" in of for of in robot.notes)


def test_an_initial_pose_is_by_the_robots_clock_and_clouds_by_the_sensors():
    robot = Robot(options=Options(resolution=0.0, time_offset_s=37.0))
    robot.mapper.guesses.begin_at(InitialPose(pose(5, 5), None, BEGIN_NS + STEP_NS))
    guess = robot.step(cloud(3, begin_ns=BEGIN_NS - 37 * 10**9))[-1]["guess"]
    # It drove 0.2 m since, and its lidar is 1 m ahead.
    assert guess.translation_m.round(9).tolist() == [6.2, 5, 0]
    assert robot.odometry.time_of(BEGIN_NS) == BEGIN_NS + 37 * 10**9


def test_a_server_that_gives_a_new_reason_each_time_fills_no_memory_and_no_log():
    robot = Robot(*[refusal(mrol.FailedPrecondition, f"reason{k}" + "x" * 100_000) for k in range(3 * NOTED_MAX)])
    robot.step(*range(3 * NOTED_MAX))
    assert len(robot.notes) <= NOTED_MAX + 2
    assert max(map(len, robot.notes)) < 1000
    assert len(robot.mapper.state.left_out) < 1000


def diagnosed(robot, own=None):
    feed = SimpleNamespace(error="", revision=1, grid_revision=1, outside=0)
    return Diagnosis(robot.mapper, feed, robot.odometry, own or OwnScans("r1"))


def test_clouds_that_are_all_left_out_are_not_said_to_be_mapped():
    for script, clouds, words in [
        ([refusal(mrol.InvalidArgument, "empty_scan", 400)] * 3, [0, 1, 2], "the server does not take clouds: it is empty_scan"),
        ([None], [5, 5, 5, 5], "stamps are not later"),
        ([], [cloud(k, frame="") for k in range(3)], "clouds cannot be read: its header must name a frame"),
    ]:
        robot = Robot(*script)
        diagnosis = diagnosed(robot)
        for of in clouds:
            robot.mapper.queue.put(of)
            robot.step(robot.mapper.queue.take(0))
        _, level, text, _ = diagnosis.statuses(1)[0]
        assert level in ("warn", "error")
        assert words in text


def test_clouds_that_never_came_are_told():
    robot = Robot()
    diagnosis = diagnosed(robot)
    diagnosis.statuses(1)
    for number in (1, 2, 5):
        robot.mapper.lost.see(number)
    robot.mapper.queue.put(cloud(0))
    robot.step(robot.mapper.queue.take(0))
    _, level, text, values = diagnosis.statuses(1)[0]
    assert (level, values["lost"]) == ("warn", "2")
    assert "2 never came" in text


def test_what_diagnostics_say_is_short_and_can_be_sent():
    robot = Robot("\ud800\0\n" * 100_000)
    robot.mapper.queue.put(cloud(0))
    robot.step(robot.mapper.queue.take(0))
    for _, _, text, values in diagnosed(robot).statuses(1):
        for of in (text, *map(str, values.values())):
            assert len(of) < 2000
            assert of.isprintable()
            of.encode()
    assert shown("a" * 50, 10) == "aaaaaaaaaa..."


def scan(robot, scan_id, session="ros2"):
    return mrol.WatchedScan(robot, session, scan_id, None, Pose.identity(), 0)


def test_another_program_under_the_robots_name_is_told_and_own_scans_are_not():
    now = [0.0]
    own = OwnScans("r1", lambda: now[0])
    robot = Robot()
    robot.mapper.own_scans = own
    robot.step(0, 1, 2)
    for k in range(3):
        own.see(scan("r1", BEGIN_NS + k * STEP_NS))
        own.see(scan("r2", k))
    # One that was under way as this node began.
    own.see(scan("r1", BEGIN_NS - STEP_NS))
    assert own.stranger() == ""
    for k in range(STRANGERS_MIN):
        own.see(scan("r1", BEGIN_NS + k * STEP_NS + 7))
    assert "another program sends scans as robot 'r1'" in own.stranger()
    diagnosis = diagnosed(robot, own)
    robot.mapper.queue.put(cloud(3))
    _, level, text, _ = diagnosis.statuses(1)[0]
    assert level == "error"
    assert "another program" in text
    now[0] = 60.0
    assert own.stranger() == ""


def test_what_is_broken_in_the_maps_events_ends_no_thread(monkeypatch):
    monkeypatch.setattr(map_feed_module, "PAUSE_S", 0.01)
    seen = []

    def level():
        seen.append(1)
        raise RuntimeError(f"defect {len(seen)}")

    link = SimpleNamespace(level=level, forget_map=lambda: None)
    feed = MapFeed(Options(), link, lambda _: None, lambda _: None, lambda: False, own_scans=OwnScans("r1"))
    others = set(threading.enumerate())
    feed.start()
    wait_until(lambda: len(seen) > 3)
    assert "defect" in feed.error
    assert len(set(threading.enumerate()) - others) == 2
    feed.close()
    assert not set(threading.enumerate()) - others


class EventsMap:
    """A map whose watch tells of one state."""

    def __init__(self, indices):
        self._state = State(indices)

    @contextmanager
    def watch(self, delta_level):
        yield (of for of in [self._state])


def test_voxels_at_both_ends_of_the_lattice_have_no_free_ones_told():
    end = (1 << 20) - 1
    m = EventsMap([[-end, -end, -end], [end, end, end]])
    link = SimpleNamespace(map=lambda: m, level=lambda: (0, 0.1))
    options = Options(octomap_free_level=0, publish_grid=False)
    feed = MapFeed(options, link, lambda _: None, lambda _: None, lambda: False, own_scans=OwnScans("r1"))
    feed.start()
    wait_until(lambda: feed.revision is not None)
    with pytest.raises(mrol.MrolError, match="octomap_free_level must be coarser"):
        feed.read_voxels()
    feed.close()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"transform_period_s": 1e-300}, "transform_period_s must be 0.001 to 60 s, got 1e-300"),
        ({"transform_period_s": 1e300}, "transform_period_s must be 0.001 to 60 s, got 1e+300"),
        ({"transform_tolerance": 1e300}, "transform_tolerance must be 0 to 3600 s, got 1e+300"),
        ({"request_timeout_s": 1e300}, "request_timeout_s must be 0.01 to 3600 s, got 1e+300"),
        ({"request_timeout_s": 1e-300}, "request_timeout_s must be 0.01 to 3600 s, got 1e-300"),
        ({"time_offset_s": 1e300}, "time_offset_s must be -1e+10 to 1e+10 s, got 1e+300"),
        ({"frame_id": "x" * 65536}, "frame_id must name a frame in 1 to 256 printable bytes, got"),
        ({"odom_frame": ""}, "odom_frame must name a frame in 1 to 256 printable bytes, got"),
        ({"base_frame_id": "a\nb"}, "base_frame_id must name a frame in 1 to 256 printable bytes, got"),
        ({"frame_prefix": "x" * 300}, "odom_frame must name a frame in 1 to 256 printable bytes, got"),
        ({"odom_frame": "map", "publish_tf": True}, "odom_frame must be another frame than frame_id, got map"),
        ({"base_frame_id": "odom"}, "base_frame_id must be another frame than odom_frame, got odom"),
    ],
)
def test_absurd_parameters_are_refused_with_the_limit(values, words):
    with pytest.raises(OptionError) as error:
        Options.of(values)
    assert words in str(error.value)
    assert len(str(error.value)) < 400


def test_a_cloud_of_no_points_or_of_nan_is_the_servers_to_refuse():
    robot = Robot(refusal(mrol.InvalidArgument, "empty_scan", 400), refusal(mrol.InvalidArgument, "empty_scan", 400), None)
    fields = cloud(0).layout.fields
    none = StampedCloud(BEGIN_NS, "lidar", CloudLayout(0, 1, 12, 0, False, fields), b"")
    nan = StampedCloud(
        BEGIN_NS + STEP_NS, "lidar", CloudLayout(10, 1, 12, 120, False, fields), np.full((10, 3), np.nan, "<f4").tobytes()
    )
    assert len(robot.step(none, nan, 2)) == 3
    assert (robot.counts.accepted, robot.counts.not_sent) == (1, 2)
