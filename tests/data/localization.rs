//! Real scans localized with no guess: in the map of the place they were taken in, and in others.

use std::time::Instant;

use mrol::align::localize::{Gravity, Localization, LocalizationQuery, LocalizationSettings, localize};
use mrol::align::{AlignmentSettings, Verdict};
use mrol::geometry::{Pose, pose_difference};
use mrol::map::{MapSettings, MultiResolutionMap, RobotName};
use mrol::mapping::{Guess, MappingSettings, Scan, ScanMapper, Sightings};
use mrol::util::StopSignal;
use nalgebra::Vector3;

use crate::support::shared_scans::{self, ScanSet};

/// A set of scans, and which way is down in its map.
struct Place {
    set: ScanSet,
    resolution_m: f64,
    down: Vector3<f64>,
}

fn hall() -> Option<Place> {
    let set = shared_scans::open("balm_hall_consecutive")?;
    Some(Place { set, resolution_m: 0.1, down: -Vector3::z() })
}

fn corridor() -> Option<Place> {
    let set = shared_scans::open("uos_3dtk_dat")?;
    Some(Place { set, resolution_m: 0.1, down: Vector3::y() })
}

fn office() -> Option<Place> {
    let set = shared_scans::open("icl_office_kt0_dense")?;
    Some(Place { set, resolution_m: 0.04, down: Vector3::y() })
}

impl Place {
    /// The map of the even scans, at their true poses.
    fn mapped(&self) -> MultiResolutionMap {
        let map = MultiResolutionMap::new(MapSettings::new(self.resolution_m, 6)).unwrap();
        let (robot, sightings) = (RobotName::new("r").unwrap(), Sightings::default());
        let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
        for (k, pose) in self.set.map_from_sensor.iter().enumerate().step_by(2) {
            let points = self.set.points(k);
            let scan = Scan { guess: Guess::Pose(*pose), at_guess: true, ..Scan::new(&robot, &points) };
            mapper.map_scan(&scan, StopSignal::NEVER).unwrap();
        }
        map
    }

    /// What an accelerometer would tell of scan `k` in a map where things fall along `down`.
    fn gravity(&self, k: usize, down: Vector3<f64>) -> Option<Gravity> {
        let in_sensor = self.set.map_from_sensor[k].rotation.inverse() * self.down;
        Some(Gravity::new(in_sensor.into(), down.into()).unwrap())
    }

    fn find(&self, map: &MultiResolutionMap, k: usize, gravity: Option<Gravity>) -> Localization {
        let query = LocalizationQuery { gravity, candidates: 3, ..LocalizationQuery::default() };
        let start = Instant::now();
        let found = localize(
            map,
            &self.set.points(k),
            &query,
            &LocalizationSettings::default(),
            &AlignmentSettings::default(),
        );
        let found = found.unwrap();
        println!(
            "{} scan {k}: {:.2} s, {} cells, {:?}: {}",
            self.set.name,
            start.elapsed().as_secs_f64(),
            found.cells,
            found.verdict,
            found.reason
        );
        found
    }

    /// Localises scan `k` in its own map; true when that was accepted.
    fn is_found(&self, map: &MultiResolutionMap, k: usize, gravity: Option<Gravity>) -> bool {
        let found = self.find(map, k, gravity);
        let best = found.candidates.first().map_or_else(Pose::identity, |best| best.map_from_sensor);
        let (meters, degrees) = pose_difference(&best, &self.set.map_from_sensor[k]);
        println!("  {meters:.3} m, {degrees:.2} degrees from the truth");
        assert!(meters < 0.2 && degrees < 2.0, "scan {k}: {meters} m, {degrees} degrees: {}", found.reason);
        found.verdict == Verdict::Accepted
    }
}

#[test]
fn every_odd_scan_of_a_hall_is_found_in_the_map_of_the_even_ones() {
    let Some(hall) = hall() else { return };
    let map = hall.mapped();
    for k in (1..hall.set.files.len()).step_by(2) {
        assert!(hall.is_found(&map, k, hall.gravity(k, hall.down)), "scan {k} was found and not believed");
    }
}

#[test]
fn scans_of_a_hall_are_found_without_knowing_which_way_is_down() {
    let Some(hall) = hall() else { return };
    let map = hall.mapped();
    for k in [1, 19] {
        assert!(hall.is_found(&map, k, None), "scan {k} was found and not believed");
    }
}

#[test]
fn scans_of_a_corridor_and_an_office_are_found() {
    let (Some(corridor), Some(office)) = (corridor(), office()) else { return };
    assert!(corridor.is_found(&corridor.mapped(), 1, corridor.gravity(1, corridor.down)));
    let map = office.mapped();
    let accepted = [1, 5, 9].map(|k| office.is_found(&map, k, office.gravity(k, office.down)));
    assert!(accepted.iter().any(|accepted| *accepted));
}

/// Looks for scans of a hall, with the direction down of the map and without.
fn assert_not_found(hall: &Place, map: &MultiResolutionMap, down: Vector3<f64>) {
    for k in (1..hall.set.files.len()).step_by(8) {
        for gravity in [hall.gravity(k, down), None] {
            let found = hall.find(map, k, gravity);
            assert_ne!(found.verdict, Verdict::Accepted, "hall scan {k}: {}", found.reason);
        }
    }
}

#[test]
fn scans_of_a_hall_are_not_found_in_the_map_of_a_corridor() {
    if let (Some(hall), Some(corridor)) = (hall(), corridor()) {
        assert_not_found(&hall, &corridor.mapped(), corridor.down);
    }
}

#[test]
fn scans_of_a_hall_and_a_corridor_are_not_found_in_the_map_of_an_office() {
    let (Some(hall), Some(corridor), Some(office)) = (hall(), corridor(), office()) else { return };
    let in_office = office.mapped();
    assert_not_found(&hall, &in_office, office.down);
    for k in 0..corridor.set.files.len() {
        let found = corridor.find(&in_office, k, corridor.gravity(k, office.down));
        assert_ne!(found.verdict, Verdict::Accepted, "corridor scan {k}: {}", found.reason);
    }
}
