//! Rectangular rooms, whose walls look the same to a robot that was turned around.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::outcomes::{Outcomes, is_right};
use super::trial::{SIMULATED_M, aligned, carved, lidar, mapped, on_floor, seen};
use mrol_map::align::{Alignment, AlignmentSettings, PosePrior, Verdict};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MultiResolutionMap;
use mrol_map::mapping::{OdometrySettings, ViewpointSettings};
use mrol_simulate::Scene;

/// Pieces of furniture in rectangular rooms.
pub const PIECES: [usize; 4] = [1, 2, 4, 8];
/// People in the view, in rectangular rooms: 12 hide up to half of it.
pub const PEOPLE: [usize; 4] = [0, 2, 5, 12];
/// Scans of a room before the robot is turned, and after it.
const SCANS_OF_ROOM: u32 = 8;
const SCANS_AFTER: u32 = 3;
const RANGE_M: f64 = 30.0;
/// The turn of a robot that goes on, degrees.
const STEP_DEG: f64 = 8.0;
/// The time that a step takes, where it is told, seconds.
pub const STEP_S: f64 = 0.5;
/// The time that a turn of half a circle takes, where it is told, seconds.
pub const TURN_S: f64 = 2.0;

/// What came of scans in rooms.
#[derive(Debug, Clone, Default)]
pub struct RoomTrials {
    /// Of the first scan after the robot was turned unseen.
    pub turned: Outcomes,
    /// Of the first three, as far as the first that is accepted: by then the robot is found, or is not.
    pub by_third: Outcomes,
    /// Of the first scan after a turn, where a piece of furniture was moved meanwhile.
    pub rearranged: Outcomes,
    /// Of a scan after a step.
    pub stepped: Outcomes,
    /// Of the same, where times tell that [`STEP_S`] went by.
    pub stepped_in_time: Outcomes,
    /// Of the first scan after a turn, where times tell that [`TURN_S`] went by.
    pub turned_in_time: Outcomes,
    /// Voxels that the accepted ones of the scans in rooms that nobody changed took out of the map, where they were
    /// found and where they were taken: all of them stand.
    pub carved: Carved,
    /// The largest share of the view that people hid.
    pub hidden: f64,
}

/// Voxels of what stands that scans took out of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Carved {
    /// At the poses that were accepted.
    pub at_found: usize,
    /// By the same scans at their true poses.
    pub at_truth: usize,
    /// Of the first, those at wrong poses.
    pub at_wrong: usize,
}

impl Carved {
    /// Adds what an accepted scan takes out; none where it cannot be inserted.
    fn add(
        &mut self,
        map: &MultiResolutionMap,
        points: &[Point],
        found: &Alignment,
        truth: &Pose,
    ) -> Option<()> {
        if found.verdict != Verdict::Accepted {
            return Some(());
        }
        let at_found = carved(map, points, found)?;
        self.at_found += at_found;
        self.at_truth += carved(map, points, &Alignment::trusted(*truth, map.settings().levels, points))?;
        self.at_wrong += if is_right(&found.map_from_sensor, truth, SIMULATED_M) { 0 } else { at_found };
        Some(())
    }
}

