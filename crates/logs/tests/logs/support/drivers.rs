//! Clouds as drivers write them.

use super::CdrWriter;
use mrol_map::geometry::Point;

/// Writes a message of points with their times in seconds from the end of the sweep, which is at `end_ns`, and the
/// number of their rings.
pub(crate) type WriteCloud =
    fn(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8>;

/// A form in which a driver writes clouds.
pub(crate) struct Driver {
    pub(crate) name: &'static str,
    pub(crate) type_name: &'static str,
    /// True where the clouds have times of points.
    pub(crate) has_times: bool,
    pub(crate) write: WriteCloud,
}

/// The drivers whose clouds are read.
pub(crate) const DRIVERS: [Driver; 12] = [
    cloud2("velodyne, stamp of the first packet", true, velodyne_first),
    cloud2("velodyne, stamp of the last packet", true, velodyne_last),
    cloud2("ouster", true, ouster),
    cloud2("hesai", true, hesai),
    cloud2("robosense with times", true, robosense),
    cloud2("robosense without times", false, robosense_without),
    Driver {
        name: "livox CustomMsg",
        type_name: "livox_ros_driver2/msg/CustomMsg",
        has_times: true,
        write: livox,
    },
    Driver {
        name: "livox CustomMsg of ROS 1",
        type_name: "livox_ros_driver/msg/CustomMsg",
        has_times: true,
        write: livox,
    },
    cloud2("livox PointCloud2", true, livox_cloud),
    cloud2("realsense, organized", false, realsense),
    cloud2("big-endian", true, big_endian),
    cloud2("forty fields of all types", true, forty_fields),
];

const fn cloud2(name: &'static str, has_times: bool, write: WriteCloud) -> Driver {
    Driver { name, type_name: "sensor_msgs/msg/PointCloud2", has_times, write }
}

/// A number of a field, little-endian, with its type by ROS.
#[derive(Clone)]
enum Value {
    U8(u8),
    U16(u16),
    U32(u32),
    F32(f32),
    F64(f64),
}

impl Value {
    fn type_number(&self) -> u8 {
        match self {
            Self::U8(_) => 2,
            Self::U16(_) => 4,
            Self::U32(_) => 6,
            Self::F32(_) => 7,
            Self::F64(_) => 8,
        }
    }

    fn bytes(&self, is_big: bool) -> Vec<u8> {
        let mut bytes = match self {
            Self::U8(number) => number.to_le_bytes().to_vec(),
            Self::U16(number) => number.to_le_bytes().to_vec(),
            Self::U32(number) => number.to_le_bytes().to_vec(),
            Self::F32(number) => number.to_le_bytes().to_vec(),
            Self::F64(number) => number.to_le_bytes().to_vec(),
        };
        if is_big {
            bytes.reverse();
        }
        bytes
    }
}

/// How a `PointCloud2` is laid out.
#[derive(Clone, Copy, Default)]
struct Layout {
    is_big: bool,
    height: u32,
    /// Bytes behind the fields of each point.
    padding: usize,
    /// Bytes behind the points of each row.
    row_padding: usize,
}

/// A message whose points have these fields: (name, offset, value), all alike.
fn message(stamp_ns: i64, frame: &str, layout: Layout, points: &[Vec<(&str, usize, Value)>]) -> Vec<u8> {
    let height = layout.height.max(1) as usize;
    let width = points.len() / height;
    let fields = points.first().cloned().unwrap_or_default();
    let end = |(_, offset, value): &(&str, usize, Value)| offset + value.bytes(false).len();
    let point_step = fields.iter().map(end).max().unwrap_or(0) + layout.padding;
    let row_step = width * point_step + layout.row_padding;
    let mut data = vec![0xa5; row_step * height];
    for (k, fields) in points.iter().enumerate() {
        let begin = k / width.max(1) * row_step + k % width.max(1) * point_step;
        for (_, offset, value) in fields {
            let bytes = value.bytes(layout.is_big);
            data[begin + offset..begin + offset + bytes.len()].copy_from_slice(&bytes);
        }
    }
    let mut writer = CdrWriter::new(layout.is_big);
    writer.header(stamp_ns, frame);
    writer.u32(height as u32);
    writer.u32(width as u32);
    writer.u32(fields.len() as u32);
    for (name, offset, value) in &fields {
        writer.string(name);
        writer.u32(*offset as u32);
        writer.u8(value.type_number());
        writer.u32(1);
    }
    writer.u8(u8::from(layout.is_big));
    writer.u32(point_step as u32);
    writer.u32(row_step as u32);
    writer.octets(&data);
    writer.u8(0);
    writer.finish()
}

type Fields<'a> = Vec<(&'a str, usize, Value)>;

