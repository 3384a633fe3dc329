//! Clouds of Livox's `CustomMsg`.

use super::raw_cloud::{Cloud, RawTimes, TimeValues};
use crate::message::{FieldType, LivoxCloud};

impl Cloud {
    /// The points of a message. Their times count from the time base: they are those of the sensor's clock, or, where
    /// the time base is 0, from the stamp.
    pub(super) fn of_livox(message: &LivoxCloud<'_>) -> Self {
        let base = i64::try_from(message.timebase_ns).unwrap_or(i64::MAX);
        let time = |offset: u32| base.saturating_add(i64::from(offset));
        Self {
            stamp_ns: message.header.stamp_ns,
            frame: message.header.frame.to_owned(),
            points: message.points.iter().map(|point| point.xyz.into()).collect(),
            times: Some(RawTimes {
                field: "offset_time".to_owned(),
                field_type: FieldType::U64,
                values: TimeValues::Integers(
                    message.points.iter().map(|point| time(point.offset_ns)).collect(),
                ),
            }),
            rings: message.points.iter().map(|point| u16::from(point.line)).collect(),
        }
    }
}
