//! The bytes of each message.

use super::cdr::CdrWriter;
use super::recorder::RecordedPose;
use mrol_map::geometry::{Point, Pose, rotation_xyzw, translation_m};
use mrol_map::planning::Grid;

/// The frame of everything.
const MAP_FRAME: &str = "map";
/// Bytes of a point in a cloud: x y z and the height once more, f32 each.
const POINT_BYTES: u32 = 16;
/// `sensor_msgs/PointField::FLOAT32`.
const FLOAT32: u8 = 7;
/// Bytes of a message beside its lists, with room to spare.
const ROOM: usize = 256;
/// Bytes of a pose in a path, with room for the name of its frame.
const POSE_ROOM: usize = 96;

/// What `nav_msgs/OccupancyGrid` has in cells.
const CELL_OCCUPIED: u8 = 100;
const CELL_FREE: u8 = 0;
const CELL_UNKNOWN: u8 = u8::MAX;

/// A `sensor_msgs/PointCloud2` of points in the map frame. A field `intensity` has the height, by which viewers color
/// where nobody says otherwise.
pub(super) fn point_cloud(stamp_ns: u64, points: &[Point]) -> Vec<u8> {
    let mut writer = CdrWriter::with_room(ROOM + points.len() * POINT_BYTES as usize);
    header(&mut writer, stamp_ns);
    // One row.
    writer.u32(1);
    writer.count(points.len());
    let fields = ["x", "y", "z", "intensity"];
    writer.count(fields.len());
    for (offset, name) in (0..).step_by(4).zip(fields) {
        writer.string(name);
        writer.u32(offset);
        writer.u8(FLOAT32);
        writer.u32(1);
    }
    // Little-endian.
    writer.u8(0);
    writer.u32(POINT_BYTES);
    let bytes = points.len() * POINT_BYTES as usize;
    writer.count(bytes);
    writer.count(bytes);
    for point in points {
        let [x, y, z] = point.xyz();
        [x, y, z, z].into_iter().for_each(|number| writer.f32(number));
    }
    // No point is NaN.
    writer.u8(1);
    writer.finish()
}

/// A `nav_msgs/OccupancyGrid`: 100 occupied, 0 free, -1 unknown where the grid tells that.
pub(super) fn occupancy_grid(stamp_ns: u64, grid: &Grid) -> Vec<u8> {
    let mut writer = CdrWriter::with_room(ROOM + grid.cells());
    header(&mut writer, stamp_ns);
    stamp(&mut writer, stamp_ns);
    writer.f32(grid.cell_m as f32);
    grid.size.into_iter().for_each(|cells| writer.count(cells));
    let [x, y] = grid.origin_m;
    pose(&mut writer, &Pose::translation(x, y, 0.0));
    writer.octets((0..grid.cells()).map(|number| match grid.is_occupied(number) {
        true => CELL_OCCUPIED,
        false if grid.is_unknown(number) => CELL_UNKNOWN,
        false => CELL_FREE,
    }));
    writer.finish()
}

/// A `nav_msgs/Path` of poses in the map frame.
pub(super) fn path(stamp_ns: u64, poses: &[RecordedPose]) -> Vec<u8> {
    let mut writer = CdrWriter::with_room(ROOM + poses.len() * POSE_ROOM);
    header(&mut writer, stamp_ns);
    writer.count(poses.len());
    for recorded in poses {
        header(&mut writer, recorded.stamp_ns);
        pose(&mut writer, &recorded.map_from_sensor);
    }
    writer.finish()
}

/// A `tf2_msgs/TFMessage` of one frame in the map's.
pub(super) fn transform(child: &str, recorded: &RecordedPose) -> Vec<u8> {
    let mut writer = CdrWriter::with_room(ROOM + child.len());
    writer.count(1);
    header(&mut writer, recorded.stamp_ns);
    writer.string(child);
    // A vector and a rotation, as a pose is.
    pose(&mut writer, &recorded.map_from_sensor);
    writer.finish()
}

fn header(writer: &mut CdrWriter, stamp_ns: u64) {
    stamp(writer, stamp_ns);
    writer.string(MAP_FRAME);
}

/// Seconds that no time of ROS 2 holds, after 2038, are its last ones.
fn stamp(writer: &mut CdrWriter, stamp_ns: u64) {
    writer.i32(i32::try_from(stamp_ns / 1_000_000_000).unwrap_or(i32::MAX));
    writer.u32((stamp_ns % 1_000_000_000) as u32);
}

fn pose(writer: &mut CdrWriter, pose: &Pose) {
    translation_m(pose).into_iter().chain(rotation_xyzw(pose)).for_each(|number| writer.f64(number));
}
