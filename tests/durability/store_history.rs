//! Long random histories of a map that is kept: scans, deletions, undo, keep-outs, snapshots and restarts, against a
//! plain model that replays what was not undone.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;

use mrol::geometry::{Point, Pose};
use mrol::map::{
    CallerName, Change, DeletionRecord, KeepOut, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord,
    KeepOutShape, MapName, MapSettings, MappedScan, MultiResolutionMap, Region, Reversal, RobotName,
    ScanRecord, UndoRecord, ViewpointRecord,
};
use mrol::store::{DataDir, MapFolder, NotObserved, OpeningProgress, Record, Snapshot, StoreSettings};
use mrol::util::StopSignal;
use mrol::visibility::RangeImage;
use mrol::voxel::{Moments, VoxelKey, VoxelSet};
use proptest::prelude::*;
use proptest::sample::Index;
use uuid::Uuid;

use crate::support::plain_set::{PlainSet, assert_equal, up};
use crate::support::range_images::through_a_window;
use crate::support::simulated_disk::SimulatedDisk;

#[derive(Debug, Clone)]
enum Step {
    /// A scan of the first that saw through the others.
    Insert {
        robot: usize,
        indices: Vec<[i32; 3]>,
        carved: Vec<[i32; 3]>,
        viewpoint: Option<SeenSpace>,
    },
    Delete {
        level: u32,
        indices: Vec<[i32; 3]>,
    },
    UndoScan(Index),
    UndoSince {
        robot: usize,
        scan: Index,
    },
    UndoDeletion(Index),
    PutKeepOut {
        name: usize,
        radius: u8,
        expires_at_ns: Option<i64>,
    },
    RemoveKeepOut {
        name: usize,
    },
    /// Time goes on to here.
    ExpireKeepOuts(i64),
    Snapshot,
    Restart,
}

/// The viewpoint that a scan leaves.
#[derive(Debug, Clone)]
struct SeenSpace {
    distance: u8,
    /// Those of the others that go.
    displaced: Vec<Index>,
}

fn seen_space() -> impl Strategy<Value = SeenSpace> {
    (1u8..9, prop::collection::vec(any::<Index>(), 0..3))
        .prop_map(|(distance, displaced)| SeenSpace { distance, displaced })
}

fn index() -> impl Strategy<Value = [i32; 3]> {
    // So few places that most voxels are seen by several scans.
    prop_oneof![9 => prop::array::uniform3(-3i32..3), 1 => prop::array::uniform3(-90i32..90)]
}

fn step() -> impl Strategy<Value = Step> {
    let indices = || prop::collection::vec(index(), 1..60);
    prop_oneof![
        8 => (0usize..2, indices(), prop::collection::vec(index(), 0..20), prop::option::of(seen_space()))
            .prop_map(|(robot, indices, carved, viewpoint)| Step::Insert { robot, indices, carved, viewpoint }),
        3 => (0u32..6, prop::collection::vec(index(), 1..8))
            .prop_map(|(level, indices)| Step::Delete { level, indices }),
        3 => any::<Index>().prop_map(Step::UndoScan),
        1 => (0usize..2, any::<Index>()).prop_map(|(robot, scan)| Step::UndoSince { robot, scan }),
        2 => any::<Index>().prop_map(Step::UndoDeletion),
        2 => (0usize..3, 1u8..9, prop::option::of(0i64..9))
            .prop_map(|(name, radius, expires_at_ns)| Step::PutKeepOut { name, radius, expires_at_ns }),
        1 => (0usize..3).prop_map(|name| Step::RemoveKeepOut { name }),
        1 => (0i64..9).prop_map(Step::ExpireKeepOuts),
        2 => Just(Step::Snapshot),
        2 => Just(Step::Restart),
    ]
}

/// All that happened, and what of it was not undone.
#[derive(Default)]
struct Model {
    trajectory: Vec<(u64, RobotName)>,
    deletions: Vec<u64>,
    events: BTreeMap<u64, Event>,
    keep_outs: BTreeMap<KeepOutName, KeepOut>,
    viewpoints: BTreeMap<u64, RangeImage>,
}

