//! Snapshot files in a map's folder: names, the newest readable one, and damaged ones.

use std::collections::BTreeMap;
use std::path::Path;

use uuid::Uuid;

use super::folder::{UNFINISHED, read_until};
use super::journal::{SEGMENT_HEADER_BYTES, first_revision, owner_of_segment};
use super::replacement::REPLACES;
use super::{FileSystem, OpeningProgress, Snapshot, StoreError, snapshot};
use crate::map::REVISION_MAX;
use crate::util::StopSignal;

/// Bytes that opening the map in `folder` will read: its newest snapshot, and the journal from there on.
pub(super) fn bytes_to_read(files: &dyn FileSystem, folder: &Path) -> Result<u64, StoreError> {
    let names = files.list(folder).map_err(StoreError::io(folder))?;
    let newest = names.iter().filter_map(|name| snapshot_revision(name)).max().unwrap_or_default();
    let segments: Vec<&String> = names.iter().filter(|name| first_revision(name).is_some()).collect();
    let first = segments.partition_point(|name| first_revision(name) <= Some(newest + 1)).saturating_sub(1);
    let snapshot = snapshot_name(newest);
    let needed = segments[first..].iter().copied().chain(names.iter().filter(|&name| *name == snapshot));
    needed.map(|name| files.size(&folder.join(name)).map_err(StoreError::io(folder.join(name)))).sum()
}

pub(super) fn snapshot_name(revision: u64) -> String {
    format!("snapshot-{revision:020}.mrol")
}

/// Suffix of the name of a file that was set aside because it cannot be read.
const SET_ASIDE: &str = ".damaged";

fn snapshot_revision(name: &str) -> Option<u64> {
    let revision = name.strip_prefix("snapshot-")?.strip_suffix(".mrol")?.parse().ok()?;
    (revision <= REVISION_MAX && snapshot_name(revision) == name).then_some(revision)
}

/// Revisions of the snapshots in `folder`, ascending.
pub(super) fn snapshot_revisions(files: &dyn FileSystem, folder: &Path) -> Result<Vec<u64>, StoreError> {
    let names = files.list(folder).map_err(StoreError::io(folder))?;
    Ok(names.iter().filter_map(|name| snapshot_revision(name)).collect())
}

pub(super) type Damaged = (u64, StoreError);

/// The newest readable snapshot of a folder.
pub(super) struct Newest {
    pub(super) snapshot: Snapshot,
    /// Head of the journal when it was written, or later.
    pub(super) head: u64,
    /// Newer snapshots that cannot be read.
    pub(super) damaged: Vec<Damaged>,
}

/// Finds the newest readable snapshot, and the newer ones that are not, which are removed from `revisions`.
pub(super) fn newest_good(
    files: &dyn FileSystem,
    folder: &Path,
    revisions: &mut Vec<u64>,
    progress: &OpeningProgress,
) -> Result<Newest, StoreError> {
    let is_cancelled = || progress.is_cancelled();
    let (stop, mut damaged) = (StopSignal::when(&is_cancelled), Vec::new());
    while let Some(&revision) = revisions.last() {
        let path = folder.join(snapshot_name(revision));
        let bytes = read_until(files, &path, stop)?;
        progress.read(bytes.len() as u64);
        match Snapshot::decode_own(&bytes, stop)? {
            Ok(snapshot) if snapshot.contents.revision == revision => {
                let head = snapshot::head_of(&bytes).unwrap_or_default().max(revision);
                return Ok(Newest { snapshot, head, damaged });
            }
            Ok(other) => {
                let reason = format!("it holds revision {}, not that of its name", other.contents.revision);
                damaged.push((revision, StoreError::damaged(&path, reason)));
            }
            Err(reason) => damaged.push((revision, StoreError::damaged(&path, reason))),
        }
        revisions.pop();
    }
    let none = || StoreError::damaged(folder, "no snapshot in it: restore one with `mrol restore`");
    Err(damaged.into_iter().next().map_or_else(none, |(_, error)| error))
}

