//! Experiment on rounds: a robot that drives the same way again and again, and what the map keeps of it.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use mrol_map::geometry::Point;
use mrol_map::map::{MapDescription, MultiResolutionMap, RobotName};
use mrol_map::mapping::{Guess, MappingError, MappingSettings, Scan, ScanMapper, Sightings};
use mrol_map::util::StopSignal;
use mrol_simulate::{LIDAR_LAP_M, Scene, SpinningLidar, lidar_at};

/// Scans a second.
pub const SCANS_PER_S: f64 = 10.0;
/// Speed of the robot, meters a second.
pub const SPEED_M_PER_S: f64 = 0.6;

/// What the map keeps after a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Round {
    /// Scans that were accepted so far.
    pub accepted: usize,
    /// Scans that were refused so far.
    pub refused: usize,
    /// Viewpoints that the map has.
    pub viewpoints: usize,
    /// Bytes of memory of them.
    pub viewpoint_bytes: usize,
    /// Finest voxels.
    pub voxels: usize,
}

impl Round {
    fn of(map: &MultiResolutionMap, accepted: usize, refused: usize) -> Self {
        let MapDescription { viewpoints, viewpoint_bytes, .. } = map.describe(0, 0);
        Self { accepted, refused, viewpoints, viewpoint_bytes, voxels: map.voxels(0) }
    }
}

/// Drives for so many scans through the building of `seed`, 0.6 m/s and 10 scans a second, and maps them into `map`, an
/// empty one; `told` hears what the map keeps after each round, and after the last scan.
///
/// # Errors
/// When a scan cannot be mapped.
pub fn drive(
    map: &MultiResolutionMap,
    robot: &RobotName,
    lidar: &SpinningLidar,
    scans: usize,
    seed: u64,
    mut told: impl FnMut(Round),
) -> Result<(), MappingError> {
    let (scene, sightings) = (Scene::furnished(seed), Sightings::default());
    let mapper = ScanMapper::new(map, &sightings, MappingSettings::default());
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut accepted, mut refused, mut rounds) = (0, 0, 0);
    for k in 0..scans {
        let time_s = k as f64 / SCANS_PER_S;
        let way_m = time_s * SPEED_M_PER_S;
        if (way_m / LIDAR_LAP_M) as usize > rounds {
            rounds += 1;
            told(Round::of(map, accepted, refused));
        }
        let truth = lidar_at(way_m);
        let points = lidar.scan(&scene, &truth, &mut random);
        let points: Vec<Point> = points.into_iter().filter(|point| point.is_finite()).collect();
        let scan = Scan {
            timestamp_ns: Some((time_s * 1e9) as i64),
            guess: if k == 0 { Guess::Pose(truth) } else { Guess::Last },
            at_guess: k == 0,
            ..Scan::new(robot, &points)
        };
        let is_accepted = mapper.map_scan(&scan, StopSignal::NEVER)?.located.is_accepted();
        *(if is_accepted { &mut accepted } else { &mut refused }) += 1;
    }
    told(Round::of(map, accepted, refused));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::MapSettings;

    #[test]
    fn the_third_round_leaves_next_to_no_viewpoint() {
        let map = MultiResolutionMap::new(MapSettings::new(0.2, 4)).unwrap();
        let lidar = SpinningLidar { rings: 32, azimuths: 450, ..SpinningLidar::default() };
        // The way of three rounds in long steps, not in those of 10 Hz.
        let mut rounds = Vec::new();
        let (scene, sightings) = (Scene::furnished(1), Sightings::default());
        let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
        let (robot, mut random) = (RobotName::new("r").unwrap(), ChaCha8Rng::seed_from_u64(1));
        let steps_a_round = (LIDAR_LAP_M / 0.29) as usize;
        for k in 0..3 * steps_a_round {
            let truth = lidar_at(k as f64 * 0.29);
            let points = lidar.scan(&scene, &truth, &mut random);
            let points: Vec<Point> = points.into_iter().filter(|point| point.is_finite()).collect();
            let scan = Scan { guess: Guess::Pose(truth), at_guess: true, ..Scan::new(&robot, &points) };
            mapper.map_scan(&scan, StopSignal::NEVER).unwrap();
            if (k + 1) % steps_a_round == 0 {
                rounds.push(map.viewpoints().len());
            }
        }
        assert!(rounds[0] > 30 && rounds[2] - rounds[1] <= rounds[1] / 50, "{rounds:?}");
    }
}
