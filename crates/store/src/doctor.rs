//! Check of a data folder while no server uses it: reads every file, and checks that they agree.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use uuid::Uuid;

use super::entry::Entry;
use super::folder::FolderPath;
use super::journal::{self, Inspected};
use super::{
    DataDir, DataDirContents, FileSystem, OpeningProgress, Snapshot, StoreError, snapshot, snapshot_files,
    viewpoint_parts,
};
use mrol_map::map::{MapContents, MapName, MappedScan, MultiResolutionMap};
use mrol_map::util::StopSignal;

/// Findings about a map.
#[derive(Debug, Default)]
pub struct Diagnosis {
    /// Revisions of the readable snapshots, ascending.
    pub snapshots: Vec<u64>,
    /// Number of segments of the journal.
    pub segments: usize,
    /// Number of changes in the segments.
    pub records: u64,
    /// The revision that the files give; none without a readable snapshot.
    pub revision: Option<u64>,
    /// The last revision that the snapshots know to have been acknowledged.
    pub acknowledged: u64,
    /// Number of finest voxels at that revision.
    pub voxels: usize,
    /// Number of viewpoints at that revision.
    pub viewpoints: usize,
    /// Bytes that a crash left unfinished, which the next start cuts off: nothing acknowledged is among them.
    pub torn_bytes: u64,
    /// Files that were set aside because they cannot be read. Damaged snapshots are removed together with the snapshots
    /// of their age; parts of a journal stay until somebody removes them.
    pub set_aside: Vec<AsideFile>,
    /// Files in the folder that are not part of a map: harmless, but somebody put them there.
    pub not_understood: Vec<String>,
    /// Problems, a sentence each.
    pub problems: Vec<String>,
}

impl Diagnosis {
    fn of_problem(error: &StoreError) -> Self {
        Self { problems: vec![error.to_string()], ..Self::default() }
    }
}

/// A file that was set aside.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AsideFile {
    /// The file's name in the map's folder.
    pub name: String,
    /// The file's size, bytes.
    pub bytes: u64,
}

/// Result of [`set_aside`].
#[derive(Debug)]
pub struct SetAside {
    /// Where the damaged folder lies now.
    pub folder: PathBuf,
    /// Revision of the map that was made of what can be read.
    pub revision: u64,
    /// Keep-outs that this map has.
    pub keep_outs: usize,
    /// Viewpoints that this map has.
    pub viewpoints: usize,
}

/// Checks a map: reads every snapshot and every record, replays the journal from the oldest snapshot, and compares the
/// map with each snapshot on the way. Changes nothing.
///
/// # Errors
/// When the system refuses. Problems with the files are in the diagnosis.
pub fn diagnose(data_dir: &DataDir, name: &MapName) -> Result<Diagnosis, StoreError> {
    let files = data_dir.files();
    let path = match data_dir.path(name) {
        Ok(path) => path,
        Err(error @ StoreError::TwoFolders { .. }) => return Ok(Diagnosis::of_problem(&error)),
        Err(error) => return Err(error),
    };
    let mut diagnosis = Diagnosis {
        set_aside: aside_files(&**files, &path)?,
        not_understood: snapshot_files::not_understood(&**files, &path)?,
        ..Diagnosis::default()
    };
    let mut snapshots = read_snapshots(&**files, &path, &mut diagnosis)?;
    let Some(oldest) = snapshots.pop() else {
        diagnosis.problems.push(format!("{}: no snapshot can be read", path.display()));
        return Ok(diagnosis);
    };
    let uuid = match Entry::of_path(&path) {
        Entry::Map { uuid, .. } => uuid,
        _ => oldest.uuid,
    };
    let map = oldest.restore().map_err(|e| StoreError::damaged(&path, e.to_string()))?;
    let mut replay = Replay { map, snapshots, problems: Vec::new() };
    replay.read_journal(files, &path, uuid, &mut diagnosis)?;
    // Newer than the journal: nothing to compare them with, but the last of them is what a server would open.
    if let Some(newest) = replay.snapshots.into_iter().next() {
        replay.map = newest.restore().map_err(|e| StoreError::damaged(&path, e.to_string()))?;
    }
    diagnosis.problems.append(&mut replay.problems);
    let revision = replay.map.revision();
    (diagnosis.revision, diagnosis.voxels) = (Some(revision), replay.map.voxels(0));
    diagnosis.viewpoints = replay.map.viewpoints().len();
    if revision < diagnosis.acknowledged && diagnosis.problems.is_empty() {
        let acknowledged = diagnosis.acknowledged;
        let missing = StoreError::RevisionsMissing { folder: path, last: revision, acknowledged };
        diagnosis.problems.push(missing.to_string());
    }
    Ok(diagnosis)
}

