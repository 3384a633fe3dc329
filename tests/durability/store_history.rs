//! Long random histories of a map that is kept: scans, deletions, undo, snapshots and restarts, against a plain model
//! that remembers who holds each voxel.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;

use mrol::geometry::{Point, Pose};
use mrol::map::{
    Change, DeletionRecord, Leaving, MapName, MapSettings, MappedScan, MultiResolutionMap, RobotName,
    ScanRecord, UndoRecord,
};
use mrol::store::{DataDir, MapFolder, NotObserved, OpeningProgress, Record, Snapshot, StoreSettings};
use mrol::util::StopSignal;
use mrol::voxel::{Moments, VoxelKey, VoxelSet};
use proptest::prelude::*;
use proptest::sample::Index;
use uuid::Uuid;

use crate::support::plain_set::{PlainSet, assert_equal, up};
use crate::support::simulated_disk::SimulatedDisk;

#[derive(Debug, Clone)]
enum Step {
    Insert { robot: usize, indices: Vec<[i32; 3]> },
    Delete { level: u32, indices: Vec<[i32; 3]> },
    UndoScan(Index),
    UndoSince { robot: usize, scan: Index },
    Snapshot,
    Restart,
}

fn index() -> impl Strategy<Value = [i32; 3]> {
    // So few places that most voxels are seen by several scans.
    prop_oneof![9 => prop::array::uniform3(-3i32..3), 1 => prop::array::uniform3(-90i32..90)]
}

fn step() -> impl Strategy<Value = Step> {
    let indices = || prop::collection::vec(index(), 1..60);
    prop_oneof![
        8 => (0usize..2, indices()).prop_map(|(robot, indices)| Step::Insert { robot, indices }),
        3 => (0u32..6, prop::collection::vec(index(), 1..8))
            .prop_map(|(level, indices)| Step::Delete { level, indices }),
        3 => any::<Index>().prop_map(Step::UndoScan),
        1 => (0usize..2, any::<Index>()).prop_map(|(robot, scan)| Step::UndoSince { robot, scan }),
        2 => Just(Step::Snapshot),
        2 => Just(Step::Restart),
    ]
}

/// Who holds each voxel, the scans that are accepted, and all that happened.
#[derive(Default)]
struct Model {
    holders: BTreeMap<[i32; 3], BTreeSet<u64>>,
    trajectory: Vec<(u64, RobotName)>,
    events: Vec<Event>,
}

enum Event {
    /// A scan of the centers of these voxels.
    Scan(u64, Vec<[i32; 3]>),
    /// The finest voxels that went.
    Deletion(PlainSet),
}

impl Model {
    fn voxels(&self) -> PlainSet {
        self.holders.keys().copied().collect()
    }

    /// Of the points in each voxel of level 2: what happened, without the scans that were undone, from the start.
    fn moments(&self) -> BTreeMap<[i32; 3], Moments> {
        let (mut occupied, mut moments) = (PlainSet::new(), BTreeMap::<[i32; 3], Moments>::new());
        for event in &self.events {
            match event {
                Event::Scan(scan, points) if self.trajectory.iter().any(|(kept, _)| kept == scan) => {
                    occupied.extend(points);
                    points.iter().for_each(|&i| *moments.entry(up(i, 2)).or_default() += of_center(i));
                }
                Event::Scan(..) => {}
                Event::Deletion(voxels) => {
                    for cell in voxels.intersection(&occupied).map(|&i| up(i, 2)).collect::<PlainSet>() {
                        let mut rest = Moments::default();
                        let left = occupied.difference(voxels).filter(|&&i| up(i, 2) == cell);
                        left.for_each(|&i| rest += of_center(i));
                        moments.insert(cell, rest);
                    }
                    occupied = occupied.difference(voxels).copied().collect();
                }
            }
        }
        moments.retain(|_, moments| !moments.is_empty());
        moments
    }

    fn undo(&mut self, scans: &[u64]) {
        self.holders.retain(|_, holders| {
            holders.retain(|scan| !scans.contains(scan));
            !holders.is_empty()
        });
        self.trajectory.retain(|(scan, _)| !scans.contains(scan));
    }
}

/// The moments of a finest voxel's center in its voxel of level 2.
fn of_center(index: [i32; 3]) -> Moments {
    Moments::of_offset(index.map(|i| i64::from(2 * (i & 3) - 3) * (Moments::UNITS / 8)))
}

/// A map on a disk.
struct Kept {
    disk: SimulatedDisk,
    settings: StoreSettings,
    uuid: Uuid,
    folder: MapFolder,
    map: MultiResolutionMap,
}

fn office() -> MapName {
    MapName::new("office").unwrap()
}

fn robot(number: usize) -> RobotName {
    RobotName::new(["r1", "r2"][number]).unwrap()
}

fn data_dir(disk: &SimulatedDisk, settings: &StoreSettings) -> DataDir {
    DataDir::on(Arc::new(disk.clone()), Path::new("data"), settings.clone()).unwrap()
}

impl Kept {
    fn new(levels: u32, settings: StoreSettings) -> Self {
        let (disk, uuid) = (SimulatedDisk::default(), Uuid::new_v4());
        let map = MultiResolutionMap::new(MapSettings::new(1.0, levels)).unwrap();
        let folder = data_dir(&disk, &settings).create(&office(), &Snapshot::of(&map, uuid)).unwrap();
        Self { disk, settings, uuid, folder, map }
    }

