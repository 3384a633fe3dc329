//! A map's folder whose files were tampered with: what is opened is a revision that was, or it is refused.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use mrol_map::geometry::Pose;
use mrol_map::map::{
    CallerName, Change, DeletionRecord, KeepOutAct, KeepOutChange, KeepOutName, KeepOutRecord, KeepOutShape,
    MapContents, MapName, MapSettings, MappedScan, MultiResolutionMap, Prism, Request, RequestId, RobotName,
    ScanRecord, UndoRecord,
};
use mrol_map::voxel::VoxelKey;
use mrol_store::{
    DataDir, FileSystem, MapFolder, OpenedMap, OpeningProgress, Record, Snapshot, StoreError, StoreSettings,
};
use uuid::Uuid;

use super::frames;
use super::simulated::SimulatedDisk;

/// The map's changes: so many, with a snapshot in the middle.
const REVISIONS: u64 = 8;
const SNAPSHOT_AT: u64 = 4;
const MAP: Uuid = Uuid::from_u128(0x6d72_6f6c);
const FILES: [&str; 4] = [
    "journal-00000000000000000005.log",
    "snapshot-00000000000000000004.mrol",
    "journal-00000000000000000001.log",
    "snapshot-00000000000000000000.mrol",
];

/// A folder as a server left it.
pub(super) struct Kept {
    disk: SimulatedDisk,
    /// What the map held at each revision.
    history: Vec<MapContents>,
}

/// Tampers with the files of a folder as the input says, and opens it.
///
/// An input is a list of edits: a file, an action, an offset (u16, little-endian), a length, and so many bytes.
pub(super) fn journal(bytes: &[u8]) {
    thread_local! {
        static KEPT: Kept = Kept::new();
    }
    KEPT.with(|kept| kept.survives(bytes));
}

impl Kept {
    fn new() -> Self {
        let disk = SimulatedDisk::default();
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).expect("settings");
        let folder = data_dir(&disk).create(&name(), &Snapshot::of(&map, MAP)).expect("a folder");
        let mut history = vec![map.contents()];
        for revision in 1..=REVISIONS {
            commit(&folder, &map, &change(revision));
            history.push(map.contents());
            if revision == SNAPSHOT_AT {
                folder.save(&Snapshot::of(&map, MAP), u64::MAX).expect("a snapshot");
            }
        }
        Self { disk, history }
    }

    fn survives(&self, edits: &[u8]) {
        let disk = self.disk.copy();
        let mut forged = false;
        apply(&disk, edits, &mut forged);
        // Nothing tells of frames that are gone as a whole, from the end on.
        let ends_between_frames = frames::boundaries(&read(&disk, FILES[0])).is_some();
        let Ok(opened) = open(&disk) else { return };
        let revision = opened.map.revision();
        assert!(revision <= REVISIONS || forged, "revision {revision} had never been");
        if !forged && self.is_untouched(&disk, opened.snapshot, revision) {
            assert_eq!(opened.map.contents(), self.history[revision as usize], "revision {revision}");
        }
        let lost = revision < REVISIONS && !ends_between_frames;
        assert!(!lost || forged || opened.recovered.cut.is_some(), "lost in silence: {:?}", opened.recovered);
        let contents = opened.map.contents();
        drop(opened);
        let again = open(&disk).expect("what was opened once").map.contents();
        assert_eq!(again, contents, "opened twice");
    }

    /// True where all that `revision` follows from is as it was written; else somebody has forged checksums.
    fn is_untouched(&self, disk: &SimulatedDisk, snapshot: u64, revision: u64) -> bool {
        let same = |file: &str, bytes: usize| {
            let (before, after) = (read(&self.disk, file), read(disk, file));
            after.get(..bytes) == before.get(..bytes)
        };
        let whole = |file: &str| same(file, read(&self.disk, file).len());
        let frames = |file: &str, count: u64| {
            same(file, frames::boundaries(&read(&self.disk, file)).expect("good frames")[count as usize])
        };
        match snapshot {
            0 => {
                whole(FILES[3])
                    && frames(FILES[2], revision.min(SNAPSHOT_AT))
                    && (revision <= SNAPSHOT_AT || frames(FILES[0], revision - SNAPSHOT_AT))
            }
            _ => whole(FILES[1]) && (revision == SNAPSHOT_AT || frames(FILES[0], revision - SNAPSHOT_AT)),
        }
    }
}

