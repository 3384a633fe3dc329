//! The rules that `clients/ros2` follows as well are those of the tables in `fixtures/rules`, case by case.

use std::path::Path;

use mrol_logs::cloud::{Cloud, RawTimes, TimeValues};
use mrol_logs::frames::Track;
use mrol_logs::message::FieldType;
use mrol_logs::point_times::{NoTimes, TimeUnit, TimesFrom, TimesRule};
use mrol_map::geometry::{Point, Pose, pose_difference};
use nalgebra::{Translation3, UnitQuaternion};

const MS: i64 = 1_000_000;

/// The rows of a table, each cut into its columns.
fn rows(name: &str) -> Vec<Vec<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/rules").join(name);
    let text = std::fs::read_to_string(path).unwrap();
    let is_row = |line: &&str| !line.is_empty() && !line.starts_with('#');
    let rows: Vec<_> = text
        .lines()
        .filter(is_row)
        .map(|line| line.split(';').map(|column| column.trim().to_owned()).collect())
        .collect();
    assert!(rows.len() > 10);
    rows
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|number| number.parse().unwrap()).collect()
}

fn values(kind: &str, text: &str) -> (FieldType, TimeValues) {
    let words = || text.split_whitespace();
    match kind {
        "f4" => {
            let single = |word: &str| f64::from(word.parse::<f32>().unwrap());
            (FieldType::F32, TimeValues::Floats(words().map(single).collect()))
        }
        "f8" => (FieldType::F64, TimeValues::Floats(numbers(text))),
        "u4" => (FieldType::U32, TimeValues::Integers(words().map(|word| word.parse().unwrap()).collect())),
        "u8" => (FieldType::U64, TimeValues::Integers(words().map(|word| word.parse().unwrap()).collect())),
        _ => panic!("{kind} is no type of the table"),
    }
}

fn rule(text: &str) -> TimesRule {
    let (unit, from) = text.split_once(':').unwrap();
    TimesRule {
        unit: TimeUnit::ALL.into_iter().find(|of| of.as_str() == unit).unwrap(),
        from: TimesFrom::ALL.into_iter().find(|of| of.as_str() == from).unwrap(),
    }
}

fn reason(why: &NoTimes) -> &'static str {
    match why {
        NoTimes::AllEqual { .. } => "all_equal",
        NoTimes::NoUnit { .. } => "no_unit",
        NoTimes::NotFinite { .. } => "not_finite",
        NoTimes::TwoOrigins { .. } => "two_origins",
        NoTimes::TooFar { .. } => "too_far",
        _ => "another",
    }
}

#[test]
fn times_of_points_are_those_of_the_shared_table() {
    for row in rows("point_times.txt") {
        let [name, kind, stamp_ns, times, given, expected, seconds] = <[String; 7]>::try_from(row).unwrap();
        let (field_type, values) = values(&kind, &times);
        let raw = RawTimes { field: "t".to_owned(), field_type, values };
        let cloud = Cloud {
            stamp_ns: stamp_ns.parse().unwrap(),
            frame: "lidar".to_owned(),
            points: vec![Point::new(1.0, 1.0, 1.0); raw.values.len()],
            times: Some(raw.clone()),
            rings: Vec::new(),
        };
        let found = match given.as_str() {
            "find" => TimesRule::find(&cloud, &raw).map(|(rule, _)| rule),
            given => Ok(rule(given)),
        };
        match found.and_then(|found| found.times_s(&cloud, &raw).map(|times_s| (found, times_s))) {
            Ok((found, times_s)) => {
                assert_eq!(format!("{}:{}", found.unit.as_str(), found.from.as_str()), expected, "{name}");
                let seconds = numbers(&seconds);
                assert_eq!(times_s.len(), seconds.len(), "{name}");
                for (time_s, true_s) in times_s.iter().zip(seconds) {
                    assert!((f64::from(*time_s) - true_s).abs() < 1.1e-6, "{name}: {times_s:?}");
                }
            }
            Err(why) => assert_eq!(reason(&why), expected, "{name}: {why}"),
        }
    }
}

/// The pose of x y in meters and a yaw in degrees.
fn pose(numbers: &[f64]) -> Pose {
    let [x, y, yaw_deg] = numbers else { panic!("{numbers:?} is no pose") };
    Pose::from_parts(
        Translation3::new(*x, *y, 0.0),
        UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_deg.to_radians()),
    )
}

#[test]
fn frames_are_where_the_shared_table_says() {
    for row in rows("tracks.txt") {
        let [name, poses, time_ms, beyond_ms, expected] = <[String; 5]>::try_from(row).unwrap();
        let mut track = Track::default();
        for told in poses.split(',').filter(|told| !told.is_empty()) {
            let numbers = numbers(told);
            track.insert(numbers[0] as i64 * MS, pose(&numbers[1..]));
        }
        let [time_ms, beyond_ms] = [time_ms, beyond_ms].map(|ms| ms.parse::<i64>().unwrap());
        match track.at(time_ms * MS, beyond_ms * MS) {
            Ok(found) => {
                assert_ne!(expected, "none", "{name}: {found}");
                let (off_m, off_rad) = pose_difference(&found, &pose(&numbers(&expected)));
                assert!(off_m < 1e-6 && off_rad < 1e-6, "{name}: {found}");
            }
            Err(outside) => assert_eq!(expected, "none", "{name}: {outside:?}"),
        }
    }
}
