//! Sensor models: how the rays of a robot's sensor lie, as its maker tells.

use std::fmt::{self, Display};
use std::str::FromStr;

use crate::util::excerpt;

/// Most rings of a spinning sensor.
const RINGS_MAX: u32 = 1024;
/// Most columns of a spinning sensor, and pixels along a side of a camera.
const COLUMNS_MAX: u32 = 65_536;
/// Smallest and largest focal length of a camera, pixels.
const FOCAL_PX: [f64; 2] = [1.0, 1e6];
/// How a model is written.
const FORMS: &str = "\"spinning RINGS COLUMNS LOWEST_DEG HIGHEST_DEG\" or \"pinhole WIDTH HEIGHT FX FY\"";

/// How the rays of a sensor lie: how many there are, and from their angles how far from each other they run.
///
/// Written as text, as settings, requests and options have it: `spinning 64 1800 -24.9 2` or `pinhole 640 480 525 525`.
///
/// ```
/// use mrol_map::visibility::SensorModel;
///
/// let lidar: SensorModel = "spinning 64 1800 -24.9 2".parse().unwrap();
/// assert_eq!(lidar.to_string(), "spinning 64 1800 -24.9 2");
/// let [to_side, up] = lidar.steps_rad().map(f64::to_degrees);
/// assert!((to_side - 0.2).abs() < 1e-9 && (up - 26.9 / 63.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SensorModel {
    /// A lidar that turns, or an organized cloud of one: rings are the cloud's height, and columns its width.
    Spinning {
        /// Lasers, one above the other, evenly spread over the field of view.
        rings: u32,
        /// Shots of each laser in a full turn.
        columns: u32,
        /// Elevation of the lowest ring, degrees.
        lowest_deg: f64,
        /// Elevation of the highest ring, degrees.
        highest_deg: f64,
    },
    /// A depth camera.
    Pinhole {
        /// Pixels of a row.
        width: u32,
        /// Pixels of a column.
        height: u32,
        /// Focal length to the side, pixels.
        fx: f64,
        /// Focal length up, pixels.
        fy: f64,
    },
}

/// Why a sensor model is not valid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SensorModelError {
    /// A text that is no model.
    #[error("a sensor model must be {FORMS}, got {0:?}")]
    Form(String),
    /// A number of rays that is out of range.
    #[error("{name} must lie in 1..={most}, got {value}")]
    Count {
        /// Which number.
        name: &'static str,
        /// Its value.
        value: u32,
        /// Its largest value.
        most: u32,
    },
    /// Rings without a field of view, or with one that is no part of a half turn.
    #[error(
        "lowest_deg and highest_deg must lie in -90..=90, the lower first, got {lowest_deg} and {highest_deg}"
    )]
    Elevations {
        /// Elevation of the lowest ring, degrees.
        lowest_deg: f64,
        /// Elevation of the highest ring, degrees.
        highest_deg: f64,
    },
    /// A focal length that is out of range.
    #[error("{name} must lie in {}..={} pixels, got {value}", FOCAL_PX[0], FOCAL_PX[1])]
    Focal {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
}

impl SensorModel {
    /// Checks the model's numbers, and returns the model.
    ///
    /// # Errors
    /// Names what is out of range.
    pub fn checked(self) -> Result<Self, SensorModelError> {
        let counts = match self {
            Self::Spinning { rings, columns, .. } => {
                [("rings", rings, RINGS_MAX), ("columns", columns, COLUMNS_MAX)]
            }
            Self::Pinhole { width, height, .. } => {
                [("width", width, COLUMNS_MAX), ("height", height, COLUMNS_MAX)]
            }
        };
        if let Some((name, value, most)) =
            counts.into_iter().find(|(_, value, most)| !(1..=*most).contains(value))
        {
            return Err(SensorModelError::Count { name, value, most });
        }
        match self {
            Self::Spinning { rings, lowest_deg, highest_deg, .. } => {
                let are_in_range = [lowest_deg, highest_deg].iter().all(|deg| (-90.0..=90.0).contains(deg));
                // One ring has one elevation.
                let are_in_order = lowest_deg < highest_deg || rings == 1 && lowest_deg == highest_deg;
                if are_in_range && are_in_order {
                    Ok(self)
                } else {
                    Err(SensorModelError::Elevations { lowest_deg, highest_deg })
                }
            }
            Self::Pinhole { fx, fy, .. } => {
                let is_out = |&(_, value): &(_, f64)| !(FOCAL_PX[0]..=FOCAL_PX[1]).contains(&value);
                match [("fx", fx), ("fy", fy)].into_iter().find(is_out) {
                    Some((name, value)) => Err(SensorModelError::Focal { name, value }),
                    None => Ok(self),
                }
            }
        }
    }

