//! The snapshots in a map's folder: their names, the newest good one, and damaged ones set aside.

use std::path::Path;

use super::journal::first_revision;
use super::{FileSystem, OpeningProgress, Snapshot, StoreError};
use crate::map::REVISION_MAX;

/// Bytes that opening the map in `folder` has to read: its newest snapshot, and the journal from there on.
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

/// What the name of a file ends with that was set aside, since it cannot be read.
const SET_ASIDE: &str = ".damaged";

fn snapshot_revision(name: &str) -> Option<u64> {
    name.strip_prefix("snapshot-")?
        .strip_suffix(".mrol")?
        .parse()
        .ok()
        .filter(|&revision| revision <= REVISION_MAX)
}

/// Revisions of the snapshots in `folder`, ascending.
pub(super) fn snapshot_revisions(files: &dyn FileSystem, folder: &Path) -> Result<Vec<u64>, StoreError> {
    let names = files.list(folder).map_err(StoreError::io(folder))?;
    Ok(names.iter().filter_map(|name| snapshot_revision(name)).collect())
}

pub(super) type Damaged = (u64, StoreError);

/// The newest snapshot that can be read, and the newer ones that cannot, which leave `revisions`.
pub(super) fn newest_good(
    files: &dyn FileSystem,
    folder: &Path,
    revisions: &mut Vec<u64>,
    progress: &OpeningProgress,
) -> Result<(Snapshot, Vec<Damaged>), StoreError> {
    let mut damaged = Vec::new();
    while let Some(&revision) = revisions.last() {
        let path = folder.join(snapshot_name(revision));
        progress.read(files.size(&path).map_err(StoreError::io(&path))?);
        match Snapshot::read(files, &path) {
            Ok(snapshot) if snapshot.contents.revision == revision => return Ok((snapshot, damaged)),
            Ok(other) => {
                let reason = format!("it holds revision {}, not that of its name", other.contents.revision);
                damaged.push((revision, StoreError::damaged(&path, reason)));
            }
            Err(error @ StoreError::Damaged { .. }) => damaged.push((revision, error)),
            Err(error) => return Err(error),
        }
        revisions.pop();
    }
    let none = || StoreError::damaged(folder, "no snapshot in it: restore one with `mrol restore`");
    Err(damaged.into_iter().next().map_or_else(none, |(_, error)| error))
}

/// Gives damaged snapshots names under which nobody looks for them.
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

/// Removes snapshots of before `revision` that were set aside. Parts of journals stay until somebody has looked at them:
/// they may hold what is nowhere else.
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

/// The names of the files in `folder` that were set aside.
pub(super) fn set_aside_in(files: &dyn FileSystem, folder: &Path) -> Result<Vec<String>, StoreError> {
    let mut names = files.list(folder).map_err(StoreError::io(folder))?;
    names.retain(|name| name.ends_with(SET_ASIDE));
    Ok(names)
}
