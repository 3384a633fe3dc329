"""The node against a real server, and a simulated robot by real ROS."""

import os
import time
from contextlib import ExitStack
from itertools import pairwise
from types import SimpleNamespace

import mrol
import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from octomap_msgs.msg import Octomap
from octomap_msgs.srv import GetOctomap
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger

from mrol_ros.clouds import read_cloud
from mrol_ros.messages import cloud_of
from mrol_ros.octree import OCCUPIED, octree_cells

from .proxy import Proxy
from .support import BASE_FROM_LIDAR, NodeProcess, Robot, call, running, stamp, take_one, wait_until

TOLERANCE_NS = 3_000_000_000
"""So long that the answer to each cloud comes in time, however busy the machine is."""

OUTAGE_S = float(os.environ.get("MROL_OUTAGE_S", "20"))
"""For so long the network loses all: MROL_OUTAGE_S=120 clients/ros2/check PROGRAM tries two minutes."""

CLOUDS = {"clouds_reliable": True, "grid_period_s": 0.5, "octomap_period_s": 0.5}


EXACT = {**CLOUDS, "transform_tolerance": TOLERANCE_NS * 1e-9}


def scans_of(server, name="map"):
    """The scans of a map, as the server has them: robot, session, id and pose."""
    with mrol.connect(server.address) as client:
        found = client.map(name).trajectory()
        return [
            SimpleNamespace(robot=scan.robot, session=scan.session, scan_id=scan.scan_id, pose=scan.map_from_sensor)
            for scan in found.scans
        ]


def voxels_of_octree(message):
    """The occupied voxels of a tree, at the finest level."""
    found = set()
    for *corner, level, state in octree_cells(message.data.tobytes()).tolist():
        if state == OCCUPIED:
            side = 1 << level
            found |= {tuple(side * c + d for c, d in zip(corner, part, strict=True)) for part in np.ndindex(side, side, side)}
    return found


def test_a_robot_is_where_the_server_says_and_whoever_comes_last_gets_the_map(server, tmp_path):
    robot = Robot()
    # The node starts after the static transforms were sent.
    robot.start()
    time.sleep(1)
    node = NodeProcess(tmp_path, server, robot="r1", **EXACT)
    with running(node, robot):
        wait_until(lambda: len(robot.poses) >= 12, 150, "poses")
        told = robot.status("clouds")
        assert told[1] == "clouds are mapped", told
        assert robot.status("frames")[:2] == (0, "odometry is known")
        assert call(SetBool, "/pause", SetBool.Request(data=True)).success
        time.sleep(1)
        count = len(scans_of(server))
        time.sleep(1)
        assert len(scans_of(server)) == count
        assert robot.status("clouds")[1] == "paused"

        # map -> odom * odom -> base * base -> lidar is what the server has.
        compared = 0
        for scan in scans_of(server):
            correction = robot.correction_of(scan.scan_id, TOLERANCE_NS)
            if correction is not None:
                there = correction @ robot.odom_from_lidar(scan.scan_id)
                assert np.abs(there.matrix - scan.pose.matrix).max() < 1e-6
                compared += 1
        assert compared >= 5
        for message in robot.poses:
            stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            assert message.header.frame_id == "map"
            covariance = np.array(message.pose.covariance).reshape(6, 6)
            assert np.all(np.linalg.eigvalsh(covariance) > 0)
            of_scan = [scan.pose for scan in scans_of(server) if scan.scan_id == stamp_ns]
            for pose in of_scan:
                p = message.pose.pose.position
                assert np.abs((pose @ BASE_FROM_LIDAR.inverse()).translation_m - [p.x, p.y, p.z]).max() < 1e-6

        # Nothing changes any more: what is latched is the map as it is.
        time.sleep(1.5)
        with mrol.connect(server.address) as client:
            m = client.map("map")
            voxels = set(map(tuple, m.voxels().indices.tolist()))
            grid = m.whole_grid(min_z_m=0.1, max_z_m=2.0, tell_unknown=True)
        message = take_one(OccupancyGrid, "/map")
        assert (message.info.height, message.info.width) == grid.occupied.shape
        assert message.info.resolution == pytest.approx(0.1)
        assert [message.info.origin.position.x, message.info.origin.position.y] == pytest.approx(grid.origin_m.tolist())
        cells = np.array(message.data).reshape(grid.occupied.shape)
        assert ((cells == 100) == grid.occupied).all()
        assert ((cells == 0) == (grid.free & ~grid.occupied)).all()
        assert (cells == 100).any()
        assert (cells == 0).any()
        assert voxels_of_octree(take_one(Octomap, "/octomap_binary")) == voxels
        asked = call(GetOctomap, "/octomap_binary", GetOctomap.Request()).map
        assert (asked.id, asked.binary, asked.resolution) == ("OcTree", True, pytest.approx(0.1))
        assert voxels_of_octree(asked) == voxels
        centers = cloud_of(take_one(PointCloud2, "/octomap_point_cloud_centers"))
        points = read_cloud(centers.layout, centers.data).points
        assert set(map(tuple, np.floor(points / 0.1).astype(int).tolist())) == voxels

        assert not call(Trigger, "/reset", Trigger.Request()).success
        assert len(scans_of(server)) == count
        saved = call(Trigger, "/save_map", Trigger.Request())
        assert saved.success, saved.message
        assert (tmp_path / "map.mrol").stat().st_size > 1000
    assert "Traceback" not in node.log.read_text()


