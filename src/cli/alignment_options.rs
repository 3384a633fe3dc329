//! Options of commands that align scans.

use clap::ValueEnum;

use mrol::console::parse;
use mrol_map::align::Method;
use mrol_map::mapping::Guess;
use mrol_map::scan::{PointFilter, PointFilterError};
use mrol_map::visibility::SensorModel;

/// Options of the alignment.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct AlignmentOptions {
    /// How to align: the ascent on overlap and a refinement on the points' Gaussians (refined), or the ascent alone as
    /// in the paper (overlap) [default: refined]
    #[arg(long, value_parser = parse::keyword::<Method>())]
    method: Option<Method>,
}

/// Guess of a scan's pose: the last accepted pose, or one as far on as that is from the pose before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum GuessName {
    #[default]
    Previous,
    ConstantVelocity,
}

impl From<GuessName> for Guess {
    fn from(name: GuessName) -> Self {
        match name {
            GuessName::Previous => Self::Last,
            GuessName::ConstantVelocity => Self::ConstantVelocity,
        }
    }
}

impl AlignmentOptions {
    pub(super) fn method(&self) -> Option<Method> {
        self.method
    }
}

/// Options that filter the points of scans.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct PointOptions {
    /// Skip points nearer to the sensor than this
    #[arg(long, value_name = "METERS")]
    range_min: Option<f64>,
    /// Skip points farther from the sensor than this
    #[arg(long, value_name = "METERS")]
    range_max: Option<f64>,
    /// Skip points in this box in the sensor frame, the robot itself: "x y z x y z"
    #[arg(long, value_name = "BOX", allow_hyphen_values = true, value_parser = parse::corners)]
    body: Option<([f64; 3], [f64; 3])>,
    /// How the rays of the sensor lie, so that it is not found out scan by scan: "spinning RINGS COLUMNS LOWEST_DEG
    /// HIGHEST_DEG" or "pinhole WIDTH HEIGHT FX FY"
    #[arg(long, value_name = "MODEL")]
    sensor: Option<SensorModel>,
}

impl PointOptions {
    pub(super) fn filter(&self) -> Result<PointFilter, PointFilterError> {
        let Self { range_min, range_max, body, sensor: _ } = self;
        let filter = PointFilter {
            range_min_m: *range_min,
            range_max_m: *range_max,
            body_m: *body,
            ..PointFilter::default()
        };
        filter.checked()
    }

    /// How the rays of the sensor lie, where it is said.
    pub(super) fn sensor(&self) -> Option<SensorModel> {
        self.sensor
    }
}
