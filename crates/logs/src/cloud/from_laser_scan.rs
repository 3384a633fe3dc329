//! Clouds of `sensor_msgs/LaserScan`.

use super::raw_cloud::{Cloud, RawTimes, TimeValues};
use crate::message::{FieldType, LaserScan};
use mrol_map::geometry::Point;

impl Cloud {
    /// The ends of the rays, in the plane z = 0 of the sensor; not finite where nothing returned.
    pub(super) fn of_laser_scan(message: &LaserScan<'_>) -> Self {
        let is_range = |range: f32| range >= message.range_min_m && range <= message.range_max_m;
        let point = |(k, &range): (usize, &f32)| {
            let angle = f64::from(message.angle_min_rad) + k as f64 * f64::from(message.angle_increment_rad);
            let range = if is_range(range) { f64::from(range) } else { f64::NAN };
            Point::from(nalgebra::Point3::new(range * angle.cos(), range * angle.sin(), 0.0 * range))
        };
        let step_s = f64::from(message.time_increment_s);
        let times = (step_s != 0.0).then(|| RawTimes {
            field: "time_increment".to_owned(),
            field_type: FieldType::F32,
            values: TimeValues::Floats((0..message.ranges_m.len()).map(|k| k as f64 * step_s).collect()),
        });
        Self {
            stamp_ns: message.header.stamp_ns,
            frame: message.header.frame.to_owned(),
            points: message.ranges_m.iter().enumerate().map(point).collect(),
            times,
            rings: Vec::new(),
        }
    }
}