/// Checks that every snapshot and segment in `folder` belongs to the map, as far as it can be read; damage is found
/// when the file is read. The snapshots of the revisions `read` were checked before.
///
/// # Errors
/// `Foreign` for a file of another map.
pub(super) fn check_owner(
    files: &dyn FileSystem,
    folder: &Path,
    uuid: Uuid,
    read: &[u64],
    progress: &OpeningProgress,
) -> Result<(), StoreError> {
    for name in files.list(folder).map_err(StoreError::io(folder))? {
        let path = folder.join(&name);
        let found = if first_revision(&name).is_some() {
            let header = files.read_start(&path, SEGMENT_HEADER_BYTES).map_err(StoreError::io(&path))?;
            owner_of_segment(&header)
        } else if snapshot_revision(&name).is_some_and(|revision| !read.contains(&revision)) {
            owner_of_snapshot(files, &path, uuid, progress)?
        } else {
            None
        };
        if let Some(found) = found.filter(|&found| found != uuid) {
            return Err(StoreError::Foreign { path, found, expected: uuid });
        }
    }
    Ok(())
}

/// The map that a snapshot belongs to. Where its header does not name `expected`, the whole file is read, since the
/// header may be damaged.
fn owner_of_snapshot(
    files: &dyn FileSystem,
    path: &Path,
    expected: Uuid,
    progress: &OpeningProgress,
) -> Result<Option<Uuid>, StoreError> {
    let header = files.read_start(path, snapshot::HEADER_BYTES).map_err(StoreError::io(path))?;
    if snapshot::uuid_in(&header) == Some(expected) {
        return Ok(Some(expected));
    }
    let is_cancelled = || progress.is_cancelled();
    let stop = StopSignal::when(&is_cancelled);
    let snapshot = Snapshot::decode_own(&read_until(files, path, stop)?, stop)?;
    Ok(snapshot.ok().map(|snapshot| snapshot.uuid))
}

/// Names in `folder` that are neither snapshots nor segments, nor set aside.
pub(super) fn not_understood(files: &dyn FileSystem, folder: &Path) -> Result<Vec<String>, StoreError> {
    let mut names = files.list(folder).map_err(StoreError::io(folder))?;
    names.retain(|name| {
        let is_ours = name.ends_with(SET_ASIDE) || name.starts_with(UNFINISHED) || name == REPLACES;
        !is_ours && snapshot_revision(name).is_none() && first_revision(name).is_none()
    });
    Ok(names)
}

/// Sizes of the snapshots and segments in a folder, bytes, by revision.
#[derive(Debug, Default)]
pub(super) struct Sizes {
    pub(super) snapshots: BTreeMap<u64, u64>,
    pub(super) segments: BTreeMap<u64, u64>,
}

impl Sizes {
    pub(super) fn of(files: &dyn FileSystem, folder: &Path) -> Result<Self, StoreError> {
        let mut sizes = Self::default();
        for name in files.list(folder).map_err(StoreError::io(folder))? {
            let size = || files.size(&folder.join(&name)).map_err(StoreError::io(folder.join(&name)));
            if let Some(revision) = snapshot_revision(&name) {
                sizes.snapshots.insert(revision, size()?);
            } else if let Some(first) = first_revision(&name) {
                sizes.segments.insert(first, size()?);
            }
        }
        Ok(sizes)
    }
}

/// Renames damaged snapshots so that they are no longer read.
pub(super) fn set_aside(
    files: &dyn FileSystem,
    folder: &Path,
    damaged: &[Damaged],
) -> Result<(), StoreError> {
    for (revision, _) in damaged {
        let path = folder.join(snapshot_name(*revision));
        files.rename(&path, &path.with_extension("mrol.damaged")).map_err(StoreError::io(&path))?;
    }
    files.sync(folder).map_err(StoreError::io(folder))
}

/// Removes snapshots from before `revision` that were set aside. Parts of journals stay until a person has looked at
/// them: they may hold what is nowhere else.
pub(super) fn forget_damaged(files: &dyn FileSystem, folder: &Path, revision: u64) -> Result<(), StoreError> {
    for name in set_aside_in(files, folder)? {
        let snapshot = name.strip_suffix(SET_ASIDE).and_then(snapshot_revision);
        if snapshot.is_some_and(|snapshot| snapshot < revision) {
            let path = folder.join(name);
            files.remove(&path).map_err(StoreError::io(&path))?;
        }
    }
    Ok(())
}

/// Names of the files in `folder` that were set aside.
pub(super) fn set_aside_in(files: &dyn FileSystem, folder: &Path) -> Result<Vec<String>, StoreError> {
    let mut names = files.list(folder).map_err(StoreError::io(folder))?;
    names.retain(|name| name.ends_with(SET_ASIDE));
    Ok(names)
}
