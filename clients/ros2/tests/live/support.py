"""A real server, the node as a process, and a simulated robot that speaks real ROS."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from array import array
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from mrol import Pose
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2, PointField
from tf2_msgs.msg import TFMessage

from mrol_ros.messages import seven_of_transform, stamp_ns_of, transform_message

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
RELIABLE = QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE)
BASE_FROM_LIDAR = Pose.of([0.3, 0.1, 1.0, 0, 0, math.sin(0.2), math.cos(0.2)])
PACKAGE = Path(__file__).resolve().parents[2]


def wait_until(is_so, seconds, what):
    """Waits until something is so."""
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end, f"{what}: not within {seconds} s"
        time.sleep(0.02)


class Server:
    """A server that can be ended and started again at the same address."""

    def __init__(self, folder):
        self._folder = folder
        self._process = None
        self.address = "127.0.0.1:0"

    def start(self):
        """Starts it, and waits until it takes requests."""
        command = [os.environ["MROL_BINARY"], "serve", "--json", "--log-level", "warn", "--data-dir", str(self._folder / "data")]
        environment = {name: value for name, value in os.environ.items() if not name.startswith(("MROL_", "LD_"))}
        with (self._folder / "log").open("a") as log:
            self._process = subprocess.Popen(
                [*command, "--http-listen", self.address, "--grpc-listen", "127.0.0.1:0"],
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                env=environment,
            )
        line = self._process.stdout.readline()
        assert line, (self._folder / "log").read_text()
        self.address = json.loads(line)["http"]

    def kill(self):
        """Ends it as the loss of power would."""
        if self._process is not None:
            self._process.kill()
            self._process.wait(30)
            self._process.stdout.close()
            self._process = None


class NodeProcess:
    """The node, as `ros2 run mrol_ros node` starts it."""

    def __init__(self, folder, server=None, *, namespace="/", remaps=(), launched=None, **parameters):
        if launched is None:
            arguments = ["-r", f"__ns:={namespace}", "-r", "cloud_in:=points"]
            for remap in remaps:
                arguments += ["-r", remap]
            for name, value in {"server": server.address, "publish_tf": True, **parameters}.items():
                # JSON is what YAML takes, too.
                arguments += ["-p", f"{name}:={json.dumps(value)}"]
        else:
            # As a launch file describes it.
            namespace, arguments = f"/{launched.namespace}", launched.arguments
        self.log = folder / f"node{namespace.replace('/', '-')}.log"
        with self.log.open("a") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "mrol_ros.node", "--ros-args", *arguments], stdout=log, stderr=subprocess.STDOUT, cwd=folder
            )

    @property
    def pid(self):
        """Its process."""
        return self._process.pid

    @property
    def has_ended(self):
        """Whether it runs no more."""
        return self._process.poll() is not None

    def stop(self):
        """Ends it by Ctrl-C; how it ended."""
        if self._process.poll() is not None:
            return self._process.returncode
        self._process.send_signal(signal.SIGINT)
        try:
            return self._process.wait(30)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise

    def kill(self):
        """Ends it as the loss of power would."""
        self._process.kill()
        self._process.wait(30)


def room(map_from_sensor, count, rng):
    """What a sensor sees of a room of 8 x 6 x 3 m with two posts, shape (n, 3), in its frame."""
    unit = rng.uniform(0, 1, (count, 3))
    axis = rng.integers(0, 3, count)
    unit[np.arange(count), axis] = rng.integers(0, 2, count)
    posts = [rng.uniform([x, y, 0], [x, y + 0.6, 3], (count // 20, 3)) for x, y in ((5.0, 2.0), (2.0, 4.5))]
    points = np.concatenate([unit * [8, 6, 3], *posts]) - [4, 3, 0] + rng.normal(0, 0.003, (count + 2 * (count // 20), 3))
    return map_from_sensor.inverse().apply(points).astype(np.float32)


RECORD = {"names": ["p", "i", "t"], "formats": [("<f4", 3), "<f4", "<u4"], "offsets": [0, 16, 20], "itemsize": 32}


def cloud_message(stamp_ns, frame, points, *, has_times):
    """A cloud as a lidar's driver writes it, 32 bytes a point; its times are those of points that were measured nearly at once."""
    records = np.zeros(len(points), np.dtype(RECORD))
    records["p"] = points
    records["t"] = np.linspace(0, 2e6, len(points))
    fields = [
        PointField(name=name, offset=at, datatype=7, count=1) for name, at in (("x", 0), ("y", 4), ("z", 8), ("intensity", 16))
    ]
    message = PointCloud2(height=1, width=len(points), fields=fields, point_step=32, row_step=32 * len(points), is_dense=True)
    if has_times:
        fields.append(PointField(name="t", offset=20, datatype=6, count=1))
    message.header.frame_id = frame
    message.header.stamp = stamp(stamp_ns)

    # Of an array of bytes ROS copies the memory, of anything else number by number.
    message.data = array("B", records.tobytes())
    return message


