"""The way of a cloud, with a server that is scripted."""

from types import SimpleNamespace

import mrol
import numpy as np
import pytest
from mrol import Pose

from mrol_ros import mapper as mapper_module
from mrol_ros.clouds import CloudField, CloudLayout, StampedCloud
from mrol_ros.guesses import INITIAL_POSE_TRIES, InitialPose
from mrol_ros.mapper import Mapper
from mrol_ros.odometry import Odometry
from mrol_ros.options import Options

BEGIN_NS = 1_700_000_000 * 10**9
STEP_NS = 100_000_000


def pose(x, y=0.0, z=0.0):
    return Pose.of([x, y, z, 0, 0, 0, 1])


def cloud(k, *, frame="lidar", begin_ns=BEGIN_NS):
    fields = [CloudField(name, 4 * axis, 7) for axis, name in enumerate("xyz")]
    data = np.full((10, 3), k + 1, "<f4").tobytes()
    return StampedCloud(begin_ns + k * STEP_NS, frame, CloudLayout(10, 1, 12, 120, False, fields), data)


class ScriptedMap:
    """A map that answers as it is told: an exception is raised, None is an acceptance, a text a refusal."""

    def __init__(self, *script, scans=1):
        self.robots = ()
        self.script = list(script)
        self.scans = scans
        self.requests = []

    def describe(self):
        return SimpleNamespace(scans=self.scans, robots=self.robots)

    def insert(self, points, **arguments):
        self.requests.append(arguments)
        step = self.script.pop(0) if self.script else None
        if isinstance(step, Exception):
            raise step
        verdict = step or "accepted"
        return SimpleNamespace(accepted=step is None, verdict=verdict, reason=f"it is {verdict}", map_from_sensor=pose(7))

    def with_timeout(self, _):
        return self

    def localize(self, _, gravity_in_sensor=None):
        return SimpleNamespace(map_from_sensor=pose(30), verdict="accepted", reason="it fits")


class Robot:
    """A mapper with a robot that drives 1 m/s, whose lidar is 1 m ahead of its base."""

    def __init__(self, *script, scans=1, has_odometry=True, options=None, is_simulated=False, on_mapped=None):
        self.map = ScriptedMap(*script, scans=scans)
        self.notes, self.mapped, self.forgotten = [], [], 0
        self.link = SimpleNamespace(map=lambda: self.map, forget_map=self._forget)
        options = options or Options(resolution=0.0)
        # No time passes: what is not there is not waited for.
        self.odometry = Odometry(options, now_s=iter(range(10**9)).__next__)
        self.odometry.note_transform("base_link", "lidar", 0, pose(1).seven(), is_static=True)
        if has_odometry:
            for k in range(30):
                stamp_ns = BEGIN_NS + k * STEP_NS
                self.odometry.note_transform("odom", "base_link", stamp_ns, pose(0.1 * k).seven(), is_static=False)
        self.mapper = Mapper(
            options,
            self.link,
            self.odometry,
            on_mapped or self.mapped.append,
            self.notes.append,
            robot="r1",
            is_simulated=is_simulated,
        )

    def _forget(self):
        self.forgotten += 1

    def step(self, *clouds):
        for of in clouds:
            self.mapper.step(cloud(of) if isinstance(of, int) else of)
        return self.map.requests

    @property
    def counts(self):
        return self.mapper.state.counts


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch):
    monkeypatch.setattr(mapper_module, "PAUSE_S", 0.0)


def lost(scan_id=1):
    error = mrol.ConnectionLost("it broke")
    error.repeat_with = {"session": "ros2", "scan_id": scan_id}
    return error


def refusal(kind, reason, status=409):
    return kind(status, "code", reason, f"it is {reason}")


def test_the_guess_is_the_motion_since_the_last_accepted_cloud():
    robot = Robot(None, "low_overlap", None)
    requests = robot.step(0, 1, 3)
    assert "motion" not in requests[0]
    assert "guess" not in requests[0]
    assert requests[1]["motion"].translation_m.round(9).tolist() == [0.1, 0, 0]
    assert requests[2]["motion"].translation_m.round(9).tolist() == [0.3, 0, 0]
    assert (robot.counts.accepted, robot.counts.refused) == (2, 1)
    assert [of.answer.accepted for of in robot.mapped] == [True, False, True]


