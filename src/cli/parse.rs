//! Parsers for values of options: poses, points, regions, names.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::align::localize::SearchBox;
use crate::geometry::{self, Point, Pose};
use crate::map::{MapName, Region, RequestId, RobotName, SessionName};
use crate::util::Keyword;

/// A parser for keywords; `--help` lists them.
pub(super) fn keyword<T: Keyword>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(T::ALL.iter().map(|value| value.as_str()))
        .map(|word| T::from_word(&word).expect("one of the words"))
}

/// Parses a pose "x y z qx qy qz qw": meters, and a unit quaternion.
pub(super) fn pose(text: &str) -> Result<Pose, String> {
    let [x, y, z, qx, qy, qz, qw] = numbers(text, "x y z qx qy qz qw")?;
    geometry::pose([x, y, z], [qx, qy, qz, qw]).map_err(|error| error.to_string())
}

/// Parses a point "x,y,z", meters.
pub(super) fn point(text: &str) -> Result<Point, String> {
    let [x, y, z] = numbers(text, "x,y,z")?;
    Ok(Point::from(nalgebra::Point3::new(x, y, z)))
}

/// Parses a box "x y z x y z": smallest and largest corner, meters.
pub(super) fn cuboid(text: &str) -> Result<Region, String> {
    let (min_m, max_m) = corners(text)?;
    Region::cuboid(min_m, max_m).map_err(|error| error.to_string())
}

/// Parses two corners "x y z x y z", meters.
pub(super) fn corners(text: &str) -> Result<([f64; 3], [f64; 3]), String> {
    let [x0, y0, z0, x1, y1, z1] = numbers(text, "x y z x y z")?;
    Ok(([x0, y0, z0], [x1, y1, z1]))
}

/// Parses the box of a search "x y z x y z": smallest and largest corner, meters.
pub(super) fn search_box(text: &str) -> Result<SearchBox, String> {
    let [x0, y0, z0, x1, y1, z1] = numbers(text, "x y z x y z")?;
    SearchBox::new([x0, y0, z0], [x1, y1, z1]).map_err(|error| error.to_string())
}

/// Parses a vector "x,y,z".
pub(super) fn vector(text: &str) -> Result<[f64; 3], String> {
    numbers(text, "x,y,z")
}

/// Parses a sphere "x y z r": center and radius, meters.
pub(super) fn ball(text: &str) -> Result<Region, String> {
    let [x, y, z, radius_m] = numbers(text, "x y z r")?;
    Region::ball([x, y, z], radius_m).map_err(|error| error.to_string())
}

/// Parses a box of any orientation "x y z qx qy qz qw sx sy sz": its center, its rotation and its sides, meters.
pub(super) fn oriented_box(text: &str) -> Result<Region, String> {
    let form = "x y z qx qy qz qw sx sy sz";
    let [x, y, z, qx, qy, qz, qw, sx, sy, sz] = numbers(text, form)?;
    let map_from_box = geometry::pose([x, y, z], [qx, qy, qz, qw]).map_err(|error| error.to_string())?;
    Region::oriented_box(map_from_box, [sx, sy, sz]).map_err(|error| error.to_string())
}

/// Parses the name of a map.
pub(super) fn map_name(text: &str) -> Result<MapName, String> {
    MapName::new(text).map_err(|error| error.to_string())
}

/// Parses the name of a robot.
pub(super) fn robot_name(text: &str) -> Result<RobotName, String> {
    RobotName::new(text).map_err(|error| error.to_string())
}

/// Parses a session's name.
pub(super) fn session_name(text: &str) -> Result<SessionName, String> {
    SessionName::new(text).map_err(|error| error.to_string())
}

/// Parses a request id.
pub(super) fn request_id(text: &str) -> Result<RequestId, String> {
    RequestId::new(text).map_err(|error| error.to_string())
}

/// Parses `N` numbers, separated by spaces or commas.
fn numbers<const N: usize>(text: &str, form: &str) -> Result<[f64; N], String> {
    let words = text.split([' ', ',']).filter(|word| !word.is_empty());
    let number =
        |word: &str| word.parse().map_err(|_| format!("{word:?} is no number; the form is \"{form}\""));
    let numbers: Vec<f64> = words.map(number).collect::<Result<_, String>>()?;
    <[f64; N]>::try_from(numbers)
        .map_err(|numbers| format!("{N} numbers are needed, \"{form}\", got {}", numbers.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_may_be_divided_by_spaces_or_commas() {
        for text in ["1 -2 3 0 0 0 1", "1,-2,3,0,0,0,1", " 1, -2, 3,  0 0 0 1 "] {
            assert_eq!(geometry::translation_m(&pose(text).unwrap()), [1.0, -2.0, 3.0]);
        }
        assert_eq!(point("1e-3,2,-3").unwrap(), Point::new(0.001, 2.0, -3.0));
    }

    #[test]
    fn an_error_repeats_the_word_or_the_form() {
        assert!(pose("1 2 3").unwrap_err().contains("7 numbers are needed, \"x y z qx qy qz qw\", got 3"));
        assert!(pose("1 2 x 0 0 0 1").unwrap_err().contains("\"x\" is no number"));
        assert!(pose("1 2 3 0 0 0 2").unwrap_err().contains("norm 2"));
        assert!(cuboid("1 0 0 0 1 1").unwrap_err().contains("must not exceed"));
        assert!(ball("0 0 0 -1").unwrap_err().contains("radius"));
        assert!(oriented_box("0 0 0 0 0 0 1 1 -1 1").unwrap_err().contains("size_m must not be negative"));
    }
}