fn aside_files(files: &dyn FileSystem, path: &Path) -> Result<Vec<AsideFile>, StoreError> {
    let file = |name: String| {
        let bytes = files.size(&path.join(&name)).map_err(StoreError::io(path.join(&name)))?;
        Ok(AsideFile { name, bytes })
    };
    snapshot_files::set_aside_in(files, path)?.into_iter().map(file).collect()
}

/// The snapshots that can be read, newest first.
fn read_snapshots(
    files: &dyn FileSystem,
    path: &Path,
    diagnosis: &mut Diagnosis,
) -> Result<Vec<Snapshot>, StoreError> {
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let expected = match Entry::of_path(path) {
        Entry::Map { uuid, .. } => Some(uuid),
        _ => None,
    };
    for revision in snapshot_files::snapshot_revisions(files, path)?.into_iter().rev() {
        let file = path.join(snapshot_files::snapshot_name(revision));
        let bytes = files.read(&file).map_err(StoreError::io(&file))?;
        let decoded = Snapshot::decode_own(&bytes, StopSignal::NEVER)?;
        match decoded.map_err(|reason| StoreError::damaged(&file, reason)) {
            Ok((snapshot, _)) if snapshot.contents.revision != revision => {
                let found = snapshot.contents.revision;
                diagnosis.problems.push(format!("{}: it holds revision {found}", file.display()));
            }
            Ok((snapshot, _))
                if expected
                    .or(snapshots.first().map(|newest| newest.uuid))
                    .is_some_and(|it| it != snapshot.uuid) =>
            {
                diagnosis.problems.push(format!("{}: another map's, by its uuid", file.display()));
            }
            Ok((mut snapshot, parts)) => {
                if !parts.is_empty() {
                    let note = |error: StoreError| diagnosis.problems.push(error.to_string());
                    let viewpoints = viewpoint_parts::load_readable(files, path, snapshot.uuid, &parts, note);
                    snapshot.contents.viewpoints = Arc::new(viewpoints);
                }
                let head = snapshot::head_of(&bytes).unwrap_or_default().max(revision);
                diagnosis.acknowledged = diagnosis.acknowledged.max(head);
                snapshots.push(snapshot);
            }
            Err(error @ StoreError::Damaged { .. }) => diagnosis.problems.push(error.to_string()),
            Err(error) => return Err(error),
        }
    }
    diagnosis.snapshots = snapshots.iter().rev().map(|snapshot| snapshot.contents.revision).collect();
    Ok(snapshots)
}

/// A map that is rebuilt from its oldest snapshot.
struct Replay {
    map: MultiResolutionMap,
    /// Snapshots that are not reached yet, newest first.
    snapshots: Vec<Snapshot>,
    problems: Vec<String>,
}

impl Replay {
    fn read_journal(
        &mut self,
        files: &Arc<dyn FileSystem>,
        path: &Path,
        uuid: Uuid,
        diagnosis: &mut Diagnosis,
    ) -> Result<(), StoreError> {
        let names = files.list(path).map_err(StoreError::io(path))?;
        let segments: Vec<u64> = names.iter().filter_map(|name| journal::first_revision(name)).collect();
        // A kill between the cut of the journal and the end of the snapshots before it leaves these: the journal may begin beyond them.
        let mut expected = segments.first().map_or(0, |&first| first.min(self.map.revision() + 1));
        for (i, &first) in segments.iter().enumerate() {
            if first != expected {
                self.gap(expected, first);
            }
            let folder = FolderPath::new(path.to_owned());
            let inspected = journal::inspect(files, &folder, uuid, first, |revision, change| {
                self.make(revision, &change)
            })?;
            let Inspected { next, torn_bytes, damage, .. } = inspected;
            diagnosis.segments += 1;
            diagnosis.records += next - first;
            if torn_bytes > 0 && i + 1 < segments.len() {
                self.problems.push(format!("the segment of revision {first} ends torn, and is not the last"));
            }
            diagnosis.torn_bytes += torn_bytes;
            self.problems.extend(damage.map(|error| error.to_string()));
            expected = next;
        }
        Ok(())
    }

