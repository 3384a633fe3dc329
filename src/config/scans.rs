//! Sections `alignment` and `robots` of the settings.

use serde::{Deserialize, Serialize};

use crate::align::Method;
use crate::scan::PointFilter;
use crate::service::RobotSettings;
use crate::wire::json::ByKeyword;

/// Settings of alignment.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AlignmentConfig {
    /// Method of alignment for requests that do not say: `refined` or `overlap`. `refined`.
    pub method: ByKeyword<Method>,
}

/// Settings of a robot's scans; a request may override each value.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotConfig {
    /// Least range: points nearer to the sensor than this are skipped, meters.
    pub range_min_m: Option<f64>,
    /// Largest range: points farther from the sensor than this are skipped, meters.
    pub range_max_m: Option<f64>,
    /// Box of the robot's own body in the sensor frame, meters: smallest and largest corner. Points within it are
    /// skipped.
    pub body_m: Option<[[f64; 3]; 2]>,
    /// Look for the robot where its scans are refused. false.
    pub recover: bool,
}

impl RobotConfig {
    pub(super) fn settings(&self) -> RobotSettings {
        RobotSettings { filter: self.filter(), recover: self.recover }
    }

    pub(super) fn filter(&self) -> PointFilter {
        let body_m = self.body_m.map(|[min_m, max_m]| (min_m, max_m));
        PointFilter { range_min_m: self.range_min_m, range_max_m: self.range_max_m, body_m }
    }
}
