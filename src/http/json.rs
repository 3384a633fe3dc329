//! The pieces of JSON that several routes share.

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::geometry::{self, Point, Pose, PoseError};
use crate::service::{MapVersion, PointCloud};

/// `[[x, y, z], ...]`; a coordinate may be `null`, which stands for "no return" (JSON has no NaN).
#[derive(Debug)]
pub(super) struct JsonPoints(Vec<Point>);

impl From<JsonPoints> for PointCloud {
    fn from(points: JsonPoints) -> Self {
        points.0.into()
    }
}

impl<'de> Deserialize<'de> for JsonPoints {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(PointsVisitor)
    }
}

/// Reads points one by one, so that no array of arrays is built on the way.
struct PointsVisitor;

impl<'de> Visitor<'de> for PointsVisitor {
    type Value = JsonPoints;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an array of points [x, y, z]")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<JsonPoints, A::Error> {
        let mut points = Vec::new();
        while let Some(coordinates) = seq.next_element::<[Option<f32>; 3]>()? {
            points.push(coordinates.map(|c| c.unwrap_or(f32::NAN)).into());
        }
        Ok(JsonPoints(points))
    }
}

/// A rigid transform.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JsonPose {
    translation_m: [f64; 3],
    rotation_xyzw: [f64; 4],
}

impl TryFrom<JsonPose> for Pose {
    type Error = PoseError;

    fn try_from(pose: JsonPose) -> Result<Self, PoseError> {
        geometry::pose(pose.translation_m, pose.rotation_xyzw)
    }
}

impl From<&Pose> for JsonPose {
    fn from(pose: &Pose) -> Self {
        Self { translation_m: geometry::translation_m(pose), rotation_xyzw: geometry::rotation_xyzw(pose) }
    }
}

/// Which state of which map an answer speaks of; part of every answer's object.
#[derive(Debug, Serialize)]
pub(super) struct JsonVersion {
    revision: u64,
    map_uuid: String,
}

impl From<MapVersion> for JsonVersion {
    fn from(version: MapVersion) -> Self {
        Self { revision: version.revision, map_uuid: version.map_uuid.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_null_coordinate_is_no_return() {
        let JsonPoints(points) = serde_json::from_str("[[1, 2.5, -3], [0, null, 0]]").unwrap();
        assert_eq!(points[0], Point::new(1.0, 2.5, -3.0));
        assert!(!points[1].is_finite());
    }

    #[test]
    fn a_point_of_other_than_three_numbers_is_refused_with_its_place() {
        for bad in ["[[1, 2]]", "[[1, 2, 3, 4]]", "[[1, 2, \"3\"]]", "[1, 2, 3]", "{}"] {
            let error = serde_json::from_str::<JsonPoints>(bad).unwrap_err().to_string();
            assert!(error.contains("line 1 column"), "{error}");
        }
    }
}
