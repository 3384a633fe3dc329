//! Aisles between shelves, along which a scan fits at every upright.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::outcomes::Outcomes;
use super::trial::{SIMULATED_M, aligned, covariance, lidar, mapped, noise, on_floor, seen};
use mrol_map::align::{AlignmentSettings, PosePrior};
use mrol_map::mapping::ViewpointSettings;
use mrol_simulate::Scene;

/// Periods of aisles, meters.
pub const PERIODS_M: [f64; 5] = [0.5, 0.8, 1.2, 2.0, 3.0];
/// Steps of a drive along an aisle.
const STEPS_OF_DRIVE: u32 = 20;
const STEP_M: f64 = 0.4;
/// Errors of odometry along an aisle: one standard deviation, meters and degrees.
const ODOMETRY: (f64, f64) = (0.05, 2.0);

/// A drive along an aisle with an upright every `period_m`, mapped at its true poses: the outcomes with odometry, and
/// with the pose before as the guess. None where no map can be made.
pub fn aisle(seed: u64, period_m: f64, settings: &AlignmentSettings) -> Option<[Outcomes; 2]> {
    let mut outcomes = <[Outcomes; 2]>::default();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (scene, lidar) = (Scene::aisle(period_m, 36.0), lidar(12.0));
    let place = |step: u32| {
        let step = f64::from(step);
        on_floor(8.0 + STEP_M * step, 0.2 * (0.3 * step).sin(), 3.0 * (0.5 * step).sin())
    };
    let mut scans = Vec::new();
    for step in 0..=STEPS_OF_DRIVE {
        let truth = place(step);
        let points = seen(&lidar, &scene, &truth, &mut random);
        if step >= 2 {
            let map = mapped(scans.iter(), SIMULATED_M, ViewpointSettings::default())?;
            let odometry = PosePrior {
                covariance: covariance(ODOMETRY),
                ..(truth * noise(ODOMETRY, &mut random)).into()
            };
            for (prior, outcomes) in [odometry, place(step - 1).into()].into_iter().zip(&mut outcomes) {
                outcomes.add(&aligned(&map, &points, &prior, settings), Some(&truth), SIMULATED_M);
            }
        }
        scans.push((points, truth));
    }
    Some(outcomes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_that_drives_along_shelves_stays_at_its_upright_and_says_so_where_it_does_not_know() {
        let settings = AlignmentSettings::default();
        let (mut by_odometry, mut from_before) = <(Outcomes, Outcomes)>::default();
        for period_m in PERIODS_M {
            let [odometry, before] = aisle(70_002, period_m, &settings).unwrap();
            by_odometry.append(odometry);
            from_before.append(before);
        }
        for outcomes in [&by_odometry, &from_before] {
            assert!(outcomes.wrong.is_empty(), "{:?}", outcomes.wrong);
        }
        let (right, alignments) = (by_odometry.right, by_odometry.alignments());
        assert!(right * 100 >= alignments * 95, "{right} of {alignments} are found");
    }
}
