//! Sections `alignment` and `robots` of the settings.

use crate::json::{ByKeyword, ByText};
use mrol_map::align::Method;
use mrol_map::mapping::{
    CarvingSettings, ODOMETRY_SHARE_MAX, OdometrySettings, SENSOR_HEIGHT_MAX_M, SensorAxes, SensorMount,
};
use mrol_map::scan::PointFilter;
use mrol_map::util::Keyword;
use mrol_map::visibility::SensorModel;
use mrol_service::{RobotSettings, SettingKind, SettingValue, section};

section! {
    /// Settings of alignment.
    pub struct AlignmentConfig in "alignment" {
        /// Method for requests that do not say: `refined` or `overlap`.
        method: ByKeyword<Method> = ByKeyword::default(); none;
    }
}

section! {
    /// Settings of a robot's scans; a request may override each value.
    pub struct RobotConfig in "robots.NAME" {
        /// Points nearer to the sensor are skipped.
        range_min_m: Option<f64> = None; m, from 0;
        /// Points farther from the sensor are skipped.
        range_max_m: Option<f64> = None; m, from 0;
        /// Points at this distance and farther mean "no return": nothing was met up to here. They are skipped.
        no_return_m: Option<f64> = None; m, from 0;
        /// Box of the robot's own body in the sensor frame: smallest and largest corner. Points within it are skipped.
        body_m: Option<[[f64; 3]; 2]> = None; m;
        /// Points at exactly `0 0 0` count as any other. Otherwise they are skipped, since most drivers write them
        /// where nothing returned.
        keep_zeros: bool = false; none;
        /// Points beyond `range_max_m` say nothing. Otherwise they tell that nothing was met up to there.
        beyond_range_is_noise: bool = false; none;
        /// Which way its sensor's axes point: `robot` (x ahead, y left, z up) or `optical` (a camera's: x right, y
        /// down, z ahead). Decides how the first scan of an empty map lies if no guess says.
        axes: ByKeyword<SensorAxes> = ByKeyword::default(); none;
        /// Height of its sensor above the floor. The first scan of an empty map is put there if no guess says.
        sensor_height_m: f64 = 0.0; m, from -SENSOR_HEIGHT_MAX_M, to SENSOR_HEIGHT_MAX_M;
        /// Look for the robot where its scans are refused.
        recover: bool = false; none;
        /// Take out of the map what the robot's scans saw through.
        carve: bool = false; none;
        /// Voxels around the surface that a scan shows that it never takes out.
        carve_margin_voxels: u32 = CarvingSettings::default().margin_voxels; none, from 1, to 8;
        /// A surface that is seen at a smaller angle than this is not told from a rim, and nothing beside rims is taken
        /// out.
        carve_grazing_deg: f64 = CarvingSettings::default().grazing_deg; deg, from 1, to 80;
        /// Voxels farther from the sensor than this are not taken out. More than 0.
        carve_range_max_m: f64 = CarvingSettings::default().range_max_m; m, from 0, to 200;
        /// Standard deviation of the length of a `motion` that comes without a covariance, as a share of it.
        odometry_way_share: f64 = OdometrySettings::default().way_share; none, from 0, to ODOMETRY_SHARE_MAX;
        /// Standard deviation of its turn, as a share of it.
        odometry_turn_share: f64 = OdometrySettings::default().turn_share; none, from 0, to ODOMETRY_SHARE_MAX;
        /// How the rays of its sensor lie, `spinning RINGS COLUMNS LOWEST_DEG HIGHEST_DEG` or `pinhole WIDTH HEIGHT FX
        /// FY`. Otherwise it is found out from the points of each scan.
        sensor: Option<ByText<SensorModel>> = None; none;
    }
}

impl<T: Keyword> SettingValue for ByKeyword<T> {
    const KIND: SettingKind = SettingKind::Text;

    fn words() -> Vec<&'static str> {
        T::ALL.iter().map(|word| word.as_str()).collect()
    }
}

impl<T> SettingValue for ByText<T> {
    const KIND: SettingKind = SettingKind::Text;
}

impl RobotConfig {
    pub(super) fn of_robot(&self) -> RobotSettings {
        RobotSettings {
            filter: self.filter(),
            recover: self.recover,
            carve: self.carve,
            carving: self.carving(),
            odometry: self.odometry(),
            mount: SensorMount { axes: self.axes.0, height_m: self.sensor_height_m },
            sensor: self.sensor.map(|model| model.0),
        }
    }

    pub(super) fn carving(&self) -> CarvingSettings {
        CarvingSettings {
            margin_voxels: self.carve_margin_voxels,
            grazing_deg: self.carve_grazing_deg,
            range_max_m: self.carve_range_max_m,
            ..CarvingSettings::default()
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