/// A change by the revision that it made, as it was recorded.
#[derive(Default)]
struct Event {
    /// Finest voxels that went first.
    removed: PlainSet,
    /// Finest voxels in whose centers the points of a scan lay.
    points: Vec<[i32; 3]>,
}

/// What a map holds: voxels, and the moments of the points in each voxel of level 2.
#[derive(Default)]
struct Held {
    voxels: PlainSet,
    moments: BTreeMap<[i32; 3], Moments>,
}

impl Model {
    /// What happened, without what was undone, from the start.
    fn held(&self) -> Held {
        let mut held = Held::default();
        self.events.values().for_each(|event| held.change(event));
        held
    }

    fn undo(&mut self, changes: &[u64]) {
        self.events.retain(|revision, _| !changes.contains(revision));
        self.trajectory.retain(|(scan, _)| !changes.contains(scan));
        self.deletions.retain(|deletion| !changes.contains(deletion));
        self.viewpoints.retain(|scan, _| !changes.contains(scan));
    }

    /// The viewpoint of the next scan, and the ones that go with it.
    fn displacing(&mut self, SeenSpace { distance, displaced }: &SeenSpace) -> ViewpointRecord {
        let there: Vec<u64> = self.viewpoints.keys().copied().collect();
        let gone: BTreeSet<u64> = displaced.iter().filter_map(|which| pick(&there, which)).collect();
        self.viewpoints.retain(|scan, _| !gone.contains(scan));
        ViewpointRecord {
            image: through_a_window(f32::from(*distance)),
            displaced: gone.into_iter().collect(),
        }
    }

    /// True where the map has the viewpoints that it should have.
    fn has_viewpoints_of(&self, map: &MultiResolutionMap) -> bool {
        let viewpoints = map.viewpoints();
        viewpoints
            .iter()
            .map(|(scan, it)| (scan, it.image()))
            .eq(self.viewpoints.iter().map(|(scan, it)| (*scan, it)))
    }
}

