use std::io::Cursor;

use mrol_logs::cloud::{Cloud, CloudOptions};
use mrol_logs::log::{McapReader, Messages};
use mrol_logs::message::{MessageKind, transforms};

use super::definition::{Definition, OCCUPANCY_GRID, PATH, POINT_CLOUD, TRANSFORMS};
use super::mcap_recorder::McapRecorder;
use super::{RecordedPose, Recorder};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::RobotName;
use mrol_map::planning::Grid;

const BEGIN_NS: u64 = 1_764_370_870_000_000_000;

/// A recording of two voxels, a grid of 3 x 2 cells and a robot that drove.
fn recording() -> (Vec<u8>, Vec<Point>, Vec<RecordedPose>) {
    let points = vec![Point::new(0.05, -0.15, 1.25), Point::new(-3.05, 2.05, 0.05)];
    let mut grid = Grid::empty(0.1, [-0.1, 0.2], [3, 2], true);
    grid.occupied[0] = 0b1;
    grid.free = Some(vec![0b110]);
    let pose = |k: u64| RecordedPose {
        stamp_ns: BEGIN_NS + k * 100_000_000,
        map_from_sensor: Pose::translation(k as f64, 0.0, 0.5),
    };
    let poses: Vec<_> = (0..4).map(pose).collect();
    let mut file = Cursor::new(Vec::new());
    let mut recording = Box::new(McapRecorder::begin(&mut file, BEGIN_NS).unwrap());
    recording.write_voxels(&points).unwrap();
    recording.write_grid(&grid).unwrap();
    recording.write_way(&RobotName::new("r1").unwrap(), &poses).unwrap();
    recording.finish().unwrap();
    (file.into_inner(), points, poses)
}

#[test]
fn what_is_recorded_is_read_as_any_log() {
    let (file, points, poses) = recording();
    let mut reader = McapReader::new(&file[..]).unwrap();
    let mut read: Vec<(usize, u64, Vec<u8>)> = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        read.push((message.topic, message.log_time_ns, message.data.to_vec()));
    }
    assert!(reader.damages().is_empty());
    let of = |name: &str| -> Vec<_> {
        let topic = reader.topics().iter().position(|topic| topic.name == name).unwrap();
        read.iter().filter(|(of, ..)| *of == topic).collect()
    };
    assert_eq!(read.len(), 3 + poses.len());
    let [(_, time_ns, data)] = of("/map/voxels")[..] else { panic!("one cloud") };
    let cloud = Cloud::read(MessageKind::PointCloud2, data, CloudOptions::default()).unwrap();
    assert_eq!((*time_ns, cloud.stamp_ns, &*cloud.frame), (BEGIN_NS, BEGIN_NS as i64, "map"));
    assert_eq!(cloud.points, points);
    for ((_, time_ns, data), pose) in of("/tf").iter().zip(&poses) {
        let told = &transforms(data).unwrap()[0];
        assert_eq!((*time_ns, told.header.stamp_ns), (pose.stamp_ns, pose.stamp_ns as i64));
        assert_eq!((told.header.frame, told.child_frame), ("map", "r1"));
        assert_eq!(told.parent_from_child, Some(pose.map_from_sensor));
    }
    // The last bytes of a grid are its cells.
    let [(_, _, grid)] = of("/map/grid")[..] else { panic!("one grid") };
    assert_eq!(&grid[grid.len() - 10..], [6, 0, 0, 0, 100, 0, 0, 255, 255, 255]);
    let [(_, _, path)] = of("/robots/r1/path")[..] else { panic!("one path") };
    assert!(path.ends_with(&1.0f64.to_le_bytes()), "w of the last rotation");
}

#[test]
fn definitions_name_every_type_that_they_use() {
    const NUMBERS: [&str; 7] = ["bool", "int8", "uint8", "int32", "uint32", "float32", "float64"];
    for definition in [POINT_CLOUD, OCCUPANCY_GRID, PATH, TRANSFORMS] {
        let text = Definition::text(&definition);
        let parts: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("MSG: ")).collect();
        let fields = text.lines().filter(|line| !line.starts_with("MSG: ") && !line.starts_with("==="));
        for field in fields {
            let (type_name, _) = field.split_once(' ').unwrap();
            let type_name = type_name.trim_end_matches("[]");
            let is_known =
                type_name == "string" || NUMBERS.contains(&type_name) || parts.contains(&type_name);
            assert!(is_known, "{field} of {}", definition.name);
        }
        for part in parts {
            assert!(text.matches(part).count() > 1, "{part} of {} is used by nothing", definition.name);
        }
    }
}
