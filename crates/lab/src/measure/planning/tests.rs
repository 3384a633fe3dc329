//! Measurements on small maps.

use std::sync::Arc;

use super::arms::arm_poses;
use super::changing::between_insertions;
use super::motions::{MOTIONS, motions};
use super::points::point_body;
use crate::workload::{Room, Site, Workload};
use mrol_map::map::{MapSettings, MultiResolutionMap};

fn map_of(workload: Workload) -> Arc<MultiResolutionMap> {
    Arc::new(workload.map(MapSettings::new(workload.resolution_m(), 6)).unwrap())
}

#[test]
fn arms_and_motions_collide_now_and_then() {
    for workload in [Workload::Room(Room), Workload::Site(Site::of(100_000, 1))] {
        let map = map_of(workload);
        let arms = arm_poses(&map, false, 300, 1, 1).unwrap();
        assert!((30..270).contains(&arms.colliding), "{arms:?}");
        assert!(arms.field_bytes > 10_000 && arms.runs.ns_per_item().len() == 1);
        let motions = motions(&map, 1, 1).unwrap();
        assert_eq!((motions.motions, motions.colliding), (MOTIONS, MOTIONS / 2));
    }
}

#[test]
fn a_body_of_points_and_a_map_that_changes_are_measured() {
    let map = map_of(Workload::Room(Room));
    let points = point_body(&map, 50, 1, 1).unwrap();
    assert_eq!((points.poses, points.points), (50, 500));
    let changing = between_insertions(Workload::Room(Room), MapSettings::new(0.05, 6), 3, 1).unwrap();
    assert_eq!((changing.first_checks_ms.len(), changing.with_planner_ms.len()), (3, 3));
    assert!(changing.changed_voxels > 0.0 && changing.between_ns > 0.0);
}