    /// All rays of a scan.
    pub fn rays(&self) -> usize {
        match *self {
            Self::Spinning { rings: rows, columns, .. }
            | Self::Pinhole { height: rows, width: columns, .. } => rows as usize * columns as usize,
        }
    }

    /// The largest angles between neighboring rays, to the side and up, radians: of a spinning sensor those of a level
    /// ring, and of a camera those in the middle of its picture.
    pub fn steps_rad(&self) -> [f64; 2] {
        match *self {
            Self::Spinning { rings, columns, lowest_deg, highest_deg } => {
                let to_side = std::f64::consts::TAU / f64::from(columns);
                // A single ring has no neighbors above it that would lie farther away than those beside it.
                let between_rings = || ((highest_deg - lowest_deg) / f64::from(rings - 1)).to_radians();
                [to_side, if rings > 1 { between_rings() } else { to_side }]
            }
            Self::Pinhole { fx, fy, .. } => [1.0 / fx, 1.0 / fy],
        }
    }
}

impl Display for SensorModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spinning { rings, columns, lowest_deg, highest_deg } => {
                write!(f, "spinning {rings} {columns} {lowest_deg} {highest_deg}")
            }
            Self::Pinhole { width, height, fx, fy } => write!(f, "pinhole {width} {height} {fx} {fy}"),
        }
    }
}

impl FromStr for SensorModel {
    type Err = SensorModelError;

    fn from_str(text: &str) -> Result<Self, SensorModelError> {
        let form = || SensorModelError::Form(excerpt(text));
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let [kind, a, b, c, d] = words[..] else { return Err(form()) };
        let count = |word: &str| word.parse::<u32>().map_err(|_| form());
        let number = |word: &str| word.parse::<f64>().map_err(|_| form());
        let model = match kind {
            "spinning" => Self::Spinning {
                rings: count(a)?,
                columns: count(b)?,
                lowest_deg: number(c)?,
                highest_deg: number(d)?,
            },
            "pinhole" => {
                Self::Pinhole { width: count(a)?, height: count(b)?, fx: number(c)?, fy: number(d)? }
            }
            _ => return Err(form()),
        };
        model.checked()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_is_read_from_the_text_that_it_prints() {
        for text in ["spinning 64 1800 -24.9 2", "spinning 1 360 0 0", "pinhole 640 480 525.5 525"] {
            assert_eq!(text.parse::<SensorModel>().unwrap().to_string(), text);
        }
        assert_eq!(
            " pinhole  640 480\t525 525 ".parse::<SensorModel>().unwrap().to_string(),
            "pinhole 640 480 525 525"
        );
    }

    #[test]
    fn errors_name_the_field_the_value_and_the_limit() {
        for (text, message) in [
            ("spinning 0 1800 -24.9 2", "rings must lie in 1..=1024, got 0"),
            ("spinning 1025 1800 -24.9 2", "rings must lie in 1..=1024, got 1025"),
            ("spinning 64 65537 -24.9 2", "columns must lie in 1..=65536, got 65537"),
            (
                "spinning 64 1800 2 -24.9",
                "lowest_deg and highest_deg must lie in -90..=90, the lower first, got 2 and -24.9",
            ),
            (
                "spinning 64 1800 -91 2",
                "lowest_deg and highest_deg must lie in -90..=90, the lower first, got -91 and 2",
            ),
            (
                "spinning 64 1800 NaN 2",
                "lowest_deg and highest_deg must lie in -90..=90, the lower first, got NaN and 2",
            ),
            ("pinhole 0 480 525 525", "width must lie in 1..=65536, got 0"),
            ("pinhole 640 480 0 525", "fx must lie in 1..=1000000 pixels, got 0"),
            ("pinhole 640 480 525 inf", "fy must lie in 1..=1000000 pixels, got inf"),
        ] {
            assert_eq!(text.parse::<SensorModel>().unwrap_err().to_string(), message);
        }
        for text in [
            "",
            "spinning 64 1800 -24.9",
            "lidar 64 1800 -24.9 2",
            "pinhole 640 480 525 525 320",
            "spinning -1 2 3 4",
        ] {
            let message = text.parse::<SensorModel>().unwrap_err().to_string();
            assert_eq!(message, format!("a sensor model must be {FORMS}, got {text:?}"));
        }
    }
}
