//! Sections `alignment` and `robots` of the settings.

use serde::{Deserialize, Serialize};

use crate::json::ByKeyword;
use mrol_map::align::Method;
use mrol_map::mapping::{CarvingSettings, OdometrySettings};
use mrol_map::scan::PointFilter;
use mrol_service::RobotSettings;

/// Settings of alignment.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AlignmentConfig {
    /// Method of alignment for requests that do not say: `refined` or `overlap`. `refined`.
    pub method: ByKeyword<Method>,
}

/// Settings of a robot's scans; a request may override each value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotConfig {
    /// Least range: points nearer to the sensor than this are skipped, meters.
    pub range_min_m: Option<f64>,
    /// Largest range: points farther from the sensor than this are skipped, meters.
    pub range_max_m: Option<f64>,
    /// How far "no return" reaches: points at this distance and farther say that nothing was met up to here, and are
    /// skipped, meters.
    pub no_return_m: Option<f64>,
    /// Box of the robot's own body in the sensor frame, meters: smallest and largest corner. Points within it are
    /// skipped.
    pub body_m: Option<[[f64; 3]; 2]>,
    /// Points at exactly 0 0 0 count as any other. false: they are skipped, since most drivers write them where nothing
    /// returned.
    pub keep_zeros: bool,
    /// Points beyond `range_max_m` say nothing. false: they tell that nothing was met up to there.
    pub beyond_range_is_noise: bool,
    /// Look for the robot where its scans are refused. false.
    pub recover: bool,
    /// Take out of the map what the robot's scans saw through. false.
    pub carve: bool,
    /// Voxels around the surface that a scan shows that it never takes out. 1.
    pub carve_margin_voxels: u32,
    /// A surface that is seen at a smaller angle than this is not told from a rim, and nothing beside rims is taken
    /// out, degrees. 8.
    pub carve_grazing_deg: f64,
    /// Voxels farther from the sensor than this are not taken out, meters. 20.
    pub carve_range_max_m: f64,
    /// Standard deviation of the length of a `motion`, as a share of it. 0.1.
    pub odometry_way_share: f64,
    /// Standard deviation of the turn of a `motion`, as a share of it. 0.1.
    pub odometry_turn_share: f64,
}

impl Default for RobotConfig {
    fn default() -> Self {
        let CarvingSettings { margin_voxels, grazing_deg, range_max_m } = CarvingSettings::default();
        let OdometrySettings { way_share, turn_share, .. } = OdometrySettings::default();
        Self {
            range_min_m: None,
            range_max_m: None,
            no_return_m: None,
            body_m: None,
            keep_zeros: false,
            beyond_range_is_noise: false,
            recover: false,
            carve: false,
            carve_margin_voxels: margin_voxels,
            carve_grazing_deg: grazing_deg,
            carve_range_max_m: range_max_m,
            odometry_way_share: way_share,
            odometry_turn_share: turn_share,
        }
    }
}

impl RobotConfig {
    pub(super) fn settings(&self) -> RobotSettings {
        RobotSettings {
            filter: self.filter(),
            recover: self.recover,
            carve: self.carve,
            carving: self.carving(),
            odometry: self.odometry(),
        }
    }

    pub(super) fn carving(&self) -> CarvingSettings {
        CarvingSettings {
            margin_voxels: self.carve_margin_voxels,
            grazing_deg: self.carve_grazing_deg,
            range_max_m: self.carve_range_max_m,
        }
    }

    pub(super) fn odometry(&self) -> OdometrySettings {
        OdometrySettings {
            way_share: self.odometry_way_share,
            turn_share: self.odometry_turn_share,
            ..OdometrySettings::default()
        }
    }

    pub(super) fn filter(&self) -> PointFilter {
        let body_m = self.body_m.map(|[min_m, max_m]| (min_m, max_m));
        PointFilter {
            range_min_m: self.range_min_m,
            range_max_m: self.range_max_m,
            no_return_m: self.no_return_m,
            body_m,
            keep_zeros: self.keep_zeros,
            beyond_range_is_noise: self.beyond_range_is_noise,
        }
    }
}
