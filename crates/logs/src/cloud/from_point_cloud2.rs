//! Clouds of `sensor_msgs/PointCloud2`.

use super::error::CloudError;
use super::field_column::{FieldColumn, PointLayout};
use super::raw_cloud::{Cloud, RawTimes, check_points};
use crate::message::PointCloud2;
use mrol_map::geometry::Point;
use mrol_map::util::excerpt;

/// Names of fields in which drivers write when a point was measured: Ouster `t`, Velodyne `time`, Hesai, RoboSense and
/// Livox `timestamp`, Livox `offset_time`.
pub const TIME_FIELDS: [&str; 7] =
    ["t", "time", "timestamp", "offset_time", "time_stamp", "time_offset", "point_time"];

/// Names of fields in which drivers write which laser measured a point.
const RING_FIELDS: [&str; 5] = ["ring", "line", "channel", "laser_id", "laser"];

/// Names of fields that an error lists, at most.
const FIELDS_LISTED: usize = 12;

impl Cloud {
    /// The points of a message, whose times are those of `time_field`, or of the first of [`TIME_FIELDS`] that it has.
    ///
    /// # Errors
    /// When x, y, z or `time_field` is missing or of an unknown type, or they do not lie within the data.
    pub(super) fn of_point_cloud2(
        message: &PointCloud2<'_>,
        time_field: Option<&str>,
    ) -> Result<Self, CloudError> {
        let layout = PointLayout::of(message)?;
        check_points(layout.len())?;
        let column = |name: &str| {
            let field = message.field(name).ok_or_else(|| missing(name, message))?;
            FieldColumn::of(message, field)
        };
        let [x, y, z] = [column("x")?, column("y")?, column("z")?];
        let time_field =
            time_field.or_else(|| TIME_FIELDS.into_iter().find(|name| message.field(name).is_some()));
        let times = match time_field {
            Some(name) => {
                let column = column(name)?;
                let values = column.values(layout.points(message.data));
                Some(RawTimes { field: name.to_owned(), field_type: column.field_type, values })
            }
            None => None,
        };
        let ring = RING_FIELDS.iter().find_map(|name| message.field(name));
        let ring = ring.map(|field| FieldColumn::of(message, field)).transpose()?;
        let ring = ring.filter(|column| column.field_type.is_integer());
        let rings = ring.map_or_else(Vec::new, |column| {
            layout.points(message.data).map(|point| column.i64(point) as u16).collect()
        });
        Ok(Self {
            stamp_ns: message.header.stamp_ns,
            frame: message.header.frame.to_owned(),
            points: points(message, layout, [x, y, z]),
            times,
            rings,
        })
    }
}

fn points(message: &PointCloud2<'_>, layout: PointLayout, [x, y, z]: [FieldColumn; 3]) -> Vec<Point> {
    let mut points = Vec::with_capacity(layout.len());
    let all = layout.points(message.data);
    let at = x.offset;
    if x.is_little_f32_at(at) && y.is_little_f32_at(at + 4) && z.is_little_f32_at(at + 8) {
        let f32_at = |point: &[u8], at: usize| {
            f32::from_le_bytes([point[at], point[at + 1], point[at + 2], point[at + 3]])
        };
        points.extend(
            all.map(|point| Point::new(f32_at(point, at), f32_at(point, at + 4), f32_at(point, at + 8))),
        );
    } else {
        points.extend(all.map(|point| Point::new(x.f32(point), y.f32(point), z.f32(point))));
    }
    points
}

fn missing(name: &str, message: &PointCloud2<'_>) -> CloudError {
    let mut fields: Vec<_> =
        message.fields.iter().map(|field| excerpt(field.name)).take(FIELDS_LISTED).collect();
    if message.fields.len() > FIELDS_LISTED {
        fields.push("...".to_owned());
    }
    CloudError::FieldMissing { missing: name.to_owned(), fields: fields.join(" ") }
}
