//! Random maps of which scans saw a part, for the tests of this folder, and who saw it, asked one by one.

use std::collections::BTreeSet;
use std::sync::Arc;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::maps::RESOLUTION_M;
use crate::geometry::{Point, Pose};
use crate::map::test_shapes::shape;
use crate::map::{
    Change, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape, MapContents, MapSettings,
    MapView, MappedScan, MultiResolutionMap, RobotName, ScanRecord, UndoRecord, ViewpointRecord,
};
use crate::visibility::{RangeImage, Sweep, Viewpoint};
use crate::voxel::{MomentSet, VoxelKey, VoxelSet};

/// A map that is yet to be made: scans that saw something, of which some were taken back; voxels that were deleted;
/// keep-outs.
#[derive(Debug, Clone)]
pub(in crate::planning) struct SeenHistory {
    levels: u32,
    /// Each with whether it is undone.
    scans: Vec<(SeenScan, bool)>,
    deleted: VoxelSet,
    keep_outs: Vec<KeepOutShape>,
}

/// A scan of a scene that its seed makes.
#[derive(Debug, Clone, Copy)]
struct SeenScan {
    seed: u64,
    origin_m: [f64; 3],
    turned: [f64; 3],
    /// How wide it looks: tangent of half the angle.
    around: f32,
    range_m: f32,
}

/// A map, and the scans that it was made of.
#[derive(Debug)]
pub(in crate::planning) struct SeenMap {
    pub(in crate::planning) map: Arc<MultiResolutionMap>,
    scans: Vec<TakenScan>,
}

#[derive(Debug)]
struct TakenScan {
    revision: u64,
    voxels: VoxelSet,
    viewpoint: Option<Viewpoint>,
    is_undone: bool,
}

impl SeenScan {
    fn record(&self) -> ScanRecord {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let points: Vec<Point> = (0..600)
            .map(|_| {
                let mut across = || random.random_range(-self.around..self.around);
                let direction = [1.0, across(), across()];
                // Things at some distance: what is hidden behind them is not seen.
                let depth = self.range_m * if random.random_bool(0.02) { 0.4 } else { 1.0 };
                Point::from(direction.map(|c| c * depth))
            })
            .collect();
        let [roll, pitch, yaw] = self.turned;
        let rotation = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        let map_from_sensor = Pose::from_parts(self.origin_m.into(), rotation);
        let range = Sweep::standing(100.0);
        let image = RangeImage::of_points(&points, range, 2000);
        let in_map: Vec<Point> = points
            .iter()
            .step_by(6)
            .map(|p| {
                let at: [f64; 3] = (map_from_sensor * p.to_f64()).into();
                Point::from(at.map(|c| c as f32))
            })
            .collect();
        let lattice = crate::voxel::Lattice::new(RESOLUTION_M, 1).unwrap();
        let (voxels, _) = VoxelSet::of_points(&in_map, &lattice.from_map());
        let pose = MappedScan::new(RobotName::new("r").unwrap(), map_from_sensor);
        let viewpoint = image.map(|image| ViewpointRecord { image, displaced: Vec::new() });
        ScanRecord { viewpoint, ..ScanRecord::of_voxels(pose, voxels) }
    }
}

impl SeenHistory {
    /// The map of this history.
    pub(in crate::planning) fn map(&self) -> SeenMap {
        let mut seen = self.first();
        (0..Self::STEPS).for_each(|step| self.go_on(&mut seen, step));
        seen
    }

    /// Steps that lead to the map.
    pub(super) const STEPS: usize = 4;

    /// A map of which nothing has happened yet.
    pub(super) fn first(&self) -> SeenMap {
        let map = MultiResolutionMap::new(MapSettings::new(RESOLUTION_M, self.levels)).unwrap();
        SeenMap { map: Arc::new(map), scans: Vec::new() }
    }

    /// Makes a step: scans are taken in two, then voxels are deleted and scans taken back, then keep-outs are made.
    pub(super) fn go_on(&self, seen: &mut SeenMap, step: usize) {
        let (some, others) = self.scans.split_at(self.scans.len() / 2);
        match step {
            0 => some.iter().for_each(|(scan, _)| seen.insert(scan)),
            1 => others.iter().for_each(|(scan, _)| seen.insert(scan)),
            2 => {
                seen.map.committer().remove(&self.deleted);
                (0..self.scans.len()).filter(|&i| self.scans[i].1).for_each(|i| seen.undo(i));
            }
            _ => self.keep_outs.iter().enumerate().for_each(|(i, shape)| seen.keep_out(i, shape)),
        }
    }
}

