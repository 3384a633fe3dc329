"""Writes the log of a robot that drives a loop through a hall: run.mcap, and the same messages as a folder with a database.

    python write.py FOLDER SECONDS

60,000 points at 10 Hz with their times, /tf at 50 Hz that is up to 0.2 s late, two publishers of /tf_static, zstd.
Packages of others write it: pip install mcap numpy rosbags.
"""

import pathlib
import sys

import numpy
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

RINGS, COLUMNS = 60, 1000
SWEEP_S = 0.1
START_NS = 1_764_370_870_000_000_000
TYPES = get_typestore(Stores.ROS2_HUMBLE)
KIND = TYPES.types
RANDOM = numpy.random.default_rng(20261129)


def make_hall():
    """Boxes: the hall from inside, pillars, crates."""
    boxes = [([-25.0, -15.0, -1.2], [25.0, 15.0, 7.0])]
    for x in range(-20, 21, 8):
        for y in (-7, 7):
            boxes.append(([x - 0.3, y - 0.3, -1.2], [x + 0.3, y + 0.3, 7.0]))
    for _ in range(24):
        x, y = RANDOM.uniform([-23, -13], [23, 13])
        if 8.5 < abs(x) + 0.0 < 12 or 3 < abs(y) < 5.5:
            continue
        size = RANDOM.uniform(0.4, 1.6, 3)
        boxes.append(([x, y, -1.2], [x + size[0], y + size[1], -1.2 + size[2]]))
    return numpy.array(boxes)


HALL = make_hall()


def ranges(origins, directions):
    """How far each ray goes to the nearest box that it meets from outside, or to the hall's walls."""
    with numpy.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / directions
        near = numpy.full(len(directions), numpy.inf)
        for index, (low, high) in enumerate(HALL):
            to_low, to_high = (low - origins) * inverse, (high - origins) * inverse
            enters = numpy.nanmax(numpy.minimum(to_low, to_high), axis=1)
            leaves = numpy.nanmin(numpy.maximum(to_low, to_high), axis=1)
            if index == 0:
                near = numpy.minimum(near, leaves)
            else:
                hit = (enters > 0) & (enters < leaves)
                near = numpy.where(hit, numpy.minimum(near, enters), near)
    return near


def pose_at(time_s):
    """Position and heading on a loop: half a lap a minute, 1 m/s."""
    angle = time_s * 2 * numpy.pi / 60.0
    position = numpy.stack([10 * numpy.cos(angle), 4 * numpy.sin(angle), 0 * angle], axis=-1)
    heading = numpy.arctan2(4 * numpy.cos(angle), -10 * numpy.sin(angle))
    return position, heading


def sweep(end_s):
    """The points of a sweep in the sensor's frame at each point's time, and these times before the stamp."""
    azimuth = numpy.linspace(0, 2 * numpy.pi, COLUMNS, endpoint=False)
    elevation = numpy.deg2rad(numpy.linspace(-25, 15, RINGS))
    times_s = numpy.repeat(numpy.linspace(-SWEEP_S, 0, COLUMNS), RINGS)
    azimuth, elevation = numpy.repeat(azimuth, RINGS), numpy.tile(elevation, COLUMNS)
    in_sensor = numpy.stack(
        [numpy.cos(elevation) * numpy.cos(azimuth), numpy.cos(elevation) * numpy.sin(azimuth), numpy.sin(elevation)], axis=1)
    position, heading = pose_at(end_s + times_s)
    cosine, sine = numpy.cos(heading), numpy.sin(heading)
    directions = numpy.stack(
        [cosine * in_sensor[:, 0] - sine * in_sensor[:, 1], sine * in_sensor[:, 0] + cosine * in_sensor[:, 1],
         in_sensor[:, 2]], axis=1)
    measured = ranges(position, directions) + RANDOM.normal(0, 0.01, len(directions))
    return in_sensor * measured[:, None], times_s


def stamp(time_ns):
    return KIND["builtin_interfaces/msg/Time"](sec=int(time_ns // 10**9), nanosec=int(time_ns % 10**9))


def header(time_ns, frame):
    return KIND["std_msgs/msg/Header"](stamp=stamp(time_ns), frame_id=frame)


def cloud(time_ns, points, times_s):
    rows = numpy.zeros(len(points), dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("time", "<f4")])
    rows["x"], rows["y"], rows["z"], rows["time"] = *points.T, times_s
    field = KIND["sensor_msgs/msg/PointField"]
    fields = [field(name=name, offset=4 * k, datatype=7, count=1) for k, name in enumerate(rows.dtype.names)]
    return KIND["sensor_msgs/msg/PointCloud2"](
        header=header(time_ns, "lidar"), height=1, width=len(rows), fields=fields, is_bigendian=False, point_step=16,
        row_step=rows.nbytes, data=rows.view(numpy.uint8), is_dense=True)


def transform(time_ns, parent, child, position, heading=0.0):
    vector, quaternion = KIND["geometry_msgs/msg/Vector3"], KIND["geometry_msgs/msg/Quaternion"]
    x, y, z = map(float, position)
    motion = KIND["geometry_msgs/msg/Transform"](
        translation=vector(x=x, y=y, z=z),
        rotation=quaternion(x=0.0, y=0.0, z=float(numpy.sin(heading / 2)), w=float(numpy.cos(heading / 2))))
    link = KIND["geometry_msgs/msg/TransformStamped"](
        header=header(time_ns, parent), child_frame_id=child, transform=motion)
    return KIND["tf2_msgs/msg/TFMessage"](transforms=[link])


def messages(seconds):
    """(recorded at, topic, type, message), in the order of recording."""
    late = []
    for step in range(int(seconds * 50)):
        time_s = step / 50
        time_ns = START_NS + step * 20_000_000
        if step == 0:
            yield time_ns, "/tf_static", "tf2_msgs/msg/TFMessage", transform(time_ns, "base", "lidar", (0, 0, 0))
        if step == 25:
            yield time_ns, "/tf_static", "tf2_msgs/msg/TFMessage", transform(time_ns, "base", "imu", (0.1, 0, 0))
        if step % 5 == 0:
            yield time_ns, "/points", "sensor_msgs/msg/PointCloud2", cloud(time_ns, *sweep(time_s))
        position, heading = pose_at(time_s)
        late.append((step + int(RANDOM.integers(0, 11)), transform(time_ns, "odom", "base", position, float(heading))))
        for due, message in [entry for entry in late if entry[0] <= step]:
            yield time_ns, "/tf", "tf2_msgs/msg/TFMessage", message
            late.remove((due, message))


def main(folder, seconds):
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "run.mcap").open("wb") as file:
        log = Writer(file, compression=CompressionType.ZSTD)
        log.start(profile="ros2", library="")
        channels = {}
        with BagWriter(folder / "run", version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
            for time_ns, topic, type_name, message in messages(seconds):
                data = bytes(TYPES.serialize_cdr(message, type_name))
                if topic not in channels:
                    text, _ = TYPES.generate_msgdef(type_name, ros_version=2)
                    schema = log.register_schema(type_name, "ros2msg", text.encode())
                    connection = bag.add_connection(topic, type_name, typestore=TYPES)
                    channels[topic] = log.register_channel(topic, "cdr", schema), connection
                channel, connection = channels[topic]
                log.add_message(channel, log_time=time_ns, publish_time=time_ns, data=data)
                bag.write(connection, time_ns, data)
        log.finish()


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), float(sys.argv[2]))
