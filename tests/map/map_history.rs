//! Long random histories of a map against a plain set of voxels, at every level.

use std::collections::BTreeMap;

use mrol::bloom::FilterSettings;
use mrol::geometry::Pose;
use mrol::map::{
    self, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape, MapSettings, MappedScan,
    MultiResolutionMap, Region, RobotName, ScanRecord,
};
use mrol::store::Snapshot;
use mrol::voxel::{VoxelKey, VoxelSet};
use proptest::prelude::*;
use uuid::Uuid;

use crate::support::plain_set::{PlainSet as Model, assert_equal, up};

#[derive(Debug, Clone)]
enum Change {
    Insert(Vec<[i32; 3]>),
    DeleteKeys(u32, Vec<[i32; 3]>),
    DeleteBox(u32, [i32; 3], i32),
    DeleteBall(u32, [i32; 3], i32),
    PutKeepOut(KeepOutName, i32),
    EndKeepOut(KeepOutName),
    Restart,
}

fn index() -> impl Strategy<Value = [i32; 3]> {
    // Crowded about the origin, with a few far away, in other regions and blocks.
    prop_oneof![
        9 => prop::array::uniform3(-12i32..12),
        1 => prop::array::uniform3(-300i32..300),
    ]
}

fn change() -> impl Strategy<Value = Change> {
    let level = 0u32..8;
    prop_oneof![
        4 => prop::collection::vec(index(), 1..200).prop_map(Change::Insert),
        3 => (level.clone(), prop::collection::vec(index(), 1..40)).prop_map(|(n, keys)| Change::DeleteKeys(n, keys)),
        1 => (level.clone(), index(), 0i32..40).prop_map(|(n, at, side)| Change::DeleteBox(n, at, side)),
        1 => (level, index(), 0i32..20).prop_map(|(n, at, radius)| Change::DeleteBall(n, at, radius)),
        1 => (keep_out_name(), 1i32..9).prop_map(|(name, radius)| Change::PutKeepOut(name, radius)),
        1 => keep_out_name().prop_map(Change::EndKeepOut),
        1 => Just(Change::Restart),
    ]
}

/// So few names that most are put again, or ended.
fn keep_out_name() -> impl Strategy<Value = KeepOutName> {
    (0..3).prop_map(|i| KeepOutName::new(&format!("k{i}")).unwrap())
}

fn keep_out_shape(radius: i32) -> KeepOutShape {
    KeepOutShape::of_region(Region::ball([0.0; 3], f64::from(radius)).unwrap()).unwrap()
}

fn change_keep_out(map: &MultiResolutionMap, name: &KeepOutName, act: KeepOutAct) -> usize {
    let change = KeepOutChange { name: name.clone(), act };
    let committed = map.committer().apply(&map::Change::KeepOut(KeepOutRecord { change, request: None }));
    committed.added + committed.removed
}

fn pose_of(robot: &str) -> MappedScan {
    MappedScan::new(RobotName::new(robot).unwrap(), Pose::identity())
}

/// Makes the change on the map; the voxels that it added or removed.
fn apply(map: &mut MultiResolutionMap, change: &Change) -> usize {
    let levels = map.settings().levels;
    let key = |index: &[i32; 3]| VoxelKey::new(*index).unwrap();
    let remove = |map: &MultiResolutionMap, keys: Vec<VoxelKey>, level: u32| {
        let voxels = map.view().descendants_of(keys, level);
        map.committer().remove(&voxels).removed
    };
    match change {
        Change::Insert(indices) => {
            let voxels: VoxelSet = indices.iter().map(key).collect();
            map.committer().insert_scan(ScanRecord::of_voxels(pose_of("r"), voxels)).added
        }
        Change::DeleteKeys(level, indices) => {
            let level = level % levels;
            remove(map, indices.iter().map(|i| key(i).ancestor(level)).collect(), level)
        }
        Change::DeleteBox(level, ..) | Change::DeleteBall(level, ..) => {
            let level = level % levels;
            let keys = map.view().voxels_in(&region(change), level);
            remove(map, keys, level)
        }
        Change::PutKeepOut(name, radius) => {
            let shape = keep_out_shape(*radius);
            change_keep_out(map, name, KeepOutAct::Put { shape, made_by: None, expires_at_ns: None })
        }
        Change::EndKeepOut(name) => change_keep_out(map, name, KeepOutAct::Expired),
        Change::Restart => {
            let bytes = Snapshot::of(map, Uuid::nil()).encode().unwrap();
            *map = Snapshot::decode(&bytes).unwrap().restore().unwrap();
            0
        }
    }
}

fn region(change: &Change) -> Region {
    match change {
        Change::DeleteBox(_, at, side) => {
            Region::cuboid(at.map(f64::from), at.map(|c| f64::from(c + side))).unwrap()
        }
        Change::DeleteBall(_, at, radius) => Region::ball(at.map(f64::from), f64::from(*radius)).unwrap(),
        _ => unreachable!("only deletions by region have one"),
    }
}

