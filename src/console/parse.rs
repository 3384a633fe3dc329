//! Parsers for values of options: poses, points, regions, names.

use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::survey::OriginChoice;
use mrol_map::align::localize::SearchBox;
use mrol_map::geometry;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{KeepOutName, MapName, Region, RequestId, RobotName, SessionName};
use mrol_map::mapping::SENSOR_HEIGHT_MAX_M;
use mrol_map::planning::{GridArea, Sphere};
use mrol_map::util::Keyword;
use mrol_service::replication::NodeName;

/// A parser for keywords; `--help` lists them.
pub fn keyword<T: Keyword>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(T::ALL.iter().map(|value| value.as_str()))
        .map(|word| T::from_word(&word).expect("one of the words"))
}

/// Parses a pose "x y z qx qy qz qw": meters, and a unit quaternion.
pub fn pose(text: &str) -> Result<Pose, String> {
    let [x, y, z, qx, qy, qz, qw] = numbers(text, "x y z qx qy qz qw")?;
    geometry::pose([x, y, z], [qx, qy, qz, qw]).map_err(|error| error.to_string())
}

/// Parses the height of a sensor above the floor, meters.
pub fn sensor_height(text: &str) -> Result<f64, String> {
    let [height_m] = numbers(text, "a number of meters")?;
    match height_m.abs() <= SENSOR_HEIGHT_MAX_M {
        true => Ok(height_m),
        false => {
            Err(format!("must be from -{SENSOR_HEIGHT_MAX_M} to {SENSOR_HEIGHT_MAX_M} m, got {height_m}"))
        }
    }
}

/// Parses how many steps of a depth image a meter has.
pub fn depth_scale(text: &str) -> Result<f64, String> {
    let [steps] = numbers(text, "a number of steps a meter")?;
    match steps > 0.0 && f64::is_finite(steps) {
        true => Ok(steps),
        false => Err(format!("must be above 0, got {steps}")),
    }
}

/// Parses a point "x,y,z", meters.
pub fn point(text: &str) -> Result<Point, String> {
    let [x, y, z] = numbers(text, "x,y,z")?;
    Ok(Point::from(nalgebra::Point3::new(x, y, z)))
}

/// Parses a box "x y z x y z": smallest and largest corner, meters.
pub fn cuboid(text: &str) -> Result<Region, String> {
    let (min_m, max_m) = corners(text)?;
    Region::cuboid(min_m, max_m).map_err(|error| error.to_string())
}

/// Parses the origin of a map in a survey: "x y z" (meters) or "auto".
pub fn origin(text: &str) -> Result<OriginChoice, String> {
    match text.trim() {
        "auto" => Ok(OriginChoice::Auto),
        text => numbers(text, "x y z, or auto").map(OriginChoice::At),
    }
}

/// Parses two corners "x y z x y z", meters.
pub fn corners(text: &str) -> Result<([f64; 3], [f64; 3]), String> {
    let [x0, y0, z0, x1, y1, z1] = numbers(text, "x y z x y z")?;
    Ok(([x0, y0, z0], [x1, y1, z1]))
}

/// Parses a sphere of a body "x y z r": center and radius, meters.
pub fn sphere(text: &str) -> Result<Sphere, String> {
    let [x, y, z, radius_m] = numbers(text, "x y z r")?.map(|number: f64| number as f32);
    Ok(Sphere { center_m: [x, y, z], radius_m })
}

/// Parses a band of height "z z": lowest and highest, meters.
pub fn band(text: &str) -> Result<[f64; 2], String> {
    let [lowest, highest] = numbers(text, "z z")?;
    match lowest <= highest {
        true => Ok([lowest, highest]),
        false => Err(format!("the lowest height comes first, got {lowest} and {highest}")),
    }
}

/// Parses a rectangle "x y x y": smallest and largest corner, meters.
pub fn rectangle(text: &str) -> Result<GridArea, String> {
    let [x0, y0, x1, y1] = numbers(text, "x y x y")?;
    Ok(GridArea::Rectangle { min_m: [x0, y0], max_m: [x1, y1] })
}

/// Parses the box of a search "x y z x y z": smallest and largest corner, meters.
pub fn search_box(text: &str) -> Result<SearchBox, String> {
    let [x0, y0, z0, x1, y1, z1] = numbers(text, "x y z x y z")?;
    SearchBox::new([x0, y0, z0], [x1, y1, z1]).map_err(|error| error.to_string())
}

/// Parses a vector "x,y,z".
pub fn vector(text: &str) -> Result<[f64; 3], String> {
    numbers(text, "x,y,z")
}

