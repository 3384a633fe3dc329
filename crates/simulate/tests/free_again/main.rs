//! What is taken away is free again within three scans, for a robot that stands; and thin things that stand are kept.
//!
//! Three seeds of each scene; with `MROL_FREE_AGAIN_SEEDS=6` and `--nocapture` it prints the figures of
//! docs/measurements.md ("Free again"). With `MROL_PEER_DIR` the scans are written there for OctoMap, and what it made
//! of them is read from there.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod peer;
mod robot;
mod scenes;

use std::collections::BTreeSet;

use mrol_map::voxel::VoxelKey;
use robot::Robot;
use scenes::{BEFORE, Kind, Situation};

fn seeds() -> std::ops::RangeInclusive<u64> {
    1..=std::env::var("MROL_FREE_AGAIN_SEEDS").map_or(3, |seeds| seeds.parse().unwrap())
}

/// Of the place of what went, so much has to be free after three scans, and so many of its voxels may be left, percent.
/// Carving leaves some beside rims, and next to the floor.
const FREE_LEAST: usize = 85;
const LEFT_MOST: usize = 30;
/// So many voxels of thin things may be lost, percent.
const THIN_LOST_MOST: usize = 10;

/// What came of a situation.
#[derive(Debug, Default, Clone, Copy)]
struct Figures {
    /// Voxels of the things when they went, or in a map that does not carve.
    voxels: usize,
    /// Of them those that are left.
    left: usize,
    /// Voxels at the place of the things, and how many are free.
    place: usize,
    free: usize,
}

/// The voxels whose centers lie so far within boxes.
fn within(bounds_m: &[[[f64; 3]; 2]], slack_m: f64, resolution_m: f64) -> BTreeSet<VoxelKey> {
    let mut voxels = BTreeSet::new();
    for [low, high] in bounds_m {
        let first = low.map(|c| ((c - slack_m) / resolution_m - 0.5).ceil() as i32);
        let last = high.map(|c| ((c + slack_m) / resolution_m - 0.5).floor() as i32);
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                voxels.extend((first[2]..=last[2]).filter_map(|z| VoxelKey::new([x, y, z])));
            }
        }
    }
    // What lies on the floor is not told from it.
    voxels.into_iter().filter(|voxel| f64::from(voxel.index()[2]) * resolution_m >= 0.15).collect()
}

fn run(kind: Kind, seed: u64) -> (Figures, [usize; 2]) {
    let mut situation = Situation::of(kind, seed);
    let (filter, resolution_m) = (situation.filter, situation.resolution_m);
    let robot = Robot::new(resolution_m, filter, true);
    let keeping = Robot::new(resolution_m, filter, false);
    let is_thin = kind == Kind::ThinThings;
    let place = within(&situation.bounds_m, 0.0, resolution_m);
    let around = within(&situation.bounds_m, resolution_m, resolution_m);
    let (mut things, mut scans) = (BTreeSet::new(), Vec::new());
    for step in 0..situation.poses.len() {
        let (points, truth) = (situation.scan(step), situation.poses[step]);
        if step == BEFORE && !is_thin {
            things = robot.voxels().intersection(&around).copied().collect();
        }
        let of = format!("{kind:?} {seed}, scan {step}");
        robot.map(&points, &truth).expect(&of);
        if is_thin {
            keeping.map(&points, &truth).expect(&of);
        }
        scans.push((points, truth));
    }
    if is_thin {
        things = keeping.voxels().intersection(&around).copied().collect();
    }
    let all: BTreeSet<VoxelKey> = things.union(&place).copied().collect();
    let asked = if is_thin { &things } else { &all };
    let figures = Figures {
        voxels: things.len(),
        left: things.intersection(&robot.voxels()).count(),
        place: all.len(),
        free: robot.free(&all),
    };
    if !is_thin {
        assert!(robot.map.viewpoints().len() <= 3, "{kind:?} {seed}");
    }
    (figures, peer::states(&situation, &scans, asked))
}

fn figures(kind: Kind) -> Vec<Figures> {
    seeds()
        .map(|seed| {
            let (figures, [peer_free, peer_occupied]) = run(kind, seed);
            println!("{kind:?} {seed}: {figures:?}; the peer: {peer_free} free, {peer_occupied} occupied");
            figures
        })
        .collect()
}

fn assert_free(kind: Kind) {
    for Figures { voxels, left, place, free, .. } in figures(kind) {
        assert!(left * 100 <= voxels * LEFT_MOST, "{kind:?}: {left} of {voxels} voxels are left");
        assert!(free * 100 >= place * FREE_LEAST, "{kind:?}: {free} of {place} voxels are free");
    }
}

#[test]
fn a_crate_goes_in_a_hall_longer_than_the_range() {
    assert_free(Kind::BeyondRange);
}

#[test]
fn somebody_leaves() {
    assert_free(Kind::Person);
}

#[test]
fn a_door_opens() {
    assert_free(Kind::Door);
}

#[test]
fn a_pallet_is_fetched() {
    assert_free(Kind::Pallet);
}

#[test]
fn a_crate_goes_before_the_open_sky() {
    assert_free(Kind::OpenSky);
}

#[test]
fn thin_things_that_stand_are_kept() {
    for Figures { voxels, left, .. } in figures(Kind::ThinThings) {
        assert!((voxels - left) * 100 <= voxels * THIN_LOST_MOST, "{left} of {voxels} voxels are left");
    }
}

#[test]
fn a_robot_that_stands_before_people_who_come_and_go_leaves_few_viewpoints() {
    let mut situation = Situation::of(Kind::Person, 3);
    let robot = Robot::new(situation.resolution_m, situation.filter, true);
    let truth = situation.poses[0];
    let mut counts = Vec::new();
    for i in 0..300 {
        // It is there for two of nine scans.
        let points = situation.scan(if i % 9 < 2 { 0 } else { BEFORE });
        robot.map(&points, &truth).expect("it stands where it stood");
        counts.push(robot.map.viewpoints().len());
    }
    assert!(counts[299] <= 5 && counts[299] == counts[149], "{counts:?}");
}