def test_scans_are_numbered_by_their_stamps_in_a_session_that_stays():
    requests = Robot().step(0, 1)
    assert [of["scan_id"] for of in requests] == [BEGIN_NS, BEGIN_NS + STEP_NS]
    assert {of["session"] for of in requests} == {"ros2"}
    assert requests[0]["timestamp_ns"] == BEGIN_NS
    again = Robot().step(0)
    assert (again[0]["session"], again[0]["scan_id"]) == ("ros2", BEGIN_NS)


def test_stamps_of_a_simulated_clock_are_in_a_session_of_each_start():
    sessions = {Robot(is_simulated=True).step(0)[0]["session"] for _ in range(3)}
    sessions |= {Robot().step(cloud(5, begin_ns=0))[0]["session"] for _ in range(3)}
    assert len(sessions) == 6
    assert all(session.startswith("ros2-") for session in sessions)
    assert Robot(options=Options(session="run 7"), is_simulated=True).step(0)[0]["session"] == "run 7"


def test_a_lost_answer_is_asked_for_again_by_the_same_number_and_guess():
    robot = Robot(None, lost(), mrol.ConnectFailed("nobody there"), refusal(mrol.Unavailable, "starting", 503), None)
    requests = robot.step(0, 1)
    assert len(requests) == 5
    assert all(of == requests[1] for of in requests[2:])
    assert requests[1]["motion"] is requests[4]["motion"]
    assert (robot.counts.accepted, robot.counts.repeated, robot.counts.not_sent) == (2, 3, 0)
    assert robot.mapper.state.server_error == ""


def test_a_cloud_that_was_never_sent_gives_way_to_the_next():
    robot = Robot(mrol.ConnectFailed("nobody there"), refusal(mrol.ResourceExhausted, "overloaded", 429), None)
    requests = robot.step(0, 1)
    assert robot.mapper.state.server_error
    requests = robot.step(2)
    assert [of["scan_id"] for of in requests] == [BEGIN_NS + k * STEP_NS for k in (0, 1, 2)]
    assert (robot.counts.accepted, robot.counts.not_sent) == (1, 2)
    assert robot.mapper.state.server_error == ""


def test_a_cloud_that_an_earlier_run_has_sent_is_left():
    robot = Robot(refusal(mrol.Conflict, "scan_id_taken"), None)
    assert len(robot.step(0, 1)) == 2
    assert (robot.counts.accepted, robot.counts.not_sent) == (1, 1)


def test_a_map_that_was_deleted_is_looked_up_again():
    robot = Robot(None, refusal(mrol.NotFound, "map_not_found", 404), None)
    requests = robot.step(0, 1, 2)
    assert robot.forgotten == 1
    assert "motion" not in requests[2]


def test_a_robot_without_a_pose_is_told_what_to_do():
    robot = Robot(refusal(mrol.FailedPrecondition, "guess_required"), refusal(mrol.FailedPrecondition, "guess_required"))
    robot.step(0, 1)
    assert robot.mapper.state.needs_pose
    assert sum("initialpose" in of for of in robot.notes) == 1
    robot.mapper.guesses.begin_at(InitialPose(pose(5, 5), None, BEGIN_NS + STEP_NS))
    guess = robot.step(3)[-1]["guess"]
    # It drove 0.2 m since, and its lidar is 1 m ahead.
    assert guess.translation_m.round(9).tolist() == [6.2, 5, 0]
    assert not robot.mapper.state.needs_pose


def test_an_empty_map_lies_as_the_odometrys_frame():
    assert Robot(scans=0).step(5)[0]["guess"].translation_m.round(9).tolist() == [1.5, 0, 0]
    assert Robot(scans=0, has_odometry=False).step(5)[0]["guess"].translation_m.round(9).tolist() == [1, 0, 0]
    far = Robot(scans=0)
    far.odometry.note_transform("odom", "base_link", BEGIN_NS, pose(5000).seven(), is_static=False)
    assert far.step(0)[0]["guess"].translation_m.round(9).tolist() == [1, 0, 0]