impl SeenMap {
    fn insert(&mut self, scan: &SeenScan) {
        let record = scan.record();
        let revision = self.map.committer().insert_scan(record.clone()).revision;
        let image = record.viewpoint.map(|viewpoint| viewpoint.image);
        let viewpoint = image.map(|image| Viewpoint::new(record.pose.map_from_sensor, image));
        self.scans.push(TakenScan { revision, voxels: record.voxels, viewpoint, is_undone: false });
    }

    /// Takes a scan back: the voxels go that no other holds.
    fn undo(&mut self, number: usize) {
        self.scans[number].is_undone = true;
        let kept: BTreeSet<VoxelKey> =
            self.scans.iter().filter(|scan| !scan.is_undone).flat_map(|scan| scan.voxels.iter()).collect();
        let view = self.map.view();
        let goes = |voxel: &VoxelKey| !kept.contains(voxel) && view.contains(*voxel, 0);
        let removed: VoxelSet = self.scans[number].voxels.iter().filter(goes).collect();
        drop(view);
        self.map.committer().apply(&Change::Undo(UndoRecord {
            scans: vec![self.scans[number].revision],
            deletions: Vec::new(),
            removed,
            restored: VoxelSet::default(),
            moments: MomentSet::default(),
            request: None,
        }));
    }

    fn keep_out(&self, number: usize, shape: &KeepOutShape) {
        let name = KeepOutName::new(&format!("k{number}")).unwrap();
        let act = KeepOutAct::Put { shape: shape.clone(), made_by: None, expires_at_ns: None };
        let change = KeepOutChange { name, act };
        self.map.committer().apply(&Change::KeepOut(KeepOutRecord { change, request: None }));
    }

    /// True where a viewpoint of a scan that was not taken back saw through the center of a voxel.
    pub(in crate::planning) fn is_seen_through(&self, voxel: VoxelKey, level: u32) -> bool {
        let center_m = self.map.lattice().center_m(voxel, level);
        let mut viewpoints =
            self.scans.iter().filter(|scan| !scan.is_undone).flat_map(|scan| &scan.viewpoint);
        viewpoints.any(|viewpoint| viewpoint.is_free(center_m))
    }

    /// True where a voxel is free: seen through, and not occupied.
    pub(in crate::planning) fn is_free(&self, view: &MapView<'_>, voxel: VoxelKey, level: u32) -> bool {
        !view.contains(voxel, level) && self.is_seen_through(voxel, level)
    }

    /// A map of one level in whose middle each voxel is occupied that is not free at a level of this one.
    pub(super) fn solid(&self, level: u32) -> Arc<MultiResolutionMap> {
        let side_m = self.map.lattice().resolution_m(level);
        let half = (SOLID_M / side_m).ceil() as i32 + SOLID_CELLS;
        let view = self.map.view();
        let axis = || -half..half;
        let all = axis().flat_map(|z| axis().flat_map(move |y| axis().map(move |x| [x, y, z])));
        let voxels =
            all.filter_map(VoxelKey::new).filter(|voxel| !self.is_free(&view, *voxel, level)).collect();
        drop(view);
        Arc::new(
            MultiResolutionMap::restore(MapSettings::new(side_m, 1), MapContents::at(1, voxels)).unwrap(),
        )
    }
}

/// How far a solid map goes from the origin along an axis: beyond all that scans see, and some cells more.
const SOLID_M: f64 = 9.0;
const SOLID_CELLS: i32 = 7;

/// A scan of a small scene, so that few voxels are looked at one by one.
fn scan() -> impl Strategy<Value = SeenScan> {
    let origin = prop::array::uniform3(-3.0f64..3.0);
    let turned = prop::array::uniform3(-3.0f64..3.0);
    (any::<u64>(), origin, turned, 0.3f32..1.0, 1.0f32..3.4).prop_map(
        |(seed, origin_m, turned, around, range_m)| SeenScan { seed, origin_m, turned, around, range_m },
    )
}

/// A history of a map of 1 to 4 levels, and a level of it.
pub(in crate::planning) fn seen_history_and_level() -> impl Strategy<Value = (SeenHistory, u32)> {
    let level = (1u32..=4).prop_flat_map(|levels| (Just(levels), 0..levels));
    let scans = prop::collection::vec((scan(), prop::bool::weighted(0.25)), 0..5);
    let keep_outs = prop_oneof![Just(Vec::new()), prop::collection::vec(shape(), 1..3)];
    (level, scans, any::<u64>(), keep_outs).prop_map(|((levels, level), scans, seed, keep_outs)| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let voxels = scans.iter().flat_map(|(scan, _)| scan.record().voxels.iter().collect::<Vec<_>>());
        let deleted = voxels.filter(|_| random.random_bool(0.2)).collect();
        (SeenHistory { levels, scans, deleted, keep_outs }, level)
    })
}