/// Rectangular rooms drawn from `seed`, mapped by eight scans; then the robot is turned unseen, so that the walls look
/// the same, or goes on. None where no map can be made.
pub fn rooms(
    seed: u64,
    count: u64,
    pieces: usize,
    people: usize,
    settings: &AlignmentSettings,
) -> Option<RoomTrials> {
    let mut trials = RoomTrials::default();
    for k in 0..count {
        // Every other one is square.
        let (size_m, turn_deg) = if k.is_multiple_of(2) { ([8.0, 6.0], 180.0) } else { ([7.0, 7.0], 90.0) };
        let mut random =
            ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(k * 8 + pieces as u64));
        let room = random.random();
        let scene = Scene::rectangular_room(room, size_m, pieces);
        let lidar = lidar(RANGE_M);
        let mut places = Vec::new();
        for turn in 0..SCANS_OF_ROOM {
            let [x, y] = [(); 2].map(|()| random.random_range(-0.8..0.8));
            places.push(on_floor(x, y, f64::from(turn) * 45.0));
        }
        let scans: Vec<_> =
            places.iter().map(|pose| (seen(&lidar, &scene, pose, &mut random), *pose)).collect();
        let map = mapped(scans.iter(), SIMULATED_M, ViewpointSettings::default())?;
        let (last, crowd) = (*places.last()?, random.random());
        let after = |turn_deg: f64| {
            last * Pose::new(Vector3::new(0.2, -0.1, 0.0), Vector3::z() * turn_deg.to_radians())
        };
        let mut tried = |scene: &Scene, truth: &Pose| {
            let points = seen(&lidar, &scene.with_people(crowd, people, [0.0, 0.0]), truth, &mut random);
            let found = aligned(&map, &points, &last.into(), settings);
            (points, found)
        };
        let tried_in_time = |points: &[Point], seconds: f64| {
            let expected = Some(OdometrySettings::default().after(seconds));
            aligned(&map, points, &PosePrior { expected, ..last.into() }, settings)
        };
        trials.hidden =
            trials.hidden.max(hidden(&scene, &scene.with_people(crowd, people, [0.0, 0.0]), &last));

        let truth = after(turn_deg);
        let (mut points, mut found) = tried(&scene, &truth);
        trials.turned.add(&found, Some(&truth), SIMULATED_M);
        trials.turned_in_time.add(&tried_in_time(&points, TURN_S), Some(&truth), SIMULATED_M);
        let mut at = truth;
        for scan in 1..SCANS_AFTER {
            if found.0.verdict == Verdict::Accepted {
                break;
            }
            at = after(turn_deg + f64::from(scan) * STEP_DEG);
            (points, found) = tried(&scene, &at);
        }
        trials.by_third.add(&found, Some(&at), SIMULATED_M);
        trials.carved.add(&map, &points, &found.0, &at)?;
        let rearranged = Scene::rearranged_room(room, size_m, pieces, 1);
        trials.rearranged.add(&tried(&rearranged, &truth).1, Some(&truth), SIMULATED_M);
        let truth = after(STEP_DEG);
        let (points, found) = tried(&scene, &truth);
        trials.stepped.add(&found, Some(&truth), SIMULATED_M);
        trials.stepped_in_time.add(&tried_in_time(&points, STEP_S), Some(&truth), SIMULATED_M);
        trials.carved.add(&map, &points, &found.0, &truth)?;
    }
    Some(trials)
}

/// The share of directions in which people are seen, between 20 degrees below and above the horizon.
fn hidden(empty: &Scene, crowded: &Scene, pose: &Pose) -> f64 {
    let (mut met, mut all) = (0, 0);
    for yaw_deg in 0..360 {
        for elevation_deg in (-20..=20).step_by(4) {
            let (yaw, elevation) = (f64::from(yaw_deg).to_radians(), f64::from(elevation_deg).to_radians());
            let direction =
                Vector3::new(yaw.cos() * elevation.cos(), yaw.sin() * elevation.cos(), elevation.sin());
            let cast = |scene: &Scene| scene.cast(pose.translation.vector.into(), direction, RANGE_M);
            all += 1;
            met += usize::from(cast(empty) != cast(crowded));
        }
    }
    f64::from(u32::try_from(met).unwrap_or(u32::MAX)) / f64::from(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_that_was_turned_unseen_in_a_rectangular_room_is_not_believed_where_it_is_not() {
        let settings = AlignmentSettings::default();
        let (mut turned, mut stepped, mut in_time) = <(Outcomes, Outcomes, Outcomes)>::default();
        for (pieces, people) in
            [2, 4, 8].into_iter().flat_map(|pieces| [0, 2, 5].map(|people| (pieces, people)))
        {
            let trials = rooms(70_001, 2, pieces, people, &settings).unwrap();
            turned.append(trials.turned);
            turned.append(trials.by_third);
            turned.append(trials.turned_in_time);
            stepped.append(trials.stepped);
            in_time.append(trials.stepped_in_time);
        }
        for outcomes in [turned, stepped, in_time] {
            assert!(outcomes.wrong.is_empty(), "{:?}", outcomes.wrong);
            let (right, alignments) = (outcomes.right, outcomes.alignments());
            assert!(right * 4 >= alignments * 3, "{right} of {alignments} are found");
        }
    }
}
