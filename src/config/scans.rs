//! How scans are aligned, and which of their points count.

use serde::{Deserialize, Serialize};

use crate::align::Method;
use crate::scan::PointFilter;
use crate::wire::json::ByKeyword;

/// How scans are aligned.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AlignmentConfig {
    /// How scans are aligned whose request does not say: `refined` or `overlap`. `refined`.
    pub method: ByKeyword<Method>,
}

/// Which points of a robot's scans count; a request may say otherwise.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotConfig {
    /// Distance from the sensor, meters; nearer points are skipped.
    pub range_min_m: Option<f64>,
    /// Distance from the sensor, meters; farther points are skipped.
    pub range_max_m: Option<f64>,
    /// The robot's own body in the sensor frame, meters: smallest and largest corner.
    pub body_m: Option<[[f64; 3]; 2]>,
}

impl RobotConfig {
    pub(super) fn filter(&self) -> PointFilter {
        let body_m = self.body_m.map(|[min_m, max_m]| (min_m, max_m));
        PointFilter { range_min_m: self.range_min_m, range_max_m: self.range_max_m, body_m }
    }
}