/// The fields of each point: x y z at an offset, and what `more` makes of the point's number.
fn fields<'a>(points: &[Point], at: usize, more: impl Fn(usize) -> Fields<'a>) -> Vec<Fields<'a>> {
    let fields = |(k, point): (usize, &Point)| {
        let [x, y, z] = point.xyz();
        let xyz = vec![("x", at, Value::F32(x)), ("y", at + 4, Value::F32(y)), ("z", at + 8, Value::F32(z))];
        [xyz, more(k)].concat()
    };
    points.iter().enumerate().map(fields).collect()
}

fn ring(k: usize, rings: u16) -> u16 {
    (k % usize::from(rings)) as u16
}

/// How long before the end of the sweep its stamp is where that is the begin, nanoseconds.
fn begin_ns(times_s: &[f32]) -> i64 {
    (times_s.iter().fold(0.0f32, |least, time| least.min(*time)) as f64 * 1e9) as i64
}

fn velodyne(
    stamp_ns: i64,
    from_ns: i64,
    frame: &str,
    points: &[Point],
    times_s: &[f32],
    rings: u16,
) -> Vec<u8> {
    let more = |k: usize| {
        let time_s = (f64::from(times_s[k]) - from_ns as f64 * 1e-9) as f32;
        vec![
            ("intensity", 12, Value::F32(7.0)),
            ("ring", 16, Value::U16(ring(k, rings))),
            ("time", 18, Value::F32(time_s)),
        ]
    };
    message(stamp_ns, frame, Layout::default(), &fields(points, 0, more))
}

