//! The replay of a map's journal from a snapshot, compared with the snapshots on the way.

use std::path::Path;
use std::sync::Arc;

use uuid::Uuid;

use super::diagnosis::Diagnosis;
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder::FolderPath;
use crate::journal::{self, Inspected};
use crate::snapshots::Snapshot;
use mrol_map::map::{MapContents, MappedScan, MultiResolutionMap};

/// A map that is rebuilt from its oldest snapshot.
pub(super) struct Replay {
    pub(super) map: MultiResolutionMap,
    /// Snapshots that are not reached yet, newest first.
    pub(super) snapshots: Vec<Snapshot>,
    pub(super) problems: Vec<String>,
}

impl Replay {
    pub(super) fn read_journal(
        &mut self,
        files: &Arc<dyn FileSystem>,
        path: &Path,
        uuid: Uuid,
        diagnosis: &mut Diagnosis,
    ) -> Result<(), StoreError> {
        let names = files.list(path).map_err(StoreError::io(path))?;
        let segments: Vec<u64> = names.iter().filter_map(|name| journal::first_revision(name)).collect();
        // A kill between the cut of the journal and the end of the snapshots before it leaves these: the journal may
        // begin beyond them.
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