/// Parses a sphere "x y z r": center and radius, meters.
pub fn ball(text: &str) -> Result<Region, String> {
    let [x, y, z, radius_m] = numbers(text, "x y z r")?;
    Region::ball([x, y, z], radius_m).map_err(|error| error.to_string())
}

/// Parses a box of any orientation "x y z qx qy qz qw sx sy sz": its center, its rotation and its sides, meters.
pub fn oriented_box(text: &str) -> Result<Region, String> {
    let form = "x y z qx qy qz qw sx sy sz";
    let [x, y, z, qx, qy, qz, qw, sx, sy, sz] = numbers(text, form)?;
    let map_from_box = geometry::pose([x, y, z], [qx, qy, qz, qw]).map_err(|error| error.to_string())?;
    Region::oriented_box(map_from_box, [sx, sy, sz]).map_err(|error| error.to_string())
}

/// Corners of a polygon, x and y of each, meters.
#[derive(Debug, Clone)]
pub struct Polygon(pub Vec<[f64; 2]>);

/// Parses the corners of a polygon "x y x y x y ...", meters.
pub fn polygon(text: &str) -> Result<Polygon, String> {
    let all = number_list(text, "x y x y x y ...")?;
    match all.as_chunks() {
        (corners, []) => Ok(Polygon(corners.to_vec())),
        _ => Err(format!("two numbers a corner are needed, got {}", all.len())),
    }
}

/// Parses two heights "from to", meters.
pub fn heights(text: &str) -> Result<[f64; 2], String> {
    numbers(text, "from to")
}

/// Parses a time such as 90s, 15m, 8h or 2d.
pub fn duration(text: &str) -> Result<Duration, String> {
    const UNITS: [(char, u64); 4] = [('s', 1), ('m', 60), ('h', 3600), ('d', 86_400)];
    let unit = UNITS.iter().find(|(unit, _)| text.ends_with(*unit));
    let seconds = unit.and_then(|(unit, seconds)| {
        let count: u32 = text.strip_suffix(*unit)?.parse().ok().filter(|count| *count > 0)?;
        Some(u64::from(count) * seconds)
    });
    seconds.map(Duration::from_secs).ok_or_else(|| format!("{text:?} is no time such as 90s, 15m, 8h or 2d"))
}

/// Parses the name of a keep-out.
pub fn keep_out_name(text: &str) -> Result<KeepOutName, String> {
    KeepOutName::new(text).map_err(|error| error.to_string())
}

/// Parses the name of a map.
pub fn map_name(text: &str) -> Result<MapName, String> {
    MapName::new(text).map_err(|error| error.to_string())
}

/// Parses the name of a node of a cluster.
pub fn node_name(text: &str) -> Result<NodeName, String> {
    NodeName::new(text).map_err(|error| error.to_string())
}

/// Parses the name of a robot.
pub fn robot_name(text: &str) -> Result<RobotName, String> {
    RobotName::new(text).map_err(|error| error.to_string())
}

/// Parses a session's name.
pub fn session_name(text: &str) -> Result<SessionName, String> {
    SessionName::new(text).map_err(|error| error.to_string())
}

/// Parses a request id.
pub fn request_id(text: &str) -> Result<RequestId, String> {
    RequestId::new(text).map_err(|error| error.to_string())
}

/// Parses `N` numbers, separated by spaces or commas.
pub(crate) fn numbers<const N: usize>(text: &str, form: &str) -> Result<[f64; N], String> {
    <[f64; N]>::try_from(number_list(text, form)?)
        .map_err(|numbers| format!("{N} numbers are needed, \"{form}\", got {}", numbers.len()))
}

/// Parses any number of numbers, separated by spaces or commas.
fn number_list(text: &str, form: &str) -> Result<Vec<f64>, String> {
    let words = text.split([' ', ',']).filter(|word| !word.is_empty());
    let number =
        |word: &str| word.parse().map_err(|_| format!("{word:?} is no number; the form is \"{form}\""));
    words.map(number).collect()
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
    fn a_time_is_a_number_with_its_unit() {
        for (text, seconds) in [("90s", 90), ("15m", 900), ("8h", 28_800), ("2d", 172_800)] {
            assert_eq!(duration(text), Ok(Duration::from_secs(seconds)));
        }
        for bad in ["", "s", "0s", "-1s", "1.5h", "8", "8 h", "8hh", "99999999999d"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_polygon_is_two_numbers_a_corner() {
        assert_eq!(polygon("0 0, 1 0, 0 1").unwrap().0, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        assert!(polygon("0 0 1").unwrap_err().contains("two numbers a corner are needed, got 3"));
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
