//! Snapshot files in a map's folder: names, the newest readable one, and damaged ones.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use uuid::Uuid;

use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder::{UNFINISHED, read_until};
use crate::journal::{SEGMENT_HEADER_BYTES, first_revision, owner_of_segment};
use crate::progress::OpeningProgress;
use crate::replacement::REPLACES;
use crate::snapshots::{self, Snapshot};
use crate::viewpoint_parts::{
    self, LoadedParts, PART_HEADER_BYTES, owner_of_part, part_names, part_number, uses_in,
};
use mrol_map::map::REVISION_MAX;
use mrol_map::util::StopSignal;

/// Bytes that opening the map in `folder` will read: its newest snapshot, the parts of its viewpoints, and the journal
/// from there on.
pub(crate) fn bytes_to_read(files: &dyn FileSystem, folder: &Path) -> Result<u64, StoreError> {
    let names = files.list(folder).map_err(StoreError::io(folder))?;
    let newest = names.iter().filter_map(|name| snapshot_revision(name)).max().unwrap_or_default();
    let segments: Vec<&String> = names.iter().filter(|name| first_revision(name).is_some()).collect();
    let first = segments.partition_point(|name| first_revision(name) <= Some(newest + 1)).saturating_sub(1);
    let snapshot = snapshot_name(newest);
    let is_read = |name: &&String| {
        **name == snapshot || part_number(name).is_some_and(|it| part_names(it)[0] == **name)
    };
    let needed = segments[first..].iter().copied().chain(names.iter().filter(is_read));
    needed.map(|name| files.size(&folder.join(name)).map_err(StoreError::io(folder.join(name)))).sum()
}

pub(crate) fn snapshot_name(revision: u64) -> String {
    format!("snapshot-{revision:020}.mrol")
}

/// Suffix of the name of a file that was set aside because it cannot be read.
const SET_ASIDE: &str = ".damaged";

fn snapshot_revision(name: &str) -> Option<u64> {
    let revision = name.strip_prefix("snapshot-")?.strip_suffix(".mrol")?.parse().ok()?;
    (revision <= REVISION_MAX && snapshot_name(revision) == name).then_some(revision)
}

/// Revisions of the snapshots in `folder`, ascending.
pub(crate) fn snapshot_revisions(files: &dyn FileSystem, folder: &Path) -> Result<Vec<u64>, StoreError> {
    let names = files.list(folder).map_err(StoreError::io(folder))?;
    Ok(names.iter().filter_map(|name| snapshot_revision(name)).collect())
}

pub(super) type Damaged = (u64, StoreError);

/// The newest readable snapshot of a folder, with its viewpoints.
pub(crate) struct Newest {
    pub(crate) snapshot: Snapshot,
    /// Head of the journal when it was written, or later.
    pub(super) head: u64,
    /// The parts that its viewpoints lie in, without these.
    pub(super) parts: LoadedParts,
    /// Newer snapshots that cannot be read.
    pub(super) damaged: Vec<Damaged>,
}

/// Finds the newest readable snapshot, and the newer ones that are not, which are removed from `revisions`.
pub(crate) fn newest_good(
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
            Ok((mut snapshot, uses)) if snapshot.contents.revision == revision => {
                let head = snapshots::head_of(&bytes).unwrap_or_default().max(revision);
                match viewpoint_parts::load(files, folder, snapshot.uuid, &uses, stop) {
                    Err(error @ StoreError::Damaged { .. }) => damaged.push((revision, error)),
                    Err(error) => return Err(error),
                    Ok(mut parts) => {
                        if !uses.is_empty() {
                            progress.read(viewpoint_parts::bytes_of(files, folder, &uses));
                            snapshot.contents.viewpoints = Arc::new(std::mem::take(&mut parts.viewpoints));
                        }
                        return Ok(Newest { snapshot, head, parts, damaged });
                    }
                }
            }
            Ok((other, _)) => {
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

/// Checks that every snapshot, segment and part of the viewpoints in `folder` belongs to the map, as far as it can be
/// read; damage is found when the file is read. The snapshots of the revisions `read` were checked before.
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
        } else if part_number(&name).is_some() {
            let header = files.read_start(&path, PART_HEADER_BYTES).map_err(StoreError::io(&path))?;
            owner_of_part(&header)
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
    let header = files.read_start(path, snapshots::HEADER_BYTES).map_err(StoreError::io(path))?;
    if snapshots::uuid_in(&header) == Some(expected) {
        return Ok(Some(expected));
    }
    let is_cancelled = || progress.is_cancelled();
    let stop = StopSignal::when(&is_cancelled);
    let snapshot = Snapshot::decode_own(&read_until(files, path, stop)?, stop)?;
    Ok(snapshot.ok().map(|(snapshot, _)| snapshot.uuid))
}

/// Names in `folder` that are neither snapshots, segments nor parts of the viewpoints, nor set aside.
pub(crate) fn not_understood(files: &dyn FileSystem, folder: &Path) -> Result<Vec<String>, StoreError> {
    let mut names = files.list(folder).map_err(StoreError::io(folder))?;
    names.retain(|name| {
        let is_ours = name.ends_with(SET_ASIDE) || name.starts_with(UNFINISHED) || name == REPLACES;
        let is_known =
            snapshot_revision(name).or_else(|| first_revision(name)).or_else(|| part_number(name)).is_some();
        !is_ours && !is_known
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

/// The parts in `folder` that no snapshot in it names, other than `kept`, by their numbers. Where a snapshot does not
/// tell, its start being damaged, every part may be needed.
pub(super) fn unneeded_parts(
    files: &dyn FileSystem,
    folder: &Path,
    kept: impl Iterator<Item = u64>,
) -> Result<Vec<u64>, StoreError> {
    let kept: BTreeSet<u64> = kept.collect();
    let mut there = viewpoint_parts::numbers_in(files, folder)?;
    there.retain(|number| !kept.contains(number));
    if there.is_empty() {
        return Ok(there);
    }
    for revision in snapshot_revisions(files, folder)? {
        let path = folder.join(snapshot_name(revision));
        let start = |bytes| files.read_start(&path, bytes).map_err(StoreError::io(&path));
        let Some(bytes) = snapshots::bytes_with_parts(&start(snapshots::HEADER_BYTES)?) else { continue };
        match snapshots::parts_in_start(&start(bytes)?).map(uses_in) {
            Some(Ok(uses)) => there.retain(|number| uses.iter().all(|used| used.number != *number)),
            Some(Err(_)) | None => return Ok(Vec::new()),
        }
    }
    Ok(there)
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
pub(crate) fn set_aside_in(files: &dyn FileSystem, folder: &Path) -> Result<Vec<String>, StoreError> {
    let mut names = files.list(folder).map_err(StoreError::io(folder))?;
    names.retain(|name| name.ends_with(SET_ASIDE));
    Ok(names)
}
