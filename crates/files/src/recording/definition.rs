//! What fields the messages have, as a viewer that does not know them reads it (the schema encoding `ros2msg` of MCAP).

/// A type of messages.
#[derive(Debug, Clone, Copy)]
pub(super) struct Definition {
    /// Its name, such as `sensor_msgs/msg/PointCloud2`.
    pub(super) name: &'static str,
    /// Its fields, a line each.
    fields: &'static str,
    /// The types that these fields have, each with those that it has itself among them.
    parts: &'static [Part],
}

/// A type and its fields.
type Part = (&'static str, &'static str);

const TIME: Part = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: Part = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
const POINT: Part = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const VECTOR: Part = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: Part = ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n");
const POSE: Part =
    ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n");

/// A cloud of points.
pub(super) const POINT_CLOUD: Definition = Definition {
    name: "sensor_msgs/msg/PointCloud2",
    fields: "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n\
             uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    parts: &[
        HEADER,
        TIME,
        ("sensor_msgs/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"),
    ],
};

/// The map from above.
pub(super) const OCCUPANCY_GRID: Definition = Definition {
    name: "nav_msgs/msg/OccupancyGrid",
    fields: "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data\n",
    parts: &[
        HEADER,
        TIME,
        (
            "nav_msgs/MapMetaData",
            "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\nuint32 height\ngeometry_msgs/Pose origin\n",
        ),
        POSE,
        POINT,
        QUATERNION,
    ],
};

/// The way of a robot.
pub(super) const PATH: Definition = Definition {
    name: "nav_msgs/msg/Path",
    fields: "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n",
    parts: &[
        HEADER,
        TIME,
        ("geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"),
        POSE,
        POINT,
        QUATERNION,
    ],
};

/// Where frames are in others.
pub(super) const TRANSFORMS: Definition = Definition {
    name: "tf2_msgs/msg/TFMessage",
    fields: "geometry_msgs/TransformStamped[] transforms\n",
    parts: &[
        (
            "geometry_msgs/TransformStamped",
            "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
        ),
        ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
        HEADER,
        TIME,
        VECTOR,
        QUATERNION,
    ],
};

impl Definition {
    /// The definition as one text: the fields, then each part behind a line of 80 `=` and its name.
    pub(super) fn text(&self) -> String {
        let part = |(name, fields): &Part| format!("{}\nMSG: {name}\n{fields}", "=".repeat(80));
        [self.fields.to_owned()].into_iter().chain(self.parts.iter().map(part)).collect()
    }
}
