"""The node among publishers, callers and servers that do what they should not."""

import ctypes
import math
import signal
import time
from array import array
from itertools import count
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from rclpy.clock import ClockType
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import Imu, PointCloud2, PointField
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

from mrol_ros.callbacks import spin
from mrol_ros.messages import STAMP_MAX_NS, stamp_ns_of, stamp_of
from mrol_ros.node import MrolNode

from .proxy import Proxy
from .support import LATCHED, RELIABLE, NodeProcess, Robot, call, running, stamp, wait_until
from .test_node import CLOUDS, check_scans

LONG = "x" * 65536
YEAR_NS = 365 * 86400 * 10**9
LOG_MAX = 100_000
GROWTH_MAX_MIB = 100


def memory_mib(pid):
    """Resident memory of a process."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024


def threads(pid):
    """Threads of a process."""
    return len(list(Path(f"/proc/{pid}/task").iterdir()))


def cloud(stamp_ns, *, frame="lidar", data=b"\0" * 24, field_names="xyz", **changes):
    fields = [PointField(name=name, offset=4 * axis, datatype=7, count=1) for axis, name in enumerate(field_names)]
    given = {"height": 1, "width": 2, "point_step": 12, "row_step": 24, "fields": fields, **changes}
    message = PointCloud2(data=array("B", data), **given)
    message.header.frame_id, message.header.stamp = frame, stamp(stamp_ns)
    return message


def hostile_clouds(stamp_ns):
    """Clouds that are none, or nearly."""
    overlapping = [PointField(name=name, offset=at, datatype=8, count=1) for name, at in (("x", 0), ("y", 1), ("z", 4))]
    outside = [PointField(name=name, offset=2**32 - 4, datatype=7, count=1) for name in "xyz"]
    nan = np.full((2, 3), np.nan, "<f4").tobytes()
    return [
        cloud(stamp_ns, width=0, data=b"", row_step=0),
        cloud(stamp_ns, width=2**16, height=2**15),
        cloud(stamp_ns, width=2**31),
        cloud(stamp_ns, width=2**32 - 1, height=2**32 - 1),
        cloud(stamp_ns, point_step=2**32 - 1),
        cloud(stamp_ns, width=0, point_step=2**32 - 1),
        cloud(stamp_ns, row_step=2**32 - 1, height=2**20),
        cloud(stamp_ns, fields=overlapping),
        cloud(stamp_ns, fields=outside),
        cloud(stamp_ns, fields=[]),
        cloud(stamp_ns, fields=[PointField(name=LONG, offset=0, datatype=77)] * 20),
        cloud(stamp_ns, data=nan),
        cloud(stamp_ns, frame=LONG),
        cloud(stamp_ns, frame=""),
        cloud(stamp_ns, frame="nowhere\n[FATAL] all is lost"),
        cloud(stamp_ns + YEAR_NS),
        cloud(STAMP_MAX_NS),
        cloud(0),
        cloud(1),
    ]


def transform(parent, child, stamp_ns, x=0.0, w=1.0):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, stamp(stamp_ns)
    message.transform.translation.x, message.transform.rotation.w = x, w
    return message


def hostile_transforms(stamp_ns):
    """A circle, names of 64 kB, numbers that are none, stamps of another year, and more frames than there may be."""
    found = [
        transform("lidar", "odom", stamp_ns),
        transform("lidar", "lidar", stamp_ns),
        transform(LONG, "lidar2", stamp_ns),
        transform("base_link", LONG, stamp_ns),
        transform("base_link", "", stamp_ns),
        transform("base_link", "nan", stamp_ns, math.nan),
        transform("base_link", "inf", stamp_ns, math.inf),
        transform("base_link", "nought", stamp_ns, w=0.0),
        transform("base_link", "arm", stamp_ns + YEAR_NS),
        transform("base_link", "arm", stamp_ns - YEAR_NS),
        transform("base_link", "arm", STAMP_MAX_NS),
        transform("base_link", "arm", 0),
    ]
    return found + [transform("base_link", f"f{k}", stamp_ns) for k in range(1100)]


def hostile_pose(stamp_ns, frame="map", x=0.0, variance=0.1, covariance=0.0):
    message = PoseWithCovarianceStamped()
    message.header.frame_id, message.header.stamp = frame, stamp(stamp_ns)
    message.pose.pose.position.x, message.pose.pose.orientation.w = x, 1.0
    message.pose.covariance[0], message.pose.covariance[1] = variance, covariance
    return message


def test_no_message_and_no_caller_ends_the_node_or_fills_its_memory_or_log(server, tmp_path):
    robot = Robot(hz=4.0)
    robot.start()
    node = NodeProcess(tmp_path, server, robot="r1", imu_topic="imu", **CLOUDS)
    clouds = robot.node.create_publisher(PointCloud2, "points", RELIABLE)
    frames = robot.node.create_publisher(TFMessage, "/tf", 100)
    fixed = robot.node.create_publisher(TFMessage, "/tf_static", LATCHED)
    imu = robot.node.create_publisher(Imu, "imu", 100)
    pauses = robot.node.create_client(SetBool, "/pause")
    resets = robot.node.create_client(Trigger, "/reset")
    with running(robot, node):
        wait_until(lambda: len(robot.poses) >= 8, 150, "poses")
        before_mib, before_threads = memory_mib(node.pid), threads(node.pid)
        for _ in range(3):
            now_ns = time.time_ns()
            for message in hostile_clouds(now_ns):
                clouds.publish(message)
                time.sleep(0.05)
            frames.publish(TFMessage(transforms=hostile_transforms(now_ns)))
            fixed.publish(TFMessage(transforms=hostile_transforms(now_ns)[:12]))
            for seven in (math.nan, math.inf, 1e300):
                message = Imu()
                message.header.frame_id, message.header.stamp = LONG, stamp(now_ns)
                message.linear_acceleration.z = seven
                imu.publish(message)
            for bad in ({"frame": LONG}, {"x": math.nan}, {"variance": -1.0}, {"covariance": 1000.0}, {"variance": math.inf}):
                for _ in range(20):
                    robot.initial.publish(hostile_pose(now_ns, **bad))
            for _ in range(300):
                resets.call_async(Trigger.Request())
                pauses.call_async(SetBool.Request(data=False))
            time.sleep(1)
        after = len(robot.poses)
        wait_until(lambda: len(robot.poses) >= after + 8, 150, "poses after all that")
        text = robot.status("clouds")
        assert text[0] in (0, 1), text
        assert int(text[2]["failed"]) == 0, node.log.read_text()[-3000:]
        assert threads(node.pid) <= before_threads + 5
        assert memory_mib(node.pid) - before_mib < GROWTH_MAX_MIB
        assert call(SetBool, "/pause", SetBool.Request(data=True)).success
        time.sleep(2)
        check_scans(robot, server)
        # In the right place: each scan is where the robot was.
        began = robot.map_from_base(0)
        for message in robot.poses[-5:]:
            true = began.inverse() @ robot.map_from_base(robot.seconds_of(stamp_ns_of(message.header.stamp)))
            p = message.pose.pose.position
            assert math.hypot(p.x - true.translation_m[0], p.y - true.translation_m[1]) < 0.3
    log = node.log.read_text()
    assert "callback failed" not in log
    assert "Traceback" not in log
    assert len(log) < LOG_MAX
    assert "[FATAL] all is lost" not in [line.strip() for line in log.splitlines()]


ANSWERS = {
    "garbage": b"\xff\x00garbage" * 100,
    "of another page": b"HTTP/1.1 200 OK\r\ncontent-length: 5\r\ncontent-type: text/html\r\n\r\nhello",
    "a redirection": b"HTTP/1.1 302 Found\r\nlocation: http://127.0.0.1:1/\r\ncontent-length: 0\r\n\r\n",
    "a defect": b"HTTP/1.1 500 Internal Server Error\r\ncontent-length: 4\r\n\r\noops",
    "of a proxy": b"HTTP/1.1 502 Bad Gateway\r\ncontent-length: 0\r\n\r\n",
    "a text that ROS cannot send": (
        b"HTTP/1.1 409 Conflict\r\ncontent-length: 69\r\n\r\n"
        b'{"code":"conflict","reason":"\\ud800\\u0000","detail":"\\udfff\\n odd  "}'
    ),
    "a length that is claimed": b"HTTP/1.1 200 OK\r\ncontent-length: 99999999999\r\n\r\n",
    "nothing": b"",
}


def answering(answer):
    """A connection's treatment: each request gets these bytes."""

    def treat(client):
        client.settimeout(10)
        while client.recv(1 << 20):
            client.sendall(answer)
            if not answer:
                return

    return treat


