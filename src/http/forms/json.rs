//! Points in JSON.

use std::borrow::Cow;

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, SchemaType, Type};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use mrol_map::geometry::Point;
use mrol_service::PointCloud;

/// `[[x, y, z], ...]`; a coordinate may be `null`, which stands for "no return" (JSON has no NaN).
#[derive(Debug)]
pub(in crate::http) struct JsonPoints(Vec<Point>);

impl From<JsonPoints> for PointCloud {
    fn from(points: JsonPoints) -> Self {
        points.0.into()
    }
}

impl ToSchema for JsonPoints {
    fn name() -> Cow<'static, str> {
        "Points".into()
    }
}

impl PartialSchema for JsonPoints {
    fn schema() -> RefOr<Schema> {
        let coordinate = SchemaType::from_iter([Type::Number, Type::Null]);
        let coordinates = ArrayBuilder::new().items(ObjectBuilder::new().schema_type(coordinate));
        let points = ArrayBuilder::new().items(coordinates.min_items(Some(3)).max_items(Some(3)));
        let description = "Points `[x, y, z]`, meters; null in a scan stands for \"no return\". At most \
                           `limits.points_per_request_max`.";
        points.description(Some(description)).into()
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
