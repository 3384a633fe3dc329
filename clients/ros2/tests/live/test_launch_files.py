"""The nodes of the launch files, started with the arguments that `launch_ros` gives them."""

from contextlib import ExitStack

import numpy as np
import pytest
from nav_msgs.msg import OccupancyGrid

from ..launching import launched
from .support import NodeProcess, Robot, running, take_one, wait_until
from .test_node import scans_of

SHIFT_M = 2.6
"""The places where the file lets robots begin are in the room when they are moved by so much."""


@pytest.mark.parametrize("file", ["one_robot.launch.py", "nav2_static_layer.launch.py"])
def test_one_robot_of_a_launch_file_maps_and_publishes_a_grid(server, tmp_path, file):
    robot = Robot(reliable=True)
    robot.start()
    (described,) = launched(file, server=server.address, map="hall", cloud="/points")
    node = NodeProcess(tmp_path, launched=described)
    with running(robot, node):
        wait_until(lambda: len(robot.poses) >= 3, 150, "poses")
        assert robot.corrections
        assert (np.array(take_one(OccupancyGrid, "/map", 30).data) == 100).any()
        assert len(scans_of(server, "hall")) >= 3
    assert "Traceback" not in node.log.read_text()


def test_three_robots_of_the_launch_file_make_one_map(server, tmp_path):
    described = launched("three_robots.launch.py", server=server.address, map="hall", cloud="points")
    begins = [(node.parameters["initial_pose"][0], node.parameters["initial_pose"][1] - SHIFT_M) for node in described]
    with ExitStack() as stack:
        for node, begin in zip(described, begins, strict=True):
            robot = Robot(namespace=f"/{node.namespace}", begin=begin, own_tf=True, hz=2.0)
            started = NodeProcess(tmp_path, launched=node)
            stack.enter_context(running(robot, started))
            robot.start()
            # The first one decides how the map lies, so that the map is as shifted as it.
            wait_until(lambda robot=robot: len(robot.poses) >= 3, 150, f"poses of {node.namespace}")
            assert "Traceback" not in started.log.read_text()
        assert {scan.robot for scan in scans_of(server, "hall")} == {"r1", "r2", "r3"}