def test_three_robots_in_their_namespaces_make_one_map(server, tmp_path):
    begins = {"r1": (0.0, 0.0), "r2": (-1.0, 1.0), "r3": (1.0, -1.5)}
    robots = [Robot(namespace=f"/{name}", begin=begin, own_tf=True, hz=2.0) for name, begin in begins.items()]
    with ExitStack() as stack:
        stack.enter_context(running(*robots))
        for robot in robots:
            robot.start()
        remaps = ("/tf:=tf", "/tf_static:=tf_static")
        for robot, (x, y) in zip(robots, begins.values(), strict=True):
            # The first one decides how the map lies.
            begin = [x, y, 0.0, 0.0, 0.0, 0.0, 1.0]
            node = NodeProcess(tmp_path, server, namespace=robot.namespace, remaps=remaps, map="hall", initial_pose=begin, **EXACT)
            stack.enter_context(running(node))
            wait_until(lambda robot=robot: len(robot.poses) >= 3, 150, f"poses of {robot.namespace}")
        wait_until(lambda: all(len(robot.poses) >= 8 for robot in robots), 150, "poses of all")
        scans = scans_of(server, "hall")
        assert {scan.robot for scan in scans} == set(begins)
        beginnings = []
        for robot, name in zip(robots, begins, strict=True):
            own = [scan for scan in scans if scan.robot == name]
            found = [(scan, robot.correction_of(scan.scan_id, TOLERANCE_NS)) for scan in own]
            compared = [(scan, correction) for scan, correction in found if correction is not None]
            assert len(compared) >= 3
            for scan, correction in compared:
                there = correction @ robot.odom_from_lidar(scan.scan_id)
                assert np.abs(there.matrix - scan.pose.matrix).max() < 1e-6
            beginnings.append(compared[-1][1] @ robot.odom_from_base(0))
        # Their frames have the same names, and none hears of another's: they began beside each other, as they are in the room.
        for beginning, (x, y) in zip(beginnings, begins.values(), strict=True):
            assert np.abs((beginnings[0].inverse() @ beginning).translation_m - [x, y, 0]).max() < 0.3


def test_a_robot_that_the_server_does_not_know_is_placed_by_hand_or_found(server, tmp_path):
    first = Robot()
    node = NodeProcess(tmp_path, server, robot="first", **CLOUDS)
    first.start()
    with running(node, first):
        wait_until(lambda: len(first.poses) >= 5, 150, "poses")
    second = Robot(namespace="/second", begin=(0.5, -0.5), own_tf=True)
    node = NodeProcess(
        tmp_path, server, namespace="/second", remaps=("/tf:=tf", "/tf_static:=tf_static"), allow_reset=True, **CLOUDS
    )
    second.start()
    with running(node, second):
        wait_until(
            lambda: (second.status("clouds") or (0, "", {}))[1].startswith("the server does not know where"), 30, "diagnostics"
        )
        assert second.poses == []
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.header.stamp = "map", stamp(time.time_ns())
        x, y, _, *_, qz, qw = second.map_from_base(second.seconds_of(time.time_ns())).seven()
        message.pose.pose.position.x, message.pose.pose.position.y = x + 0.1, y - 0.1
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = qz, qw
        message.pose.covariance[0] = message.pose.covariance[7] = 0.25
        message.pose.covariance[35] = 0.0685
        second.initial.publish(message)
        wait_until(lambda: len(second.poses) >= 3, 150, "poses after initialpose")
        answer = call(Trigger, "/second/localize", Trigger.Request())
        assert "the robot was at" in answer.message or "ambiguous" in answer.message, answer.message
        call(SetBool, "/second/pause", SetBool.Request(data=True))
        assert call(Trigger, "/second/reset", Trigger.Request()).success
        assert scans_of(server) == []


