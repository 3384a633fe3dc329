"""Frames: interpolated, never far beyond what is known."""

import math

import numpy as np
import pytest
from mrol import Pose

from mrol_ros.frames import DEPTH_MAX, EXTRAPOLATION_MAX_NS, FRAMES_MAX, BadTransform, FrameTree, NoTransform, Track
from mrol_ros.motion import share_of_motion

MS = 1_000_000


def arc(ms):
    """Where a body is that drives 2 m/s and turns 1 rad/s."""
    angle = ms * 1e-3
    return (2 * math.sin(angle), 2 * (1 - math.cos(angle)), 0, 0, 0, math.sin(angle / 2), math.cos(angle / 2))


def at(x, y=0.0):
    return (x, y, 0, 0, 0, 0, 1)


def is_same(one, other, most=1e-9):
    return np.abs(one.matrix - Pose.of(other).matrix).max() < most


def test_an_arc_is_followed_between_poses_and_a_tenth_of_a_second_beyond():
    track = Track()
    for ms in (300, 0, 200, 100):
        track.insert(ms * MS, arc(ms))
    for ms in (0, 30, 150, 299, 300):
        assert is_same(track.at(ms * MS, 0), arc(ms)), ms
    for ms in (-100, 400):
        assert is_same(track.at(ms * MS, EXTRAPOLATION_MAX_NS), arc(ms), 0.02), ms
    for ms, beyond_ns in ((301, 0), (-1, 0), (401, EXTRAPOLATION_MAX_NS)):
        with pytest.raises(NoTransform):
            track.at(ms * MS, beyond_ns)


def test_halves_of_a_motion_make_all_of_it():
    rng = np.random.default_rng(3)
    for scale in (1.5, 1e-3, 1e-7, 0):
        turn = rng.normal(size=3) * scale
        angle = np.linalg.norm(turn)
        axis = turn / angle if angle else turn
        quaternion = [*(axis * math.sin(angle / 2)), math.cos(angle / 2)]
        motion = Pose(rng.normal(size=3), quaternion)
        half = share_of_motion(motion, 0.5)
        assert np.abs((half @ half).matrix - motion.matrix).max() < 1e-9
        assert np.abs((motion @ share_of_motion(motion, -1)).matrix - np.eye(4)).max() < 1e-9


def test_a_long_gap_is_not_bridged():
    track = Track()
    track.insert(0, at(0))
    track.insert(3000 * MS, at(1))
    assert track.at(50 * MS, EXTRAPOLATION_MAX_NS)
    with pytest.raises(NoTransform, match=r"1\.000 s from the cloud"):
        track.at(1000 * MS, EXTRAPOLATION_MAX_NS)


def test_a_track_goes_on_after_a_stamp_of_another_year_and_stays_small():
    track = Track()
    for ms in (0, 100, 31_536_000_000, 200, 300):
        track.insert(ms * MS, at(ms))
    assert track.at(250 * MS, 0).translation_m[0] == pytest.approx(250)
    with pytest.raises(NoTransform):
        track.at(100 * MS, 0)
    for k in range(30_000):
        track.insert(k * 10_000, at(0))
    assert len(track.poses) == len(track.stamps_ns) == 10_000


def tree():
    """Two static publishers, and odometry at 10 Hz."""
    frames = FrameTree()
    frames.fix("base_link", "lidar", at(0.2))
    frames.fix("base_link", "camera", at(0.1))
    frames.fix("lidar", "imu", at(0, 0.5))
    for ms in range(0, 1001, 100):
        frames.note("odom", "base_link", ms * MS, at(ms * 1e-3))
    return frames


def test_frames_of_several_publishers_are_one_tree():
    frames = tree()
    assert is_same(frames.transform("odom", "imu", 550 * MS), at(0.75, 0.5))
    assert is_same(frames.transform("camera", "imu", 0), at(0.1, 0.5))
    assert is_same(frames.transform("lidar", "odom", 500 * MS), at(-0.7))
    assert is_same(frames.transform("map", "map", 0), at(0))
    frames.note("base_link", "lidar", 5, at(9))
    assert is_same(frames.transform("base_link", "lidar", 5), at(0.2))
    # Beyond 0.1 s nothing is known, whatever is asked for.
    with pytest.raises(NoTransform, match=r"where 'base_link' is in 'odom' is known 0\.500 s before") as error:
        frames.transform("odom", "lidar", 1500 * MS, 10**12)
    assert error.value.may_come
    with pytest.raises(NoTransform) as error:
        frames.transform("odom", "lidar", 9000 * MS, 0)
    assert not error.value.may_come


def test_what_is_missing_is_named():
    frames = tree()
    with pytest.raises(NoTransform, match="there is no frame 'radar'; there are base_link camera imu lidar odom"):
        frames.transform("odom", "radar", 0)
    frames.fix("elsewhere", "radar", at(0))
    with pytest.raises(NoTransform, match="are not connected: they end at 'odom' and 'elsewhere'"):
        frames.transform("odom", "radar", 0)
    frames.fix("base_link", "radar", at(1))
    assert is_same(frames.transform("base_link", "radar", 0), at(1))


def test_a_hostile_tree_grows_no_further():
    frames = tree()
    with pytest.raises(BadTransform, match="which lies below it"):
        frames.fix("imu", "base_link", at(0))
    with pytest.raises(BadTransform, match="which lies below it"):
        frames.fix("lidar", "lidar", at(0))
    for name in ("", "x" * 257, "a\nb", "y" * 65536):
        with pytest.raises(BadTransform, match="1 to 256 printable bytes"):
            frames.fix("base_link", name, at(0))
    for seven in ((math.nan, 0, 0, 0, 0, 0, 1), (0,) * 7, (math.inf, 0, 0, 0, 0, 0, 1)):
        with pytest.raises(BadTransform, match="numbers that are no pose"):
            frames.fix("base_link", "radar", seven)
    refused = 0
    for k in range(2 * FRAMES_MAX):
        try:
            frames.fix("base_link", f"f{k}", at(0))
        except BadTransform:
            refused += 1
    assert refused == FRAMES_MAX + 4
    deep = FrameTree()
    for k in range(DEPTH_MAX - 1):
        deep.fix(f"d{k}", f"d{k + 1}", at(0))
    with pytest.raises(BadTransform, match=f"{DEPTH_MAX} frames are above it"):
        deep.fix(f"d{DEPTH_MAX - 1}", "deeper", at(0))
    assert len(frames.listed()) < 400


def test_a_quaternion_that_was_rounded_is_made_a_unit_one():
    frames = FrameTree()
    frames.fix("a", "b", (1, 2, 3, 0, 0, 0.7, 0.7))
    assert np.allclose(frames.transform("a", "b", 0).rotation_xyzw, [0, 0, math.sqrt(0.5), math.sqrt(0.5)])