    fn commit(&self, change: &Change) -> u64 {
        let head = self.folder.append(&[&Record::of(change).unwrap()]).unwrap();
        self.folder.sync().unwrap();
        assert_eq!(self.map.committer().apply(change).revision, head);
        head
    }

    /// What the power's going leaves.
    fn restart(&mut self, seed: u64) {
        self.disk = self.disk.after_crash(seed);
        let opened =
            data_dir(&self.disk, &self.settings).map(&office(), &OpeningProgress::default()).unwrap();
        assert_eq!(opened.uuid, self.uuid);
        assert_eq!(opened.map.contents(), self.map.contents());
        (self.folder, self.map) = (opened.folder, opened.map);
    }

    /// False where the journal does not reach back to the scans.
    fn undo(&self, scans: &[u64]) -> bool {
        let withdrawn = self.map.trajectory().withdrawn().to_vec();
        let all = |_| Ok::<_, Infallible>(());
        let mut observed = match self.folder.observations(scans, &withdrawn, all, StopSignal::NEVER) {
            Err(NotObserved::OutsideUndoWindow) => {
                let reach = self.map.revision().saturating_sub(self.settings.undo_revisions);
                assert!(scans[0] <= reach, "scan {} is out of reach at {}", scans[0], self.map.revision());
                return false;
            }
            observed => observed.unwrap(),
        };
        assert_eq!(observed.revision, self.map.revision());
        let Leaving { voxels, moments } = observed.observations.leaving(StopSignal::NEVER).unwrap();
        self.commit(&Change::Undo(UndoRecord { scans: scans.to_vec(), voxels, moments, request: None }));
        true
    }

    fn step(&mut self, step: &Step, model: &mut Model) {
        match step {
            Step::Insert { robot: number, indices } => {
                let points: Vec<Point> = indices.iter().map(|i| i.map(|i| i as f32 + 0.5).into()).collect();
                let pose = MappedScan::new(robot(*number), Pose::identity());
                let record = ScanRecord::of_points(pose, &points, self.map.lattice());
                let revision = self.commit(&Change::Insertion(record));
                model.events.push(Event::Scan(revision, indices.clone()));
                for &i in indices {
                    model.holders.entry(i).or_default().insert(revision);
                }
                model.trajectory.push((revision, robot(*number)));
            }
            Step::Delete { level, indices } => {
                let level = level % self.map.settings().levels;
                let keys = indices.iter().filter_map(|&i| VoxelKey::new(up(i, level)));
                let voxels: VoxelSet = self.map.view().descendants_of(keys, level);
                if !voxels.is_empty() {
                    self.commit(&Change::Deletion(DeletionRecord { voxels, request: None }));
                }
                let gone: PlainSet = indices.iter().map(|&i| up(i, level)).collect();
                let deleted = model.voxels().into_iter().filter(|&i| gone.contains(&up(i, level)));
                model.events.push(Event::Deletion(deleted.collect()));
                model.holders.retain(|&i, _| !gone.contains(&up(i, level)));
            }
            Step::UndoScan(which) => {
                if let Some(scan) = pick(&model.trajectory, which)
                    && self.undo(&[scan])
                {
                    model.undo(&[scan]);
                }
            }
            Step::UndoSince { robot: number, scan } => {
                let Some(since) = pick(&model.trajectory, scan) else { return };
                let meant = |(scan, who): &&(u64, RobotName)| *scan > since && *who == robot(*number);
                let scans: Vec<u64> = model.trajectory.iter().filter(meant).map(|(scan, _)| *scan).collect();
                if !scans.is_empty() && self.undo(&scans) {
                    model.undo(&scans);
                }
            }
            Step::Snapshot => self.folder.save(&Snapshot::of(&self.map, self.uuid), u64::MAX).unwrap(),
            Step::Restart => self.restart(self.map.revision()),
        }
    }
}

fn pick(trajectory: &[(u64, RobotName)], which: &Index) -> Option<u64> {
    (!trajectory.is_empty()).then(|| which.get(trajectory).0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn a_kept_map_equals_a_plain_model_after_any_history(
        levels in 1u32..=7,
        // So few that undo runs into its reach, or so many that it does not.
        undo_revisions in prop::sample::select(vec![0u64, 3, 10, 1000]),
        segment_bytes_max in prop::sample::select(vec![1u64, 600, 1 << 20]),
        steps in prop::collection::vec(step(), 1..70),
    ) {
        let settings = StoreSettings { undo_revisions, segment_bytes_max, ..StoreSettings::default() };
        let (mut kept, mut model) = (Kept::new(levels, settings), Model::default());
        for step in &steps {
            kept.step(step, &mut model);
            assert_equal(&kept.map, &model.voxels());
            let found: Vec<_> =
                kept.map.trajectory().poses().map(|pose| (pose.revision, pose.robot.clone())).collect();
            prop_assert_eq!(&found, &model.trajectory);
            let moments: BTreeMap<_, _> =
                kept.map.moments().to_set().as_slice().iter().map(|(key, moments)| (key.index(), *moments)).collect();
            prop_assert_eq!(moments, model.moments());
        }
        kept.restart(7);
        assert_equal(&kept.map, &model.voxels());
    }
}