def stamp(stamp_ns):
    """A stamp."""
    return Time(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)


class Robot:
    """A robot that drives in the room: its odometry begins where it stands, and drifts."""

    CATCH_UP_SHARE = 0.7
    """After a stall clouds come at this share of the period at least: of a robot that seems to stand no scan is kept."""

    def __init__(
        self, *, namespace="", begin=(0.0, 0.0), hz=5.0, points=15_000, own_tf=False, reliable=True, late_s=0.02, has_times=False
    ):
        self.namespace = namespace
        self.context = rclpy.Context()
        self.context.init()
        self.node = rclpy.create_node("robot", namespace=namespace, context=self.context)
        tf = "tf" if own_tf else "/tf"
        self._tf = self.node.create_publisher(TFMessage, tf, 100)
        self._static = self.node.create_publisher(TFMessage, "tf_static" if own_tf else "/tf_static", LATCHED)
        qos = RELIABLE if reliable else QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._clouds = self.node.create_publisher(PointCloud2, "points", qos)
        self.initial = self.node.create_publisher(PoseWithCovarianceStamped, "initialpose", 1)
        self.corrections, self.poses, self.diagnostics = [], [], {}
        self._odom_from_lidar = {}
        self.node.create_subscription(TFMessage, tf, self._on_tf, 100)
        self.node.create_subscription(PoseWithCovarianceStamped, "pose", self.poses.append, 100)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self._begin, self._hz, self._points, self._late_s, self._has_times = begin, hz, points, late_s, has_times
        self._rng = np.random.default_rng(abs(hash(namespace)) % 1000)
        self.sent = 0
        self.is_quiet = False
        self._stop = Event()
        self._began_ns = time.time_ns()
        self._executor = MultiThreadedExecutor(2, context=self.context)
        self._executor.add_node(self.node)
        self._threads = [Thread(target=target, daemon=True) for target in (self._spin, self._drive_tf, self._drive_clouds)]
        self._static.publish(TFMessage(transforms=[transform_message(0, "base_link", "lidar", BASE_FROM_LIDAR)]))

    def _spin(self):
        while not self._stop.is_set():
            self._executor.spin_once(timeout_sec=0.1)

    def _on_tf(self, message):
        for transform in message.transforms:
            if transform.child_frame_id == "odom":
                at_ns = time.time_ns()
                self.corrections.append((at_ns, stamp_ns_of(transform.header.stamp), Pose.of(list(seven_of_transform(transform)))))

    def _on_diagnostics(self, message):
        for status in message.status:
            self.diagnostics[status.name] = status

    def status(self, name):
        """Level, sentence and values of the last diagnostics of the node."""
        found = self.diagnostics.get(f"{self.namespace}/mrol: {name}")
        return None if found is None else (found.level[0], found.message, {pair.key: pair.value for pair in found.values})

    def map_from_base(self, t):
        """Where it is, t seconds after the start: a slow turn about where it began."""
        x, y = self._begin
        angle = 0.15 * t
        return Pose.of(
            [x + 0.8 * math.sin(angle), y + 0.8 * (1 - math.cos(angle)), 0, 0, 0, math.sin(angle / 2), math.cos(angle / 2)]
        )

    def odom_from_base(self, t):
        """The same by its odometry, which drifts by 2 %."""
        return self.map_from_base(0).inverse() @ self.map_from_base(1.02 * t)

    def start(self):
        """Begins to drive."""
        self._began_ns = time.time_ns()
        for thread in self._threads:
            thread.start()

    def _send_tf(self, stamp_ns):
        t = self.seconds_of(stamp_ns)
        self._tf.publish(TFMessage(transforms=[transform_message(stamp_ns, "odom", "base_link", self.odom_from_base(t))]))

    def seconds_of(self, stamp_ns):
        """Seconds from the start to a stamp."""
        return (stamp_ns - self._began_ns) * 1e-9

    def _drive_tf(self):
        while not self._stop.wait(0.02):
            self._send_tf(time.time_ns())

    def _drive_clouds(self):
        begin = time.monotonic()
        while not self._stop.is_set():
            if self.is_quiet:
                self._stop.wait(0.1)
                begin = time.monotonic() - self.sent / self._hz
                continue
            stamp_ns = time.time_ns()
            t = self.seconds_of(stamp_ns)
            points = room(self.map_from_base(t) @ BASE_FROM_LIDAR, self._points, self._rng)
            self._clouds.publish(cloud_message(stamp_ns, "lidar", points, has_times=self._has_times))
            self.sent += 1
            self._odom_from_lidar[stamp_ns] = self.odom_from_base(t) @ BASE_FROM_LIDAR
            # Transforms come later than the cloud.
            if self._stop.wait(self._late_s):
                return
            self._send_tf(stamp_ns)
            least_s = self.CATCH_UP_SHARE / self._hz - (time.time_ns() - stamp_ns) * 1e-9
            self._stop.wait(max(0.0, least_s, begin + self.sent / self._hz - time.monotonic()))

    @property
    def listeners(self):
        """Who subscribes to the clouds."""
        return self._clouds.get_subscription_count()

    def correction_of(self, stamp_ns, tolerance_ns):
        """The map -> odom that was published for the cloud of a stamp."""
        return next((pose for _, of_ns, pose in list(self.corrections) if of_ns == stamp_ns + tolerance_ns), None)

    def odom_from_lidar(self, stamp_ns):
        """Where its odometry has the lidar at the stamp of a cloud."""
        return self._odom_from_lidar[stamp_ns]

    def stop(self):
        """Ends it."""
        self._stop.set()
        for thread in self._threads:
            if thread.is_alive():
                thread.join(10)
        self._executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


@contextmanager
def running(*parts):
    """Parts that are stopped at the end, the last one first."""
    try:
        yield
    finally:
        for part in reversed(parts):
            part.stop() if hasattr(part, "stop") else part.kill()


def take_one(kind, topic, seconds=15.0, qos=LATCHED):
    """What a subscriber gets that comes last."""
    context = rclpy.Context()
    context.init()
    node = rclpy.create_node("late", context=context)
    got = []
    node.create_subscription(kind, topic, got.append, qos)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    end = time.monotonic() + seconds
    while not got and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()
    assert got, f"nothing on {topic} within {seconds} s"
    return got[0]


def call(kind, name, request, seconds=40.0):
    """What a service answers."""
    context = rclpy.Context()
    context.init()
    node = rclpy.create_node("caller", context=context)
    client = node.create_client(kind, name)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        assert client.wait_for_service(10), name
        answer = client.call_async(request)
        executor.spin_until_future_complete(answer, seconds)
        assert answer.done(), f"{name}: no answer within {seconds} s"
        return answer.result()
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()