def test_nothing_is_lost_or_there_twice_when_server_and_node_are_killed(server, tmp_path):
    robot = Robot()
    robot.start()
    node = NodeProcess(tmp_path, server, robot="r1", **CLOUDS)
    with running(robot, node):
        wait_until(lambda: len(robot.poses) >= 5, 150, "poses")
        for _ in range(3):
            server.kill()
            began_ns, count = time.time_ns(), len(robot.poses)
            time.sleep(2)
            # The map's frame stays: transforms go on, each of a later time.
            later = [of for of in list(robot.corrections) if of[0] > began_ns]
            assert len(later) >= 5
            ends = [stamp_ns for _, stamp_ns, _ in later]
            assert ends == sorted(ends)
            assert ends[-1] - ends[0] > 1_000_000_000
            assert all(np.abs(pose.matrix - later[-1][2].matrix).max() == 0 for _, _, pose in later[-3:])
            server.start()
            wait_until(lambda count=count: len(robot.poses) >= count + 5, 150, "poses after the server is back")
        told = robot.status("clouds")[2]
        assert int(told["dropped"]) + int(told["not_sent"]) > 0
        node.kill()
        count = len(robot.poses)
        again = NodeProcess(tmp_path, server, robot="r1", **CLOUDS)
        with running(again):
            wait_until(lambda: len(robot.poses) >= count + 5, 150, "poses after the node is back")
        check_scans(robot, server)
        assert (again.log.read_text() + node.log.read_text()).count("Traceback") == 0


def test_nothing_is_lost_or_there_twice_when_the_network_is_gone(server, tmp_path):
    robot, proxy = Robot(), Proxy(server)
    robot.start()
    node = NodeProcess(tmp_path, proxy, robot="r1", request_timeout_s=1.0, **CLOUDS)
    with running(proxy, robot, node):
        wait_until(lambda: len(robot.poses) >= 5, 150, "poses")
        for _ in range(3):
            proxy.freeze()
            began_ns = time.time_ns()
            time.sleep(3)
            assert sum(of[0] > began_ns for of in list(robot.corrections)) >= 5
            assert robot.status("server")[0] == 2
            proxy.thaw()
            count = len(robot.poses)
            wait_until(lambda count=count: len(robot.poses) >= count + 5, 150, "poses after the network is back")
        assert int(robot.status("clouds")[2]["repeated"]) > 0
        call(SetBool, "/pause", SetBool.Request(data=True))
        time.sleep(2)
        check_scans(robot, server)
    assert "Traceback" not in node.log.read_text()


def test_nothing_is_lost_or_there_twice_when_the_network_loses_all_for_long(server, tmp_path):
    robot, proxy = Robot(), Proxy(server)
    robot.start()
    node = NodeProcess(tmp_path, proxy, robot="r1", request_timeout_s=3.0, **CLOUDS)
    with running(proxy, robot, node):
        wait_until(lambda: len(robot.poses) >= 5, 150, "poses")
        began_ns = time.time_ns()
        proxy.lose()
        time.sleep(OUTAGE_S)
        ended_ns = time.time_ns()
        assert robot.status("server")[0] == 2
        proxy.find()
        count = len(robot.poses)
        wait_until(lambda: len(robot.poses) >= count + 5, 150, "poses after the network is back")
        # The map's frame was there all the time: each transform goes on where the one before it ends.
        told = [of for of in list(robot.corrections) if began_ns - 10**9 < of[0] < ended_ns + 10**9]
        ends = [stamp_ns for _, stamp_ns, _ in told]
        assert ends == sorted(set(ends))
        assert ends[0] < began_ns + 2 * 10**9
        assert ends[-1] > ended_ns - 10**9
        gaps = [later - sooner for sooner, later in pairwise(ends)]
        assert len(ends) > OUTAGE_S, ends
        assert max(gaps) < 2 * 10**9
        assert int(robot.status("clouds")[2]["repeated"]) > 0
        call(SetBool, "/pause", SetBool.Request(data=True))
        time.sleep(2)
        check_scans(robot, server)
    assert "Traceback" not in node.log.read_text()


def check_scans(robot, server):
    """Whether each scan is in the map once, and all that were acknowledged are."""
    acknowledged = {message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for message in list(robot.poses)}
    ids = [(scan.session, scan.scan_id) for scan in scans_of(server)]
    assert len(ids) == len(set(ids))
    assert {session for session, _ in ids} == {"ros2"}
    # A robot that stands still is answered, and its scan is not kept: this one drives.
    assert acknowledged - {scan_id for _, scan_id in ids} == set()