/// Does what the input says; `forged` where it makes checksums right again.
fn apply(disk: &SimulatedDisk, mut edits: &[u8], forged: &mut bool) {
    while let Some((&[file, action, low, high, length], rest)) = edits.split_first_chunk() {
        let (new, rest) = rest.split_at(rest.len().min(length.into()));
        edits = rest;
        let file = FILES[usize::from(file) % FILES.len()];
        let mut bytes = read(disk, file);
        let at = usize::from(u16::from_le_bytes([low, high])).min(bytes.len());
        let end = bytes.len().min(at + usize::from(length));
        match action % 7 {
            0 => bytes[at..end].copy_from_slice(
                &new.iter().copied().chain(std::iter::repeat(0)).take(end - at).collect::<Vec<_>>(),
            ),
            1 => bytes.truncate(at),
            2 => drop(bytes.splice(at..at, new.iter().copied())),
            3 => drop(bytes.drain(at..end)),
            4 => bytes[at..].fill(0),
            5 => bytes.extend_from_within(at..end),
            _ => {
                *forged = true;
                frames::seal(MAP, &mut bytes[at..]);
            }
        }
        write(disk, file, &bytes);
    }
}

/// One of each kind, and some more.
fn change(revision: u64) -> Change {
    let voxels = |from: i32, count: i32| {
        (from..from + count).filter_map(|i| VoxelKey::new([i % 9, i / 9 % 9, -(i / 81)])).collect()
    };
    let request =
        |id: &str| Some(Request { id: RequestId::new(id).expect("an id"), digest: revision, caller: None });
    match revision {
        3 => Change::Deletion(DeletionRecord { voxels: voxels(40, 5), request: request("d") }),
        4 => keep_out(KeepOutAct::Put {
            shape: KeepOutShape::Prism(
                Prism::new(&[[0.0, 0.0], [2.0, 0.0], [1.0, 2.0]], [0.0, 1.0]).expect("a prism"),
            ),
            made_by: CallerName::new("ops").ok(),
            expires_at_ns: Some(9),
        }),
        7 => keep_out(KeepOutAct::Expired),
        6 => Change::Undo(UndoRecord {
            scans: vec![5],
            deletions: vec![3],
            removed: voxels(160, 20),
            restored: voxels(40, 5),
            request: request("u"),
            ..UndoRecord::default()
        }),
        _ => {
            let robot = RobotName::new("r1").expect("a name");
            let pose = MappedScan { scan_id: Some(revision), ..MappedScan::new(robot, Pose::identity()) };
            let first = revision as i32 * 20;
            let lattice = mrol_map::voxel::Lattice::new(0.1, 4).expect("settings");
            let points = (first..first + 100).map(|i| {
                mrol_map::geometry::Point::new(
                    (i % 9) as f32 / 10.0,
                    (i / 9 % 9) as f32 / 10.0,
                    -((i / 81) as f32) / 10.0,
                )
            });
            Change::Insertion(ScanRecord::of_points(pose, &points.collect::<Vec<_>>(), &lattice))
        }
    }
}

fn keep_out(act: KeepOutAct) -> Change {
    let change = KeepOutChange { name: KeepOutName::new("dock").expect("a name"), act };
    Change::KeepOut(KeepOutRecord { change, request: None })
}

fn commit(folder: &MapFolder, map: &MultiResolutionMap, change: &Change) {
    let record = Record::of(change).expect("a record");
    let head = folder.append(&[&record]).expect("an append");
    folder.sync().expect("a sync");
    assert_eq!(map.committer().apply(change).revision, head);
}

/// A folder of one map whose journal has one record.
pub(super) fn with_record(record: &[u8]) -> Result<OpenedMap, StoreError> {
    let disk = SimulatedDisk::default();
    let map = MultiResolutionMap::new(MapSettings::new(0.1, 4)).expect("settings");
    drop(data_dir(&disk).create(&name(), &Snapshot::of(&map, MAP)).expect("a folder"));
    write(&disk, FILES[2], &frames::segment(MAP, 1, &[record]));
    open(&disk)
}

fn open(disk: &SimulatedDisk) -> Result<OpenedMap, StoreError> {
    let opened = data_dir(disk).map(&name(), &OpeningProgress::default());
    opened.inspect_err(|error| {
        let clear = matches!(
            error,
            StoreError::Damaged { .. }
                | StoreError::JournalDamaged { .. }
                | StoreError::RevisionsMissing { .. }
                | StoreError::Foreign { .. }
        );
        assert!(clear, "{error}");
    })
}

fn data_dir(disk: &SimulatedDisk) -> DataDir {
    DataDir::on(Arc::new(disk.clone()), Path::new("data"), StoreSettings::default()).expect("a folder")
}

fn name() -> MapName {
    MapName::new("office").expect("a name")
}

fn path(file: &str) -> PathBuf {
    Path::new("data/maps").join(format!("office.{MAP}")).join(file)
}

fn read(disk: &SimulatedDisk, file: &str) -> Vec<u8> {
    // A damaged one was set aside, an empty one removed.
    disk.read(&path(file)).unwrap_or_default()
}

fn write(disk: &SimulatedDisk, file: &str, bytes: &[u8]) {
    let mut to = disk.create(&path(file)).expect("a file");
    to.append(bytes).expect("an append");
}