    /// Notes that revisions are missing. Where a snapshot is beyond the gap, the replay continues from there, as a
    /// server would.
    fn gap(&mut self, expected: u64, first: u64) {
        while self.snapshots.last().is_some_and(|snapshot| snapshot.contents.revision < first) {
            if let Some(Ok(map)) = self.snapshots.pop().map(Snapshot::restore) {
                self.map = map;
            }
        }
        if self.map.revision() + 1 < first {
            self.problems
                .push(format!("the journal goes on at revision {first}, {expected} should come next"));
        }
    }

    fn make(&mut self, revision: u64, change: &mrol_map::map::Change) -> Result<(), String> {
        if revision <= self.map.revision() {
            return Ok(());
        }
        let next = self.map.revision() + 1;
        if revision != next {
            return Err(format!("it holds revision {revision}, {next} should come next"));
        }
        self.map.committer().apply(change);
        if let Some(snapshot) = self.snapshots.pop_if(|snapshot| snapshot.contents.revision == revision)
            && !is_made_by(&snapshot.contents, &self.map.contents())
        {
            self.problems.push(format!("the snapshot of revision {revision} is not what the journal makes"));
        }
        Ok(())
    }
}

/// True when the contents `written` of a snapshot agree with `made`, replayed from the journal. Poses beyond the undo
/// window were thinned before the snapshot was written, which the journal does not record; those that are left must be
/// among the replayed ones.
fn is_made_by(written: &MapContents, made: &MapContents) -> bool {
    let (revision, voxels, requests) = (&made.revision, &made.voxels, &made.requests);
    let same = (&written.revision, &written.voxels, &written.requests) == (revision, voxels, requests);
    let is_known = |pose: &MappedScan| made.trajectory.at(pose.revision) == Some(pose);
    let same = same && written.keep_outs == made.keep_outs;
    let same = same && written.viewpoints == made.viewpoints;
    same && written.moments == made.moments && written.trajectory.poses().all(is_known)
}

/// Makes a map of what can be read of one that cannot be opened, and sets the folder of that aside as it is. None where the
/// map can be opened.
///
/// The map begins anew, with a uuid of its own: its history goes on otherwise than that which clients may have seen.
///
/// # Errors
/// When the system refuses, or there is no snapshot that can be read.
pub fn set_aside(data_dir: &DataDir, name: &MapName) -> Result<Option<SetAside>, StoreError> {
    use StoreError::{Damaged, Foreign, JournalDamaged, RevisionsMissing};
    // An exchange that a crash interrupted may be that of an earlier call.
    data_dir.end_replacements(&mut DataDirContents::default())?;
    let refusal = match data_dir.map(name, &OpeningProgress::default()) {
        Ok(_) => return Ok(None),
        Err(error @ (Damaged { .. } | JournalDamaged { .. } | Foreign { .. } | RevisionsMissing { .. })) => {
            error
        }
        Err(error) => return Err(error),
    };
    let path = data_dir.path(name)?;
    let map = match readable(data_dir.files(), &path) {
        // It says which file is at fault.
        Err(Damaged { .. }) => return Err(refusal),
        map => map?,
    };
    let first = Snapshot::of(&map, Uuid::new_v4());
    let folder = data_dir.replace_damaged(name, &path, &first)?;
    let (revision, keep_outs) = (first.contents.revision, first.contents.keep_outs.len());
    let viewpoints = first.contents.viewpoints.len();
    Ok(Some(SetAside { folder, revision, keep_outs, viewpoints }))
}

/// The map that a folder still gives: that of the newest snapshot, and the changes after it up to what cannot be read.
fn readable(files: &Arc<dyn FileSystem>, path: &Path) -> Result<MultiResolutionMap, StoreError> {
    let mut found = Diagnosis::default();
    let newest = read_snapshots(&**files, path, &mut found)?.into_iter().next();
    let newest = newest.ok_or_else(|| StoreError::damaged(path, "no snapshot can be read"))?;
    let uuid = newest.uuid;
    let map = newest.restore().map_err(|e| StoreError::damaged(path, e.to_string()))?;
    let mut replay = Replay { map, snapshots: Vec::new(), problems: Vec::new() };
    replay.read_journal(files, path, uuid, &mut found)?;
    Ok(replay.map)
}

#[cfg(test)]
mod tests;
