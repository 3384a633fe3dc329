//! Clouds as drivers write them are read bit for bit, with their times.

use super::support::{CdrWriter, DRIVERS, Driver};
use mrol_logs::cloud::{Cloud, CloudError, CloudOptions};
use mrol_logs::message::MessageKind;
use mrol_logs::point_times::{NoTimes, TimesFrom, TimesRule};
use mrol_map::geometry::Point;
use proptest::prelude::*;

const END_NS: i64 = 1_764_370_870_123_456_789;
const RINGS: u16 = 4;

/// A sweep of a tenth of a second, with points where nothing returned.
fn sweep() -> (Vec<Point>, Vec<f32>) {
    let point = |k: usize| match k % 7 {
        3 => Point::new(f32::NAN, f32::NAN, f32::NAN),
        5 => Point::new(0.0, 0.0, 0.0),
        _ => Point::new(1.0 + k as f32 / 3.0, -0.1 * k as f32, 1e-7 * k as f32),
    };
    let time_s = |k: usize| ((k / usize::from(RINGS) + 1) as f32 / 50.0 - 1.0) * 0.1;
    (0..200).map(|k| (point(k), time_s(k))).unzip()
}

fn read(driver: &Driver, points: &[Point], times_s: &[f32]) -> Cloud {
    let message = (driver.write)(END_NS, "lidar", points, times_s, RINGS);
    let kind = MessageKind::of_type(driver.type_name).unwrap();
    Cloud::read(kind, &message, CloudOptions::default())
        .unwrap_or_else(|error| panic!("{}: {error}", driver.name))
}

#[test]
fn points_are_bit_equal_and_times_right_to_a_microsecond() {
    let (points, times_s) = sweep();
    for driver in &DRIVERS {
        let (name, cloud) = (driver.name, read(driver, &points, &times_s));
        assert_eq!(cloud.frame, "lidar", "{name}");
        let bits =
            |points: &[Point]| -> Vec<_> { points.iter().map(|p| p.xyz().map(f32::to_bits)).collect() };
        assert_eq!(bits(&cloud.points), bits(&points), "{name}");
        let found = cloud.times.as_ref().map(|raw| (raw, TimesRule::find(&cloud, raw)));
        let Some((raw, found)) = found else {
            assert!(!driver.has_times, "{name} has no times");
            continue;
        };
        assert!(driver.has_times, "{name} has times");
        let (rule, doubts) = found.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(doubts.is_empty(), "{name}: {doubts:?}");
        let read = rule.times_s(&cloud, raw).unwrap();
        for (k, (&read_s, &true_s)) in read.iter().zip(&times_s).enumerate() {
            let read_ns = cloud.stamp_ns - END_NS + (f64::from(read_s) * 1e9).round() as i64;
            let error_ns = read_ns - (f64::from(true_s) * 1e9).round() as i64;
            // One driver writes whole microseconds.
            assert!(error_ns.abs() <= 1010, "{name}: point {k} is {error_ns} ns off");
        }
    }
}

/// A Velodyne cloud whose times are these.
fn with_times(times_s: &[f32]) -> Cloud {
    let points: Vec<_> =
        times_s.iter().enumerate().map(|(k, _)| Point::new(1.0 + k as f32, 0.0, 0.0)).collect();
    read(&DRIVERS[1], &points, times_s)
}

#[test]
fn what_is_no_sweep_is_told() {
    let refused = |times_s: &[f32]| {
        let cloud = with_times(times_s);
        TimesRule::find(&cloud, cloud.times.as_ref().unwrap()).unwrap_err()
    };
    assert!(matches!(refused(&[0.0; 8]), NoTimes::AllEqual { value: 0.0, .. }));
    assert!(matches!(refused(&[0.25; 8]), NoTimes::AllEqual { .. }));
    assert!(matches!(refused(&[0.0, f32::NAN, 0.1]), NoTimes::NotFinite { .. }));
    let message = refused(&[0.0, 1e-5]).to_string();
    assert!(message.contains("field time") && message.contains("--times time:UNIT:FROM"), "{message}");
    let cloud = read(&DRIVERS[1], &[Point::new(f32::NAN, 0.0, 0.0)], &[0.0]);
    assert_eq!(TimesRule::find(&cloud, cloud.times.as_ref().unwrap()), Err(NoTimes::NoReturns));
}

#[test]
fn where_a_clock_begins_times_count_from_what_fits_them_or_are_not_used() {
    const MS: i64 = 1_000_000;
    let found = |stamp_ms: i64, times_s: &[f32]| {
        let cloud = Cloud { stamp_ns: stamp_ms * MS, ..with_times(times_s) };
        TimesRule::find(&cloud, cloud.times.as_ref().unwrap()).map(|(rule, _)| rule.from)
    };
    // Of a simulated clock: sweeps of 0.1 s that begin at their stamps, by the same clock and from the stamp.
    assert_eq!(found(500, &[0.5, 0.55, 0.6]), Ok(TimesFrom::Epoch));
    assert_eq!(found(100, &[0.1, 0.15, 0.2]), Ok(TimesFrom::Epoch));
    assert_eq!(found(500, &[0.0, 0.05, 0.1]), Ok(TimesFrom::Stamp));
    assert_eq!(found(0, &[0.0, 0.05, 0.1]), Ok(TimesFrom::Stamp));
    // One that ends at its stamp by the clock, or begins there.
    assert!(matches!(found(100, &[0.0, 0.05, 0.1]), Err(NoTimes::TwoOrigins { .. })));
}

