//! What holds of every map, whatever it was made of.

use std::collections::BTreeSet;

use mrol_map::align::{AlignmentSettings, align};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{Lookup, MappedScan, MultiResolutionMap, Region, RobotName, ScanRecord};
use mrol_store::Snapshot;
use uuid::Uuid;

/// An alignment takes as long as a hundred inputs without: so many share one.
const INPUTS_AN_ALIGNMENT: u32 = 32;

/// Panics where the map that `input` made contradicts itself, and uses it as a server would.
pub(super) fn check(map: &MultiResolutionMap, input: &[u8]) {
    levels_agree(map);
    survives_its_file(map);
    can_be_changed(map, crc32c::crc32c(input).is_multiple_of(INPUTS_AN_ALIGNMENT));
}

/// A coarse voxel is there exactly as long as it has a child, in the sets and in the filters.
fn levels_agree(map: &MultiResolutionMap) {
    // Before the view, which holds the locks that these take.
    let counts: Vec<usize> = (0..map.settings().levels).map(|level| map.voxels(level)).collect();
    let view = map.view();
    let finest = view.voxels();
    for (level, count) in (0..).zip(counts) {
        let parents: BTreeSet<_> = finest.iter().map(|voxel| voxel.ancestor(level)).collect();
        assert_eq!(count, parents.len(), "voxels of level {level}");
        for &voxel in &parents {
            assert!(
                view.contains(voxel, level) && view.may_contain(voxel, level),
                "{voxel:?} of level {level}"
            );
        }
    }
}

fn survives_its_file(map: &MultiResolutionMap) {
    let before = Snapshot::of(map, Uuid::from_u128(1));
    let bytes = before.encode().expect("memory");
    let after = Snapshot::decode(&bytes).expect("what was written");
    // As bytes, in which NaN equals itself.
    assert_eq!(after.encode().expect("memory"), bytes);
    let restored = after.restore().expect("settings that were fine");
    assert_eq!(Snapshot::of(&restored, before.uuid).encode().expect("memory"), bytes);
}

/// A scan next to the map's first voxel is aligned, where that is asked for, inserted, looked up and deleted again.
fn can_be_changed(map: &MultiResolutionMap, aligned: bool) {
    let near = map.view().voxels().iter().next().map_or([0.0; 3], |voxel| map.lattice().center_m(voxel, 0));
    let mut map_from_sensor = Pose::translation(near[0], near[1], near[2]);
    let points = corner(map.lattice().resolution_m(0) as f32);
    if aligned {
        map_from_sensor =
            align(map, &points, &map_from_sensor, &AlignmentSettings::default()).map_from_sensor;
    }
    let pose = MappedScan::new(RobotName::new("fuzz").expect("a name"), map_from_sensor);
    let record = ScanRecord::of_points(pose, &points, map.lattice());
    let before = map.revision();
    let committed = map.committer().insert_scan(record.clone());
    assert_eq!((committed.revision, map.revision()), (before + 1, before + 1));
    let quantize = map.lattice().from_points(&map_from_sensor);
    let known = map.view_of(&points, &map_from_sensor).count(&points, &quantize, 0, Lookup::Exact);
    assert_eq!(known, points.iter().filter(|&&point| quantize.key(point).is_some()).count());
    let region = Region::ball(near, 3.0 * map.lattice().resolution_m(0)).expect("a ball");
    let inside = map.view().voxels_in(&region, 0);
    let removed = map.committer().remove(&inside.iter().copied().collect());
    assert_eq!(removed.removed, inside.len());
    levels_agree(map);
}

/// Three walls of 6 x 6 voxels, four points a voxel.
fn corner(resolution_m: f32) -> Vec<Point> {
    let at = |i: usize| (i as f32 + 0.5) * resolution_m / 2.0;
    let wall = |axis: usize| {
        (0..144).map(move |i| {
            let mut point = [at(i % 12), at(i / 12), at(0)];
            point.rotate_right(axis);
            Point::from(point)
        })
    };
    (0..3).flat_map(wall).collect()
}