def slow(client):
    """A byte each fifth of a second."""
    client.recv(1 << 20)
    for byte in b"HTTP/1.1 200 OK\r\n" + b"x: y\r\n" * 1000:
        client.sendall(bytes([byte]))
        time.sleep(0.2)


def test_no_answer_of_a_server_ends_the_node_and_all_is_well_when_it_is_itself_again(server, tmp_path):
    robot, proxy = Robot(), Proxy(server)
    robot.start()
    node = NodeProcess(tmp_path, proxy, robot="r1", request_timeout_s=2.0, **CLOUDS)
    with running(proxy, robot, node):
        wait_until(lambda: len(robot.poses) >= 5, 150, "poses")
        before_mib = memory_mib(node.pid)
        for name, treat in {**{name: answering(answer) for name, answer in ANSWERS.items()}, "slowly": slow}.items():
            began_ns = time.time_ns()
            proxy.treat(treat)
            wait_until(lambda: (robot.status("server") or (0,))[0] == 2, 30, f"diagnostics of {name}")
            time.sleep(2)
            assert sum(of[0] > began_ns for of in list(robot.corrections)) >= 5, name
            proxy.treat(None)
            after = len(robot.poses)
            wait_until(lambda after=after: len(robot.poses) >= after + 3, 150, f"poses after {name}")
        assert int(robot.status("clouds")[2]["failed"]) == 0
        assert memory_mib(node.pid) - before_mib < GROWTH_MAX_MIB
        assert call(SetBool, "/pause", SetBool.Request(data=True)).success
        time.sleep(2)
        check_scans(robot, server)
    log = node.log.read_text()
    assert "callback failed" not in log
    assert "Traceback" not in log
    assert len(log) < LOG_MAX