impl Held {
    fn change(&mut self, Event { removed, points }: &Event) {
        let gone: PlainSet = self.voxels.intersection(removed).copied().collect();
        self.voxels.retain(|voxel| !gone.contains(voxel));
        for cell in gone.into_iter().map(|i| up(i, 2)).collect::<PlainSet>() {
            let mut rest = Moments::default();
            self.voxels.iter().filter(|&&i| up(i, 2) == cell).for_each(|&i| rest += of_center(i));
            self.moments.insert(cell, rest);
        }
        self.voxels.extend(points);
        points.iter().for_each(|&i| *self.moments.entry(up(i, 2)).or_default() += of_center(i));
        self.moments.retain(|_, moments| !moments.is_empty());
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
    fn new(map: MapSettings, settings: StoreSettings) -> Self {
        let (disk, uuid) = (SimulatedDisk::default(), Uuid::new_v4());
        let map = MultiResolutionMap::new(map).unwrap();
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

    /// False where the journal does not reach back to the changes.
    fn undo(&self, targets: UndoRecord) -> bool {
        let withdrawn = self.map.trajectory().withdrawn().to_vec();
        let (all, changes) = (|_| Ok::<_, Infallible>(()), targets.changes().collect::<Vec<_>>());
        let settings = self.map.settings();
        let mut observed =
            match self.folder.observations(settings, &changes, &withdrawn, all, StopSignal::NEVER) {
                Err(NotObserved::OutsideUndoWindow) => {
                    let reach = self.map.revision().saturating_sub(self.settings.undo_revisions);
                    assert!(changes[0] <= reach, "{} is out of reach at {}", changes[0], self.map.revision());
                    return false;
                }
                observed => observed.unwrap(),
            };
        assert_eq!(observed.revision, self.map.revision());
        let Reversal { removed, restored, moments } =
            observed.observations.reversal(StopSignal::NEVER).unwrap();
        assert!(self.map.settings().moments || moments.as_slice().is_empty());
        self.commit(&Change::Undo(UndoRecord { removed, restored, moments, ..targets }));
        true
    }

    fn undo_scans(&self, scans: Vec<u64>, model: &mut Model) {
        if !scans.is_empty() && self.undo(UndoRecord { scans: scans.clone(), ..UndoRecord::default() }) {
            model.undo(&scans);
        }
    }

    fn step(&mut self, step: &Step, model: &mut Model) {
        match step {
            Step::Insert { robot: number, indices, carved, viewpoint } => {
                let points: Vec<Point> = indices.iter().map(|i| i.map(|i| i as f32 + 0.5).into()).collect();
                let pose = MappedScan::new(robot(*number), Pose::identity());
                let there = model.held().voxels;
                let removed: PlainSet =
                    carved.iter().filter(|&i| there.contains(i) && !indices.contains(i)).copied().collect();
                let carved = removed.iter().filter_map(|&i| VoxelKey::new(i)).collect();
                let record = match self.map.settings().moments {
                    true => ScanRecord::of_points(pose, &points, self.map.lattice()),
                    false => ScanRecord::without_moments(pose, &points, self.map.lattice()),
                };
                let viewpoint = viewpoint.as_ref().map(|seen| model.displacing(seen));
                let scan = ScanRecord { carved, viewpoint: viewpoint.clone(), ..record };
                let revision = self.commit(&Change::Insertion(scan));
                model.viewpoints.extend(viewpoint.map(|viewpoint| (revision, viewpoint.image)));
                model.events.insert(revision, Event { removed, points: indices.clone() });
                model.trajectory.push((revision, robot(*number)));
            }
            Step::Delete { level, indices } => {
                let level = level % self.map.settings().levels;
                let keys = indices.iter().filter_map(|&i| VoxelKey::new(up(i, level)));
                let voxels: VoxelSet = self.map.view().descendants_of(keys, level);
                let gone: PlainSet = indices.iter().map(|&i| up(i, level)).collect();
                let removed: PlainSet =
                    model.held().voxels.into_iter().filter(|&i| gone.contains(&up(i, level))).collect();
                if !voxels.is_empty() {
                    let revision = self.commit(&Change::Deletion(DeletionRecord { voxels, request: None }));
                    model.events.insert(revision, Event { removed, ..Event::default() });
                    model.deletions.push(revision);
                }
            }
            Step::UndoScan(which) => {
                let scans: Vec<u64> = model.trajectory.iter().map(|(scan, _)| *scan).collect();
                self.undo_scans(pick(&scans, which).into_iter().collect(), model);
            }
            Step::UndoSince { robot: number, scan } => {
                let scans: Vec<u64> = model.trajectory.iter().map(|(scan, _)| *scan).collect();
                let Some(since) = pick(&scans, scan) else { return };
                let meant = |(scan, who): &&(u64, RobotName)| *scan > since && *who == robot(*number);
                let scans = model.trajectory.iter().filter(meant).map(|(scan, _)| *scan).collect();
                self.undo_scans(scans, model);
            }
            Step::UndoDeletion(which) => {
                let Some(deletion) = pick(&model.deletions, which) else { return };
                if self.undo(UndoRecord { deletions: vec![deletion], ..UndoRecord::default() }) {
                    model.undo(&[deletion]);
                }
            }
            Step::PutKeepOut { name, radius, expires_at_ns } => {
                let (name, expires_at_ns) = (keep_out_name(*name), *expires_at_ns);
                let ball = Region::ball([0.5; 3], f64::from(*radius)).unwrap();
                let (shape, made_by) = (KeepOutShape::of_region(ball).unwrap(), CallerName::new("ops").ok());
                let act = KeepOutAct::Put { shape: shape.clone(), made_by: made_by.clone(), expires_at_ns };
                let made_revision = self.commit(&keep_out_change(&name, act));
                let made = KeepOut { name: name.clone(), shape, made_by, made_revision, expires_at_ns };
                model.keep_outs.insert(name, made);
            }
            Step::RemoveKeepOut { name } => {
                let name = keep_out_name(*name);
                if model.keep_outs.remove(&name).is_some() {
                    self.commit(&keep_out_change(&name, KeepOutAct::Removed { by: None }));
                }
            }
            Step::ExpireKeepOuts(now_ns) => {
                let expired: Vec<_> =
                    self.map.keep_outs().expired(*now_ns).map(|it| it.name.clone()).collect();
                for name in &expired {
                    self.commit(&keep_out_change(name, KeepOutAct::Expired));
                }
                model.keep_outs.retain(|_, it| it.expires_at_ns.is_none_or(|at| at > *now_ns));
            }
            Step::Snapshot => self.folder.save(&Snapshot::of(&self.map, self.uuid), u64::MAX).unwrap(),
            Step::Restart => self.restart(self.map.revision()),
        }
    }
}

fn keep_out_name(number: usize) -> KeepOutName {
    KeepOutName::new(["dock", "spill", "stage"][number]).unwrap()
}

fn keep_out_change(name: &KeepOutName, act: KeepOutAct) -> Change {
    let change = KeepOutChange { name: name.clone(), act };
    Change::KeepOut(KeepOutRecord { change, request: None })
}

fn pick(revisions: &[u64], which: &Index) -> Option<u64> {
    (!revisions.is_empty()).then(|| *which.get(revisions))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn a_kept_map_equals_a_plain_model_after_any_history(
        levels in 1u32..=7,
        // So few that undo runs into its reach, or so many that it does not.
        undo_revisions in prop::sample::select(vec![0u64, 3, 10, 1000]),
        segment_bytes_max in prop::sample::select(vec![1u64, 600, 1 << 20]),
        has_filter: bool,
        moments: bool,
        steps in prop::collection::vec(step(), 1..70),
    ) {
        let settings = StoreSettings { undo_revisions, segment_bytes_max, ..StoreSettings::default() };
        let map = MapSettings::new(1.0, levels);
        let map = MapSettings { filter: map.filter.filter(|_| has_filter), moments, ..map };
        let (mut kept, mut model) = (Kept::new(map, settings), Model::default());
        for step in &steps {
            kept.step(step, &mut model);
            let held = model.held();
            assert_equal(&kept.map, &held.voxels);
            let found: Vec<_> =
                kept.map.trajectory().poses().map(|pose| (pose.revision, pose.robot.clone())).collect();
            prop_assert_eq!(&found, &model.trajectory);
            let found = kept.map.moments().map(|moments| moments.to_set());
            let of_voxel = |(key, moments): &(VoxelKey, Moments)| (key.index(), *moments);
            let found = found.map(|set| set.as_slice().iter().map(of_voxel).collect::<BTreeMap<_, _>>());
            prop_assert_eq!(found, moments.then_some(held.moments));
            let keep_outs = kept.map.keep_outs();
            prop_assert!(keep_outs.iter().eq(model.keep_outs.values()), "{:?}", keep_outs);
            prop_assert!(model.has_viewpoints_of(&kept.map), "{:?}", kept.map.viewpoints());
        }
        kept.restart(7);
        assert_equal(&kept.map, &model.held().voxels);
        prop_assert!(kept.map.keep_outs().iter().eq(model.keep_outs.values()));
        prop_assert!(model.has_viewpoints_of(&kept.map));
    }
}

#[test]
fn viewpoints_stay_when_the_poses_of_their_scans_are_thinned() {
    let settings = StoreSettings { undo_revisions: 0, ..StoreSettings::default() };
    let (mut kept, mut model) = (Kept::new(MapSettings::new(1.0, 3), settings), Model::default());
    for distance in 1..9 {
        let viewpoint = Some(SeenSpace { distance, displaced: Vec::new() });
        let step = Step::Insert { robot: 0, indices: vec![[1, 2, 3]], carved: Vec::new(), viewpoint };
        kept.step(&step, &mut model);
    }
    assert!(kept.map.committer().thin(kept.map.revision(), &kept.settings.trajectory_spacing) > 3);
    assert!(model.has_viewpoints_of(&kept.map));
    kept.step(&Step::Snapshot, &mut model);
    kept.restart(1);
    assert!(kept.map.trajectory().len() < 5);
    assert!(model.has_viewpoints_of(&kept.map));
}
