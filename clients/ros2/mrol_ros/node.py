"""The node: topics, services and parameters of ROS around the other modules."""

from __future__ import annotations

import signal
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from threading import Event, Thread
from typing import Any

import mrol
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from mrol import Grid, Pose
from nav_msgs.msg import OccupancyGrid
from nav_msgs.msg import Odometry as OdometryMessage
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, PointCloud2
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

from .callbacks import beside, spin
from .correction import Correction, StampedCorrection, covariance_of
from .diagnosis import Diagnosis
from .frames import BadTransform, plain_frame
from .map_feed import MapFeed, MapVoxels
from .mapper import TRACE_MAX, MappedCloud, Mapper
from .messages import (
    centers_message,
    cloud_of,
    diagnostics_message,
    grid_message,
    initial_pose_of,
    octomap_message,
    pose_message,
    seven_of_pose,
    seven_of_transform,
    stamp_ns_of,
    transform_message,
)
from .odometry import Odometry
from .options import DESCRIPTIONS, OptionError, Options
from .own_scans import OwnScans
from .server_link import ServerLink
from .texts import shown

try:
    from octomap_msgs.msg import Octomap
    from octomap_msgs.srv import GetOctomap
except ImportError:
    Octomap = GetOctomap = None

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For what a subscriber that comes last has to get, too."""

SELDOM_S = 60.0
"""A warning of the same kind is not given again before."""

WARNING_MAX = 3000
"""Characters of a warning."""

CLOSE_MAX_S = 2.0
"""How long callbacks may take to end, and how long the request that is under way."""

SIGNAL_S = 0.5
"""How long a signal may be overlooked."""

FRAME_SHOWN = 40

TF_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
TF_STATIC_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class MrolNode(Node):
    """Maps the clouds of one robot, and publishes its pose and the map."""

    def __init__(self) -> None:
        super().__init__("mrol")
        self.options = self._declared()
        self.robot = self.options.robot_name(self.get_namespace())
        self._is_simulated = bool(self.get_parameter("use_sim_time").value)
        self._link = ServerLink(self.options, self.robot)
        self._odometry = Odometry(self.options)
        self._own_scans = OwnScans(self.robot)
        self._mapper = Mapper(
            self.options,
            self._link,
            self._odometry,
            self._on_mapped,
            self._warn,
            robot=self.robot,
            is_simulated=self._is_simulated,
            own_scans=self._own_scans,
        )
        self._feed = MapFeed(
            self.options, self._link, self._on_grid, self._on_voxels, self._wants_voxels, own_scans=self._own_scans
        )
        self._diagnosis = Diagnosis(self._mapper, self._feed, self._odometry, self._own_scans)
        self._correction = Correction(round(self.options.transform_tolerance * 1e9))
        self._period_ns = round(self.options.transform_period_s * 1e9)
        self._last_now_ns = 0
        self._warned_s: dict[str, float] = {}
        self._make_publishers()
        self._make_subscriptions()
        self._make_services()
        if Octomap is None:
            self._warn("octomap_binary is not published: octomap_msgs is not installed")
        self._mapping = Thread(target=self._mapper.run, daemon=True)
        self._mapping.start()
        self._feed.start()
        self.get_logger().info(f"robot {self.robot!r}, map {self.options.map!r} of {self.options.server}")

    def _declared(self) -> Options:
        values: dict[str, Any] = {}
        for of in fields(Options):
            # Options look at the types: ROS would take no 1 for 1.0, and an empty list has none.
            descriptor = ParameterDescriptor(description=DESCRIPTIONS[of.name], read_only=True, dynamic_typing=True)
            default = None if of.default == () else of.default
            values[of.name] = self.declare_parameter(of.name, default, descriptor).value
        return Options.of(values)

    def _make_publishers(self) -> None:
        self._tf = self.create_publisher(TFMessage, "/tf", TF_QOS)
        self._pose = self.create_publisher(PoseWithCovarianceStamped, "pose", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._grid = self.create_publisher(OccupancyGrid, "map", LATCHED)
        self._centers = self.create_publisher(PointCloud2, "octomap_point_cloud_centers", LATCHED)
        self._octomap = None if Octomap is None else self.create_publisher(Octomap, "octomap_binary", LATCHED)
        # By the wall clock a timer would stop for an hour where that is set back by one.
        clock = self.get_clock() if self._is_simulated else Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(self.options.transform_period_s, self._keep_tf, clock=clock)
        self.create_timer(1.0, self._tell, clock=clock)

    def _make_subscriptions(self) -> None:
        self.create_subscription(TFMessage, "/tf", self._on_tf, TF_QOS)
        self.create_subscription(TFMessage, "/tf_static", self._on_static_tf, TF_STATIC_QOS)
        self.create_subscription(PoseWithCovarianceStamped, "initialpose", self._on_initial_pose, QoSProfile(depth=1))
        if self.options.odometry_topic:
            self.create_subscription(
                OdometryMessage, self.options.odometry_topic, self._on_odometry, _sensor_qos(100, is_reliable=False)
            )
        if self.options.imu_topic:
            self.create_subscription(Imu, self.options.imu_topic, self._on_imu, _sensor_qos(200, is_reliable=False))
        clouds_qos = _sensor_qos(2, is_reliable=self.options.clouds_reliable)
        # Humble tells nothing of a message beside it.
        on_cloud = self._on_numbered_cloud if hasattr(Subscription, "CallbackType") else self._on_cloud
        self._clouds = self.create_subscription(PointCloud2, "cloud_in", on_cloud, clouds_qos)

    def _make_services(self) -> None:
        offered: list[tuple[Any, str, Callable[[Any, Any], Any]]] = [
            (Trigger, "save_map", self._save_map),
            (Trigger, "localize", self._localize),
            (SetBool, "pause", self._pause),
            (Trigger, "reset", self._reset),
        ]
        if GetOctomap is not None:
            offered.append((GetOctomap, "octomap_binary", self._get_octomap))
        for kind, name, callback in offered:
            # In a group of its own, so that one that takes long holds up itself alone.
            self.create_service(kind, name, beside(self, callback), callback_group=MutuallyExclusiveCallbackGroup())

    def callback_failed(self, error: Exception) -> None:
        """Says that a callback failed: a defect."""
        trace = "".join(traceback.format_exception(error))
        text = f"a callback failed: {error!r}; please report this: {trace[-TRACE_MAX:]}"
        self.get_logger().error(shown(text, WARNING_MAX), throttle_duration_sec=SELDOM_S)

    def close(self) -> None:
        """Ends the threads."""
        self._mapper.close()
        self._feed.close()
        self._mapping.join(CLOSE_MAX_S)
        self._link.close()

    # What comes in.

    def _on_cloud(self, message: PointCloud2) -> None:
        self._mapper.queue.put(cloud_of(message))

    def _on_numbered_cloud(self, message: PointCloud2, info: Mapping[str, Any]) -> None:
        number = info.get("publication_sequence_number")
        if number is not None:
            self._mapper.lost.see(number)
        self._on_cloud(message)

    def _on_tf(self, message: TFMessage) -> None:
        self._note(message, is_static=False)

    def _on_static_tf(self, message: TFMessage) -> None:
        self._note(message, is_static=True)

    def _note(self, message: TFMessage, *, is_static: bool) -> None:
        for transform in message.transforms:
            parent, child = transform.header.frame_id, transform.child_frame_id
            if self.options.publish_tf and plain_frame(child) == self._odometry.odom_frame:
                # It is the one that is published here.
                continue
            try:
                stamp_ns = stamp_ns_of(transform.header.stamp)
                self._odometry.note_transform(parent, child, stamp_ns, seven_of_transform(transform), is_static=is_static)
            except BadTransform as error:
                self._warn_seldom("transform", f"a transform is left out: {error}")

    def _on_odometry(self, message: OdometryMessage) -> None:
        try:
            seven = seven_of_pose(message.pose.pose)
            self._odometry.note_pose(message.header.frame_id, message.child_frame_id, stamp_ns_of(message.header.stamp), seven)
        except BadTransform as error:
            self._warn_seldom("odometry", f"odometry is left out: {error}")

    def _on_imu(self, message: Imu) -> None:
        # The first number of this covariance is -1 where there is no accelerometer.
        if message.linear_acceleration_covariance[0] != -1:
            a = message.linear_acceleration
            self._mapper.guesses.imu_frame = plain_frame(message.header.frame_id)
            self._mapper.guesses.gravity.note(stamp_ns_of(message.header.stamp), (a.x, a.y, a.z))

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        frame = plain_frame(message.header.frame_id)
        if frame != self.options.map_frame:
            got = shown(frame, FRAME_SHOWN)
            self._warn_seldom(
                "initialpose", f"initialpose must be in frame {self.options.map_frame!r}, got {got!r}: it is left out"
            )
            return
        try:
            self._mapper.guesses.begin_at(initial_pose_of(message))
        except ValueError as error:
            self._warn_seldom("initialpose", f"initialpose is left out: {error}")

    # What goes out.

    def _on_mapped(self, mapped: MappedCloud) -> None:
        answer, place = mapped.answer, mapped.place
        if not answer.accepted:
            return
        time_ns = self._odometry.time_of(mapped.stamp_ns)
        if self.options.publish_tf and place.odom_from_sensor is not None:
            correction = self._correction
            self._publish_tf(correction.update(time_ns, answer.map_from_sensor, place.odom_from_sensor, self._now_ns()))
            if correction.ahead_ns:
                self._warn_seldom(
                    "ahead",
                    f"clouds are stamped {correction.ahead_ns * 1e-9:.1f} s ahead of the clock of this node, and map -> odom is "
                    "not: set the clocks, or the parameter time_offset_s",
                )
        if answer.information is None or place.base_from_sensor is None:
            return
        map_from_base = answer.map_from_sensor @ place.base_from_sensor.inverse()
        covariance = covariance_of(answer.information, map_from_base.translation_m - answer.map_from_sensor.translation_m)
        self._pose.publish(pose_message(time_ns, self.options.map_frame, map_from_base, covariance))

    def _publish_tf(self, correction: StampedCorrection) -> None:
        pose: Pose = correction.map_from_odom
        transform = transform_message(correction.stamp_ns, self.options.map_frame, self._odometry.odom_frame, pose)
        self._tf.publish(TFMessage(transforms=[transform]))

    def _keep_tf(self) -> None:
        now_ns = self._now_ns()
        if now_ns < self._last_now_ns - 1_000_000_000:
            # A simulation that began anew, or a clock that was set.
            self._correction.clock_was_set_back()
            self._odometry.clock_was_set_back()
        self._last_now_ns = now_ns
        if not self.options.publish_tf:
            return
        again = self._correction.keep_alive(now_ns, self._period_ns)
        if again is not None:
            self._publish_tf(again)

    def _on_grid(self, grid: Grid) -> None:
        self._grid.publish(grid_message(self._now_ns(), self.options.map_frame, grid))

    def _wants_voxels(self) -> bool:
        octrees = 0 if self._octomap is None else self._octomap.get_subscription_count()
        return octrees + self._centers.get_subscription_count() > 0

    def _on_voxels(self, voxels: MapVoxels) -> None:
        now_ns = self._now_ns()
        self._centers.publish(centers_message(now_ns, self.options.map_frame, voxels.centers_m))
        if self._octomap is not None:
            self._octomap.publish(self._octree(now_ns, voxels))

    def _octree(self, now_ns: int, voxels: MapVoxels) -> Any:
        data, self._feed.outside = voxels.octree()
        return octomap_message(Octomap, now_ns, self.options.map_frame, voxels.resolution_m, data)

    def _tell(self) -> None:
        statuses = self._diagnosis.statuses(self.count_publishers(self._clouds.topic_name))
        named = [(f"{self.get_fully_qualified_name()}: {name}", *of) for name, *of in statuses]
        self._diagnostics.publish(diagnostics_message(self._now_ns(), self.robot, named))
        if stranger := self._own_scans.stranger():
            self._warn_seldom("stranger", stranger)

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _warn(self, text: str) -> None:
        self.get_logger().warning(shown(text, WARNING_MAX))

    def _warn_seldom(self, kind: str, text: str) -> None:
        """Warns, unless a warning of this kind was given within the last minute."""
        now_s = time.monotonic()
        if now_s - self._warned_s.get(kind, -SELDOM_S) >= SELDOM_S:
            self._warned_s[kind] = now_s
            self._warn(text)

    # Services.

    def _save_map(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        file = Path(self.options.save_map_file or f"{self.options.map}.mrol").expanduser().absolute()
        try:
            version = self._link.map().snapshot(file)
            response.success, response.message = True, f"{file}: revision {version.revision}"
        except mrol.MrolError as error:
            response.success, response.message = False, str(error)
        return response

    def _localize(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = self._mapper.localize()
        return response

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._mapper.is_paused = request.data
        response.success, response.message = True, "paused" if request.data else "goes on"
        return response

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if not self.options.allow_reset:
            response.success, response.message = (
                False,
                "reset deletes the map: it is refused unless the parameter allow_reset is true",
            )
            return response
        try:
            self._link.reset()
            self._mapper.guesses.forget()
            response.success, response.message = True, f"the map {self.options.map!r} is empty"
        except mrol.MrolError as error:
            response.success, response.message = False, str(error)
        return response

    def _get_octomap(self, _: Any, response: Any) -> Any:
        try:
            response.map = self._octree(self._now_ns(), self._feed.read_voxels())
        except mrol.MrolError as error:
            self._warn(f"octomap_binary: {error}")
        return response


def _sensor_qos(depth: int, *, is_reliable: bool) -> QoSProfile:
    reliability = ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT
    return QoSProfile(depth=depth, history=HistoryPolicy.KEEP_LAST, reliability=reliability)


def main() -> None:
    """Runs the node until it is told to end."""
    # ROS' own handlers end the context, under the threads that still publish.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    ended = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    try:
        node = MrolNode()
    except (OptionError, NameValidationException) as error:
        sys.exit(f"mrol_ros: {shown(str(error))}")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinning = Thread(target=spin, args=(executor, node.callback_failed, ended), daemon=True)
    spinning.start()
    while not ended.wait(SIGNAL_S):
        # A signal that the system gave to another thread wakes nobody up, and is seen by this one when it wakes.
        pass
    executor.shutdown(timeout_sec=CLOSE_MAX_S)
    spinning.join(CLOSE_MAX_S)
    node.close()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