def test_two_nodes_of_one_name_are_told_of_each_other(server, tmp_path):
    robots = [Robot(namespace=f"/{name}", own_tf=True) for name in "ab"]
    remaps = ("/tf:=tf", "/tf_static:=tf_static")
    nodes = [NodeProcess(tmp_path, server, namespace=of.namespace, remaps=remaps, robot="cart", **CLOUDS) for of in robots]
    with running(*robots, *nodes):
        for robot in robots:
            robot.start()
        for robot in robots:
            wait_until(
                lambda robot=robot: "another program sends scans as robot 'cart'" in (robot.status("clouds") or (0, "", {}))[1],
                150,
                "diagnostics",
            )
    for node in nodes:
        assert node.log.read_text().count("another program sends scans as robot 'cart'") == 1


def test_no_timer_waits_for_a_wall_clock_that_was_set_back():
    rclpy.init(args=["--ros-args", "-p", "server:=127.0.0.1:1"])
    node = MrolNode()
    clocks = [timer.clock.clock_type for timer in node.timers]
    node.close()
    node.destroy_node()
    rclpy.shutdown()
    assert clocks == [ClockType.STEADY_TIME] * 2


def test_ctrl_c_ends_the_node_while_the_server_says_nothing(server, tmp_path):
    robot, proxy = Robot(), Proxy(server)
    robot.start()
    node = NodeProcess(tmp_path, proxy, robot="r1", request_timeout_s=600.0, **CLOUDS)
    with running(proxy, robot, node):
        wait_until(lambda: len(robot.poses) >= 2, 150, "poses")
        proxy.freeze()
        time.sleep(2)
        assert node.stop() == 0
    assert "Traceback" not in node.log.read_text()


def test_a_signal_that_another_thread_gets_ends_the_node(server, tmp_path):
    robot = Robot()
    robot.start()
    node = NodeProcess(tmp_path, server, robot="r1", **CLOUDS)
    with running(robot, node):
        wait_until(lambda: len(robot.poses) >= 2, 150, "poses")
        for thread in Path(f"/proc/{node.pid}/task").iterdir():
            if int(thread.name) != node.pid:
                ctypes.CDLL(None).tgkill(node.pid, int(thread.name), signal.SIGTERM)
        wait_until(lambda: node.has_ended, 30, "the end")
    assert "Traceback" not in node.log.read_text()


def test_a_callback_that_fails_is_told_and_the_others_go_on():
    context = rclpy.Context()
    context.init()
    node = rclpy.create_node("failing", context=context)
    numbers, failures, others, ended = count(), [], Event(), Event()

    def fail():
        if next(numbers) < 3 or ended.is_set():
            raise RuntimeError("a defect")
        others.set()

    node.create_timer(0.01, fail)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    spinning = Thread(target=spin, args=(executor, failures.append, ended), daemon=True)
    spinning.start()
    assert others.wait(20)
    # Where all ends anyway, a callback that fails is not told, and ends it.
    ended.set()
    spinning.join(10)
    assert not spinning.is_alive()
    assert [str(of) for of in failures] == ["a defect"] * 3
    executor.shutdown(timeout_sec=5)
    node.destroy_node()
    context.try_shutdown()


@pytest.mark.parametrize("stamp_ns", [-5, 0, 1, STAMP_MAX_NS, STAMP_MAX_NS + 1, 10**30])
def test_a_time_that_no_stamp_has_is_the_nearest_one(stamp_ns):
    assert stamp_ns_of(stamp_of(stamp_ns)) == min(max(stamp_ns, 0), STAMP_MAX_NS)