fn velodyne_first(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8> {
    let begin_ns = begin_ns(times_s);
    velodyne(end_ns + begin_ns, begin_ns, frame, points, times_s, rings)
}

fn velodyne_last(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8> {
    velodyne(end_ns, 0, frame, points, times_s, rings)
}

fn ouster(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8> {
    let begin_ns = begin_ns(times_s);
    let more = |k: usize| {
        let t = (f64::from(times_s[k]) * 1e9) as i64 - begin_ns;
        vec![
            ("intensity", 16, Value::F32(1.0)),
            ("t", 20, Value::U32(t as u32)),
            ("reflectivity", 24, Value::U16(9)),
            ("ring", 26, Value::U16(ring(k, rings))),
            ("ambient", 28, Value::U16(3)),
            ("range", 32, Value::U32(5)),
        ]
    };
    let layout = Layout { height: u32::from(rings), padding: 12, ..Layout::default() };
    message(end_ns + begin_ns, frame, layout, &fields(points, 0, more))
}

fn epoch(end_ns: i64, time_s: f32) -> f64 {
    (end_ns as f64).mul_add(1e-9, f64::from(time_s))
}

fn hesai(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8> {
    let more = |k: usize| {
        vec![
            ("intensity", 16, Value::F32(1.0)),
            ("timestamp", 24, Value::F64(epoch(end_ns, times_s[k]))),
            ("ring", 32, Value::U16(ring(k, rings))),
        ]
    };
    let layout = Layout { padding: 14, ..Layout::default() };
    message(end_ns + begin_ns(times_s), frame, layout, &fields(points, 0, more))
}

fn robosense(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8> {
    let more = |k: usize| {
        vec![
            ("intensity", 12, Value::U8(1)),
            ("ring", 13, Value::U16(ring(k, rings))),
            ("timestamp", 15, Value::F64(epoch(end_ns, times_s[k]))),
        ]
    };
    message(end_ns, frame, Layout::default(), &fields(points, 0, more))
}

fn robosense_without(end_ns: i64, frame: &str, points: &[Point], _: &[f32], rings: u16) -> Vec<u8> {
    let layout = Layout { height: u32::from(rings), row_padding: 5, ..Layout::default() };
    message(end_ns, frame, layout, &fields(points, 4, |_| vec![("intensity", 16, Value::U8(1))]))
}

fn livox(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8> {
    let begin_ns = begin_ns(times_s);
    let mut writer = CdrWriter::new(false);
    writer.header(end_ns + begin_ns, frame);
    writer.u64((end_ns + begin_ns) as u64);
    writer.u32(points.len() as u32);
    (0..4).for_each(|_| writer.u8(0));
    writer.u32(points.len() as u32);
    for (k, point) in points.iter().enumerate() {
        writer.u32(((f64::from(times_s[k]) * 1e9) as i64 - begin_ns) as u32);
        point.xyz().into_iter().for_each(|c| writer.f32(c));
        writer.u8(50);
        writer.u8(0x10);
        writer.u8(ring(k, rings) as u8);
    }
    writer.finish()
}

fn livox_cloud(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8> {
    let more = |k: usize| {
        let time_ns = end_ns + (f64::from(times_s[k]) * 1e9) as i64;
        vec![
            ("intensity", 12, Value::F32(1.0)),
            ("tag", 16, Value::U8(0)),
            ("line", 17, Value::U8(ring(k, rings) as u8)),
            ("timestamp", 18, Value::F64(time_ns as f64)),
        ]
    };
    message(end_ns + begin_ns(times_s), frame, Layout::default(), &fields(points, 0, more))
}

fn realsense(end_ns: i64, frame: &str, points: &[Point], _: &[f32], rings: u16) -> Vec<u8> {
    let layout = Layout { height: u32::from(rings), ..Layout::default() };
    message(end_ns, frame, layout, &fields(points, 0, |_| vec![("rgb", 16, Value::F32(0.5))]))
}

fn big_endian(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], rings: u16) -> Vec<u8> {
    let begin_ns = begin_ns(times_s);
    let more = |k: usize| {
        let t = ((f64::from(times_s[k]) * 1e9) as i64 - begin_ns) / 1000;
        vec![("offset_time", 0, Value::U32(t as u32)), ("ring", 4, Value::U16(ring(k, rings)))]
    };
    let layout = Layout { is_big: true, padding: 3, ..Layout::default() };
    message(end_ns + begin_ns, frame, layout, &fields(points, 6, more))
}

fn forty_fields(end_ns: i64, frame: &str, points: &[Point], times_s: &[f32], _: u16) -> Vec<u8> {
    const NAMES: [&str; 36] = [
        "f00", "f01", "f02", "f03", "f04", "f05", "f06", "f07", "f08", "f09", "f10", "f11", "f12", "f13",
        "f14", "f15", "f16", "f17", "f18", "f19", "f20", "f21", "f22", "f23", "f24", "f25", "f26", "f27",
        "f28", "f29", "f30", "f31", "f32", "f33", "f34", "f35",
    ];
    let all = points.iter().enumerate().map(|(k, point)| {
        let [x, y, z] = point.xyz().map(f64::from);
        let mut at = 1;
        let mut place = |name, value: Value| {
            let offset = at;
            at += value.bytes(false).len();
            (name, offset, value)
        };
        let mut fields = vec![place("z", Value::F64(z))];
        for (k, name) in NAMES.into_iter().enumerate() {
            let value = [Value::U8(1), Value::U16(2), Value::F32(3.0), Value::F64(4.0)][k % 4].clone();
            fields.push(place(name, value));
        }
        fields.push(place("time", Value::F64(f64::from(times_s[k]) * 1e3)));
        fields.extend([place("y", Value::F64(y)), place("x", Value::F64(x))]);
        fields
    });
    message(end_ns, frame, Layout::default(), &all.collect::<Vec<_>>())
}
