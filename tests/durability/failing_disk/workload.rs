//! A map that lives: scans, deletions, snapshots, a restart; acknowledged as the server does.

use std::path::Path;
use std::sync::Arc;

use mrol::geometry::Pose;
use mrol::map::{
    Change, DeletionRecord, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape, MapContents,
    MapName, MapSettings, MappedScan, MultiResolutionMap, Region, Request, RequestId, RobotName, ScanRecord,
    ViewpointRecord,
};
use mrol::store::{
    DataDir, MapFolder, OpenedMap, OpeningProgress, Record, Snapshot, StoreError, StoreSettings,
};
use mrol::voxel::{VoxelKey, VoxelSet};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uuid::Uuid;

use crate::support::range_images::through_a_window;
use crate::support::simulated_disk::SimulatedDisk;

pub const MAPS: &str = "data/maps";
const GROUPS: u64 = 18;

/// What was done, and what the map was after each change that was tried.
#[derive(Debug, Clone)]
pub struct History {
    /// By revision.
    pub states: Vec<MapContents>,
    /// The last revision that was acknowledged; 0 is that of the map's making.
    pub acknowledged: Option<u64>,
    /// The journal took no more.
    pub stopped: bool,
}

fn settings() -> StoreSettings {
    StoreSettings { segment_bytes_max: 3000, undo_revisions: 12, ..StoreSettings::default() }
}

fn office() -> MapName {
    MapName::new("office").unwrap()
}

/// Opens the map, where there is one.
pub fn open(disk: &SimulatedDisk) -> Result<Option<OpenedMap>, StoreError> {
    let data_dir = DataDir::on(Arc::new(disk.clone()), Path::new("data"), settings())?;
    let names = data_dir.import_map_files()?.maps;
    names.first().map(|name| data_dir.map(name, &OpeningProgress::default())).transpose()
}

/// Lives through everything, until the disk does not take any more.
pub fn run(disk: &SimulatedDisk) -> History {
    let model = MultiResolutionMap::new(MapSettings::new(0.1, 5)).unwrap();
    let mut history = History { states: vec![model.contents()], acknowledged: None, stopped: false };
    // An error ends a life; what it left is in the history.
    let _ended = live(disk, &model, &mut history);
    history
}

fn live(disk: &SimulatedDisk, model: &MultiResolutionMap, history: &mut History) -> Result<(), StoreError> {
    let data_dir = DataDir::on(Arc::new(disk.clone()), Path::new("data"), settings())?;
    let first = Snapshot::of(model, Uuid::new_v4());
    let folder = data_dir.create(&office(), &first)?;
    history.acknowledged = Some(0);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    grow(&folder, model, first.uuid, 0..GROUPS / 2, &mut rng, history)?;
    drop((folder, data_dir));

    let data_dir = DataDir::on(Arc::new(disk.clone()), Path::new("data"), settings())?;
    let opened = data_dir.map(&office(), &OpeningProgress::default())?;
    grow(&opened.folder, model, first.uuid, GROUPS / 2..GROUPS, &mut rng, history)
}

/// Commits groups of changes, and writes a snapshot now and then.
fn grow(
    folder: &MapFolder,
    model: &MultiResolutionMap,
    uuid: Uuid,
    groups: std::ops::Range<u64>,
    rng: &mut ChaCha8Rng,
    history: &mut History,
) -> Result<(), StoreError> {
    for group in groups {
        let mut records = Vec::new();
        for _ in 0..rng.random_range(1..4) {
            let change = change(model, rng);
            records.push(Record::of(&change).unwrap());
            model.committer().apply(&change);
            history.states.push(model.contents());
        }
        let records: Vec<&Record> = records.iter().collect();
        let appended = folder.append(&records).and_then(|head| folder.sync().map(|()| head));
        match appended {
            Ok(head) => history.acknowledged = Some(head),
            Err(error) => {
                // Nothing is taken any more, though the disk may be well again.
                let refused = folder.append(&records).unwrap_err();
                assert!(matches!(refused, StoreError::JournalStopped(_)), "{refused}");
                history.stopped = true;
                return Err(error);
            }
        }
        // A snapshot that cannot be written harms nobody, unless the journal is harmed with it.
        if group % 4 == 3
            && folder.save(&Snapshot::of(model, uuid), u64::MAX).is_err()
            && folder.sync().is_err()
        {
            history.stopped = true;
            return Ok(());
        }
    }
    Ok(())
}

fn change(model: &MultiResolutionMap, rng: &mut ChaCha8Rng) -> Change {
    let revision = model.revision() + 1;
    if rng.random_bool(0.3) && !model.is_empty() {
        let voxels: VoxelSet = model.view().voxels().iter().filter(|_| rng.random_bool(0.2)).collect();
        if !voxels.is_empty() {
            let id = RequestId::new(&format!("d{revision}")).unwrap();
            let request = Some(Request { id, digest: revision, caller: None });
            return Change::Deletion(DeletionRecord { voxels, request });
        }
    }
    if rng.random_bool(0.1) {
        return keep_out(revision, rng);
    }
    let keys = (0..rng.random_range(20..200)).filter_map(|_| {
        VoxelKey::new([rng.random_range(-20..20), rng.random_range(-20..20), rng.random_range(-3..3)])
    });
    let voxels = keys.collect();
    let robot = RobotName::new(["r1", "r2"][rng.random_range(0..2)]).unwrap();
    let pose = MappedScan {
        scan_id: Some(revision),
        digest: revision * 7,
        level_overlaps: vec![rng.random(), rng.random()],
        ..MappedScan::new(robot, Pose::translation(rng.random(), 0.0, 1.0 / 3.0))
    };
    let viewpoint = rng.random_bool(0.2).then(|| viewpoint(model, rng));
    Change::Insertion(ScanRecord { viewpoint, ..ScanRecord::of_voxels(pose, voxels) })
}

/// One in whose place some of the others go.
fn viewpoint(model: &MultiResolutionMap, rng: &mut ChaCha8Rng) -> ViewpointRecord {
    let viewpoints = model.viewpoints();
    let displaced =
        viewpoints.iter().map(|(revision, _)| revision).filter(|_| rng.random_bool(0.1)).collect();
    ViewpointRecord { image: through_a_window(rng.random_range(1.0..9.0)), displaced }
}

/// One of a few keep-outs is put, or ends.
fn keep_out(revision: u64, rng: &mut ChaCha8Rng) -> Change {
    let ball = Region::ball([0.0; 3], rng.random_range(0.5..5.0)).unwrap();
    let put = KeepOutAct::Put {
        shape: KeepOutShape::of_region(ball).unwrap(),
        made_by: None,
        expires_at_ns: rng.random_bool(0.5).then_some(revision as i64),
    };
    let act = if rng.random_bool(0.7) { put } else { KeepOutAct::Expired };
    let change =
        KeepOutChange { name: KeepOutName::new(["dock", "spill"][rng.random_range(0..2)]).unwrap(), act };
    Change::KeepOut(KeepOutRecord { change, request: None })
}
