"""The rules of `crates/logs` are followed: case by case those of the tables that its tests read, too."""

import math
from pathlib import Path

import numpy as np
import pytest
from mrol import Pose

from mrol_ros.clouds import Cloud
from mrol_ros.frames import NoTransform, Track
from mrol_ros.gravity import GravityWindow
from mrol_ros.point_times import NoTimes, TimesRule, find_rule, times_s

TABLES = Path(__file__).resolve().parents[4] / "crates/logs/tests/fixtures/rules"
MS = 1_000_000

WORDS = {
    "all_equal": "at all points",
    "no_unit": "in none of s, ms, us, ns",
    "not_finite": "a time that is no number",
    "two_origins": "too near each other to tell",
    "too_far": "1.5 s are believed",
}
"""What the sentence says for each reason of the table."""


def rows(name, joined=1):
    """The rows of a table, the last so many columns of each as one."""
    lines = [line for line in (TABLES / name).read_text().splitlines() if line and not line.startswith("#")]
    found = [[column.strip() for column in line.split(";")] for line in lines]
    assert len(found) > 10
    return [pytest.param(*(of[1:] if joined == 1 else [*of[1:-joined], of[-joined:]]), id=of[0]) for of in found]


def numbers(text):
    return [float(of) for of in text.split()]


def times_of(cloud, stamp_ns, given):
    """The rule and the times of a cloud, or what is said of one without."""
    try:
        rule = find_rule(cloud, stamp_ns)[0] if given == "find" else TimesRule(*given.split(":"))
        return f"{rule.unit}:{rule.origin}", times_s(rule, cloud, stamp_ns)
    except NoTimes as error:
        return str(error), None


@pytest.mark.parametrize(("kind", "stamp_ns", "times", "given", "expected"), rows("point_times.txt", joined=2))
def test_times_of_points_are_those_of_the_shared_table(kind, stamp_ns, times, given, expected):
    make = float if kind[0] == "f" else int
    values = np.array([make(of) for of in times.split()], kind)
    found, found_s = times_of(Cloud(np.ones((len(values), 3), np.float32), values, "t"), int(stamp_ns), given)
    told, seconds = expected
    if found_s is None:
        assert WORDS[told] in found
    else:
        assert found == told
        assert len(found_s) == len(numbers(seconds))
        assert np.abs(found_s - numbers(seconds)).max() < 1.1e-6


@pytest.mark.parametrize(("readings", "time_ms", "turn", "expected"), rows("gravity.txt"))
def test_gravity_is_that_of_the_shared_table(readings, time_ms, turn, expected):
    window = GravityWindow()
    for reading in filter(None, readings.split(",")):
        ms, *acceleration = numbers(reading)
        window.note(round(ms) * MS, acceleration)
    down = window.at(int(time_ms) * MS, Pose.of([0, 0, 0, *numbers(turn)]))
    if expected == "none":
        assert down is None
    else:
        assert np.abs(down / np.linalg.norm(down) - numbers(expected)).max() < 1e-6


def pose(numbers):
    x, y, yaw_deg = numbers
    half = math.radians(yaw_deg) / 2
    return (x, y, 0.0, 0.0, 0.0, math.sin(half), math.cos(half))


@pytest.mark.parametrize(("poses", "time_ms", "beyond_ms", "expected"), rows("tracks.txt"))
def test_frames_are_where_the_shared_table_says(poses, time_ms, beyond_ms, expected):
    track = Track()
    for told in filter(None, poses.split(",")):
        ms, *of = numbers(told)
        track.insert(round(ms) * MS, pose(of))
    try:
        found = track.at(int(time_ms) * MS, int(beyond_ms) * MS)
    except NoTransform:
        assert expected == "none"
    else:
        assert expected != "none"
        assert np.abs(found.matrix - Pose.of(pose(numbers(expected))).matrix).max() < 1e-6