/// The same on the model.
fn apply_to_model(model: &mut Model, change: &Change, levels: u32) -> usize {
    let before = model.len();
    match change {
        Change::Insert(indices) => model.extend(indices),
        Change::DeleteKeys(level, indices) => {
            let level = level % levels;
            let targets: Model = indices.iter().map(|&i| up(i, level)).collect();
            model.retain(|&i| !targets.contains(&up(i, level)));
        }
        Change::DeleteBox(level, ..) | Change::DeleteBall(level, ..) => {
            let (level, region) = (level % levels, region(change));
            let side = f64::from(1 << level);
            model.retain(|&i| !region.contains(up(i, level).map(|c| (f64::from(c) + 0.5) * side)));
        }
        Change::PutKeepOut(..) | Change::EndKeepOut(_) | Change::Restart => {}
    }
    before.abs_diff(model.len())
}

/// The revision and the radius of each keep-out after the change that made `revision`.
fn apply_to_keep_outs(keep_outs: &mut BTreeMap<KeepOutName, (u64, i32)>, change: &Change, revision: u64) {
    match change {
        Change::PutKeepOut(name, radius) => drop(keep_outs.insert(name.clone(), (revision, *radius))),
        Change::EndKeepOut(name) => drop(keep_outs.remove(name)),
        _ => {}
    }
}

fn keep_outs_of(map: &MultiResolutionMap) -> Vec<(KeepOutName, u64, KeepOutShape)> {
    let keep_outs = map.keep_outs();
    keep_outs.iter().map(|it| (it.name.clone(), it.made_revision, it.shape.clone())).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn a_map_equals_a_plain_set_after_any_history(
        levels in 1u32..=9,
        hashes in 1u32..=4,
        // Few bits a key, so that counters saturate as well.
        bits_per_key in prop::sample::select(vec![1.0, 4.0, 14.0]),
        has_filter: bool,
        moments: bool,
        changes in prop::collection::vec(change(), 1..25),
    ) {
        let filter = has_filter.then_some(FilterSettings { hashes, bits_per_key });
        let settings = MapSettings { filter, moments, ..MapSettings::new(1.0, levels) };
        let mut map = MultiResolutionMap::new(settings).unwrap();
        let (mut model, mut keep_outs) = (Model::new(), BTreeMap::new());
        for change in &changes {
            let before = map.content_version();
            let changed = apply(&mut map, change);
            prop_assert_eq!(changed, apply_to_model(&mut model, change, levels));
            let is_keep_out = matches!(change, Change::PutKeepOut(..) | Change::EndKeepOut(_));
            let makes_a_revision = changed > 0 || is_keep_out || matches!(change, Change::Insert(_));
            prop_assert_eq!(map.revision(), before.revision + u64::from(makes_a_revision));
            prop_assert!(!is_keep_out || map.content_version().hash == before.hash);
            assert_equal(&map, &model);
            apply_to_keep_outs(&mut keep_outs, change, map.revision());
            let expected = keep_outs.iter().map(|(name, (made, radius))| (name.clone(), *made, keep_out_shape(*radius)));
            prop_assert_eq!(keep_outs_of(&map), expected.collect::<Vec<_>>());
            prop_assert_eq!(map.moments().is_some(), moments);
        }
    }
}

#[test]
fn a_map_that_lost_all_voxels_is_as_new() {
    let mut map = MultiResolutionMap::new(MapSettings::new(1.0, 7)).unwrap();
    let indices: Vec<_> = (0..4000).map(|i| [i % 160 - 80, i / 160, i % 7]).collect();
    apply(&mut map, &Change::Insert(indices));
    let everything = VoxelSet::from_iter(map.view().voxels().iter());
    map.committer().remove(&everything);
    assert!(map.is_empty());
    let levels = map.describe(100, 0).levels;
    for level in levels {
        assert_eq!((level.voxels, level.filter.unwrap().measured_rate), (0, None));
        let view = map.view();
        assert!(view.lists(level.level).all(|list| list.filter().unwrap().counters_in_use() == (0, 0)));
    }
}

#[test]
fn a_voxel_that_was_never_there_can_be_removed_without_harm() {
    let mut map = MultiResolutionMap::new(MapSettings::new(1.0, 4)).unwrap();
    apply(&mut map, &Change::Insert(vec![[0, 0, 0], [1, 0, 0]]));
    let absent: VoxelSet =
        [VoxelKey::new([2, 0, 0]).unwrap(), VoxelKey::new([500, 0, 0]).unwrap()].into_iter().collect();
    let committed = map.committer().remove(&absent);
    assert_eq!((committed.removed, committed.revision), (0, 1));
    assert_equal(&map, &[[0, 0, 0], [1, 0, 0]].into_iter().collect());
}