#[test]
fn times_of_another_clock_and_times_out_of_order_are_used_and_told() {
    let cloud = with_times(&[1000.0, 1000.05, 1000.1, 1000.1]);
    let (rule, doubts) = TimesRule::find(&cloud, cloud.times.as_ref().unwrap()).unwrap();
    assert!(doubts[0].to_string().contains("another clock"), "{doubts:?}");
    let times_s = rule.times_s(&cloud, cloud.times.as_ref().unwrap()).unwrap();
    assert!(times_s[0] == 0.0 && (times_s[2] - 0.1).abs() < 1e-3, "{times_s:?}");
    let backwards: Vec<f32> = (0..40).map(|k| -0.002 * k as f32).collect();
    let cloud = with_times(&backwards);
    let (_, doubts) = TimesRule::find(&cloud, cloud.times.as_ref().unwrap()).unwrap();
    assert!(doubts[0].to_string().contains("older than the one before"), "{doubts:?}");
}

#[test]
fn a_cloud_whose_times_leave_the_unit_of_the_first_has_none() {
    let first = with_times(&[0.0, 0.05, 0.1]);
    let (rule, _) = TimesRule::find(&first, first.times.as_ref().unwrap()).unwrap();
    // Alone, it would be a sweep of 3 ms.
    for times_s in [[0.0, 1.0, 3.0], [f32::MIN, 0.0, f32::MAX]] {
        let other = with_times(&times_s);
        let refused = rule.times_s(&other, other.times.as_ref().unwrap()).unwrap_err();
        assert!(matches!(refused, NoTimes::TooFar { .. }), "{refused}");
    }
}

/// A `PointCloud2` of one field x at an offset, and sizes as they are told.
fn claimed(height: u32, width: u32, point_step: u32, row_step: u32, offset: u32, data: &[u8]) -> Vec<u8> {
    let mut writer = CdrWriter::new(false);
    writer.header(0, "lidar");
    writer.u32(height);
    writer.u32(width);
    writer.u32(3);
    for name in ["x", "y", "z"] {
        writer.string(name);
        writer.u32(offset);
        writer.u8(7);
        writer.u32(1);
    }
    writer.u8(0);
    writer.u32(point_step);
    writer.u32(row_step);
    writer.octets(data);
    writer.u8(1);
    writer.finish()
}

#[test]
fn sizes_that_the_data_does_not_have_are_refused_and_named() {
    let read = |message: &[u8]| Cloud::read(MessageKind::PointCloud2, message, CloudOptions::default());
    let most = 1 << 31;
    for (height, width) in [(1, most), (most, 1), (most, most), (u32::MAX, u32::MAX)] {
        for point_step in [0, 4, 16, u32::MAX] {
            let refused = read(&claimed(height, width, point_step, 0, 0, &[0; 64])).unwrap_err();
            assert!(matches!(refused, CloudError::DataShort { .. }), "{refused}");
        }
    }
    for (height, width) in [(1, 0), (0, most), (most, 0)] {
        assert!(read(&claimed(height, width, 16, 0, 0, &[])).unwrap().points.is_empty());
    }
    let outside = read(&claimed(1, 1, 4, 4, u32::MAX, &[0; 4])).unwrap_err();
    assert!(matches!(outside, CloudError::FieldOutside { .. }), "{outside}");
    let overlap = read(&claimed(2, 4, 4, 8, 0, &[0; 64])).unwrap_err();
    assert!(matches!(overlap, CloudError::RowStep { .. }), "{overlap}");
}

proptest! {
    /// Any message, cut or with a byte changed, is a cloud of as many points as it has bytes for, or an error.
    #[test]
    fn damaged_messages_are_clouds_or_errors(
        driver in 0..DRIVERS.len(),
        cut in any::<prop::sample::Index>(),
        at in any::<prop::sample::Index>(),
        byte in any::<u8>(),
    ) {
        let (points, times_s) = sweep();
        let driver = &DRIVERS[driver];
        let mut message = (driver.write)(END_NS, "lidar", &points, &times_s, RINGS);
        let at = at.index(message.len());
        message[at] = byte;
        message.truncate(cut.index(2 * message.len()));
        let kind = MessageKind::of_type(driver.type_name).unwrap();
        if let Ok(cloud) = Cloud::read(kind, &message, CloudOptions::default()) {
            prop_assert!(cloud.points.len() <= message.len());
            if let Some(raw) = &cloud.times {
                prop_assert_eq!(raw.values.len(), cloud.points.len());
                if let Ok((rule, _)) = TimesRule::find(&cloud, raw) {
                    let _ = rule.times_s(&cloud, raw);
                }
            }
        }
    }
}
