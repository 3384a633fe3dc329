//! Experiment on deskewing: poses of a lidar that moves while it turns, against those of the same lidar standing.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use mrol_map::align::AlignmentSettings;
use mrol_map::geometry::{Point, Pose, Twist, pose_difference};
use mrol_map::map::{MultiResolutionMap, RobotName};
use mrol_map::mapping::{Guess, MappingError, MappingSettings, Scan, ScanMapper, Sightings};
use mrol_map::util::StopSignal;
use mrol_simulate::{Scene, SpinningLidar};

/// Speed of the robot, meters a second.
pub const SPEED_M_PER_S: f64 = 2.0;
/// Rotation of the robot, radians a second: it drives circles of 2 m radius.
pub const ROTATION_RAD_PER_S: f64 = 1.0;
/// Time in which the robot gets up to speed from standing, seconds: 1 m/s and half a rad/s a second.
pub const START_S: f64 = 2.0;
/// Time of a turn of the lidar, seconds.
pub const TURN_S: f64 = 0.1;
/// How far the odometry is off, as a share of each motion.
pub const ODOMETRY_ERROR: f64 = 0.02;

/// How the scans are taken and treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sweep {
    /// The sensor stands during each turn: there is nothing to undo.
    Standing,
    /// The sensor moves, and its points are deskewed.
    Deskewed,
    /// The sensor moves, and its points are taken as they come.
    Raw,
}

/// What the guess of each scan is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuessFrom {
    /// Odometry that is off by [`ODOMETRY_ERROR`].
    Odometry,
    /// The robot's last two poses.
    ConstantVelocity,
}

/// How far a scan's pose is off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseError {
    /// Distance, meters.
    pub meters: f64,
    /// Angle, degrees.
    pub degrees: f64,
}

/// The true poses of `scans` scans, map_from_sensor, a turn of the lidar apart, and the motion that ends at each:
/// circles. The first scan is taken standing; from turn to turn the robot gets faster.
fn ride(scans: usize) -> Vec<(Pose, Option<Twist>)> {
    let mut pose = Pose::new(Vector3::new(10.0, 5.0, 1.0), Vector3::zeros());
    let mut ride = vec![(pose, None)];
    for k in 1..scans {
        let share = (k as f64 * TURN_S / START_S).min(1.0);
        let twist = Twist {
            linear: Vector3::new(share * SPEED_M_PER_S, 0.0, 0.0),
            angular: Vector3::new(0.0, 0.0, share * ROTATION_RAD_PER_S),
        };
        pose *= twist.motion(TURN_S);
        ride.push((pose, Some(twist)));
    }
    ride
}

/// The errors of the poses of `scans` scans of `robot` but the first one, which all go into `map`, an empty one; none
/// of a scan that was refused.
///
/// # Errors
/// When a scan cannot be mapped.
pub fn errors(
    sweep: Sweep,
    guess: GuessFrom,
    scans: usize,
    map: &MultiResolutionMap,
    robot: &RobotName,
    seed: u64,
) -> Result<Vec<Option<PoseError>>, MappingError> {
    let (scene, lidar) = (Scene::hall(seed), SpinningLidar::default());
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let sightings = Sightings::default();
    let alignment = AlignmentSettings::default();
    let mapper =
        ScanMapper::new(map, &sightings, MappingSettings { alignment, ..MappingSettings::default() });
    let mut errors = Vec::new();
    for (k, (truth, twist)) in ride(scans).into_iter().enumerate() {
        let moving = twist.filter(|_| sweep != Sweep::Standing);
        let pose_at = |time_s: f64| moving.map_or(truth, |twist| truth * twist.motion(time_s));
        let (points, times_s) = lidar.sweep(&scene, TURN_S, pose_at, &mut random);
        let (points, times_s): (Vec<Point>, Vec<f32>) =
            points.into_iter().zip(times_s).filter(|(point, _)| point.is_finite()).unzip();
        let odometry = twist.map(|twist| {
            let off = 1.0 + ODOMETRY_ERROR;
            Twist { linear: twist.linear * off, angular: twist.angular * off }.motion(TURN_S)
        });
        let scan = Scan {
            timestamp_ns: Some((k as f64 * TURN_S * 1e9) as i64),
            times_s: (sweep == Sweep::Deskewed).then_some(&times_s[..]),
            guess: match (odometry, guess) {
                (None, _) => Guess::Pose(truth),
                (Some(motion), GuessFrom::Odometry) => Guess::Motion(motion),
                (Some(_), GuessFrom::ConstantVelocity) => Guess::ConstantVelocity,
            },
            at_guess: k == 0,
            ..Scan::new(robot, &points)
        };
        let outcome = mapper.map_scan(&scan, StopSignal::NEVER)?;
        if k > 0 {
            let (meters, degrees) = pose_difference(&truth, &outcome.located.alignment.map_from_sensor);
            errors.push(outcome.is_inserted().then_some(PoseError { meters, degrees }));
        }
    }
    Ok(errors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::MapSettings;

    #[test]
    fn a_deskewed_lidar_is_found_as_well_as_one_that_stands_and_a_raw_one_is_not() {
        let worst = |sweep| {
            let map = MultiResolutionMap::new(MapSettings::new(0.1, 6)).unwrap();
            let robot = RobotName::new("r").unwrap();
            let errors = errors(sweep, GuessFrom::Odometry, 12, &map, &robot, 1).unwrap();
            let meters = errors.into_iter().map(|error| error.map_or(f64::INFINITY, |error| error.meters));
            meters.fold(0.0, f64::max)
        };
        let (standing, deskewed, raw) = (worst(Sweep::Standing), worst(Sweep::Deskewed), worst(Sweep::Raw));
        assert!(standing < 0.02 && deskewed < 1.3 * standing, "standing {standing} m, deskewed {deskewed} m");
        assert!(raw > 2.0 * deskewed, "raw {raw} m, deskewed {deskewed} m");
    }
}