def test_an_initial_pose_counts_until_a_cloud_is_accepted_or_many_are_refused():
    robot = Robot("low_overlap", None, None, options=Options(initial_pose=[2.0, 0, 0, 0, 0, 0, 1]))
    requests = robot.step(0, 1, 2)
    assert [("guess" in of) for of in requests] == [True, True, False]
    known = Robot(options=Options(initial_pose=[2.0, 0, 0, 0, 0, 0, 1]))
    known.map.robots = ("r1", "r2")
    assert "guess" not in known.step(0)[0]
    robot = Robot(*["low_overlap"] * (INITIAL_POSE_TRIES + 1))
    covariance = np.diag([0.25, 0.25, 0, 0, 0, 0.07])
    robot.mapper.guesses.begin_at(InitialPose(pose(2), covariance))
    requests = robot.step(*range(INITIAL_POSE_TRIES + 1))
    assert [("guess_covariance" in of) for of in requests] == [True] * INITIAL_POSE_TRIES + [False]
    assert requests[0]["guess_covariance"][0, 0] == pytest.approx(0.25)
    # What the turn does to the sensor, 1 m ahead.
    assert requests[0]["guess_covariance"][1, 1] == pytest.approx(0.32)
    assert any("counts no more" in of for of in robot.notes)
    with pytest.raises(ValueError, match="covariance"):
        robot.mapper.guesses.begin_at(InitialPose(pose(0), np.full((6, 6), np.nan)))


def test_without_odometry_it_is_constant_velocity_and_said_once():
    robot = Robot(has_odometry=False)
    requests = robot.step(0, 1, 2)
    assert [of.get("constant_velocity") for of in requests] == [None, True, True]
    assert robot.counts.without_odometry == 3
    assert sum("no motion by odometry" in of for of in robot.notes) == 1
    assert "there is no frame 'odom'" in robot.mapper.state.missing


def test_the_guess_after_clouds_without_odometry_is_by_the_frame_of_odometry():
    robot = Robot()
    requests = robot.step(0, 2, 40, 41)
    assert "motion" in requests[1]
    assert requests[2]["constant_velocity"]
    # Odometry is back, and the map knows where its frame is: the server had the lidar at 7 m, where odometry had it at 1.2 m.
    robot.odometry.note_transform("odom", "base_link", BEGIN_NS + 42 * STEP_NS, pose(4.2).seven(), is_static=False)
    guess = robot.step(42)[-1]["guess"]
    assert guess.translation_m.round(9).tolist() == [11, 0, 0]


def test_a_cloud_that_is_not_later_is_left_out_and_a_clock_that_was_set_back_is_told():
    robot = Robot()
    assert len(robot.step(20, 20, 19, 21)) == 2
    assert robot.counts.late == 2
    requests = robot.step(2, 3)
    assert len(requests) == 4
    assert any("went back by 1.9 s" in of for of in robot.notes)
    assert "motion" not in requests[2]
    assert requests[3]["motion"].translation_m.round(9).tolist() == [0.1, 0, 0]
    assert len(robot.step(cloud(0, begin_ns=0), cloud(-1, begin_ns=0))) == 4


def test_nothing_is_sent_while_it_is_paused():
    robot = Robot()
    robot.mapper.is_paused = True
    assert robot.step(0, 1) == []
    robot.mapper.is_paused = False
    assert len(robot.step(2)) == 1
    assert robot.counts.paused == 2


def test_a_cloud_that_cannot_be_read_stops_nothing():
    robot = Robot()
    bad = StampedCloud(BEGIN_NS, "lidar", CloudLayout(10, 1, 12, 120, False, []), b"")
    assert len(robot.step(bad, 1)) == 1
    assert robot.counts.unreadable == 1
    assert "no field 'x'" in robot.notes[0]
    assert len(robot.step(cloud(2, frame=""), cloud(3, frame="x" * 65536), cloud(4, frame="a\nb"), 5)) == 2
    assert robot.counts.unreadable == 4
    assert max(map(len, robot.notes)) < 300


def test_a_place_that_was_found_is_the_next_guess():
    robot = Robot("low_overlap", None)
    assert robot.mapper.localize() == (False, "there was no cloud yet")
    robot.step(0)
    is_found, text = robot.mapper.localize()
    assert is_found
    assert "29.000" in text
    assert robot.step(2)[-1]["guess"].translation_m.round(9).tolist() == [30.2, 0, 0]
