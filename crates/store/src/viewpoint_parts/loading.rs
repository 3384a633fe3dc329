//! The viewpoints of a snapshot, read from the parts that it names.

use std::path::Path;

use uuid::Uuid;

use super::file::{ViewpointPart, part_names, part_number};
use super::known_part::KnownPart;
use super::uses::PartUse;
use crate::error::StoreError;
use crate::file_system::FileSystem;
use crate::folder;
use mrol_map::util::StopSignal;
use mrol_map::visibility::ViewpointSet;

/// The viewpoints of a snapshot.
#[derive(Debug, Default)]
pub(crate) struct LoadedParts {
    pub(crate) viewpoints: ViewpointSet,
    /// Parts that are well.
    pub(crate) known: Vec<KnownPart>,
    /// Parts of which only the copy can be read: the next snapshot writes what is in them again.
    pub(crate) damaged: Vec<StoreError>,
}

/// Reads the viewpoints of a snapshot of the map `uuid` from the parts that it names in `folder`.
///
/// # Errors
/// `Damaged` or `Foreign` for a part that cannot be read and has no copy that can; when the system refuses.
pub(crate) fn load(
    files: &dyn FileSystem,
    folder: &Path,
    uuid: Uuid,
    uses: &[PartUse],
    stop: StopSignal<'_>,
) -> Result<LoadedParts, StoreError> {
    let mut loaded = LoadedParts::default();
    for used in uses {
        let [path, copy] = part_names(used.number).map(|name| folder.join(name));
        let part = match read(files, &path, uuid, used, stop) {
            // Whatever is wrong with one, its sectors or its bytes, the other may be well.
            Err(error @ (StoreError::Damaged { .. } | StoreError::Io { .. })) => {
                let Ok(part) = read(files, &copy, uuid, used, stop) else { return Err(error) };
                loaded.damaged.push(error);
                part
            }
            part => {
                let part = part?;
                loaded.known.push(KnownPart::of(used.number, &part));
                part
            }
        };
        let is_used = |revision: &u64| used.revisions.binary_search(revision).is_ok();
        loaded.viewpoints.extend(part.viewpoints.into_iter().filter(|(revision, _)| is_used(revision)));
    }
    Ok(loaded)
}

/// [`load`], without the parts that cannot be read; `note` is told of every file that is damaged, copies with them.
pub(crate) fn load_readable(
    files: &dyn FileSystem,
    folder: &Path,
    uuid: Uuid,
    uses: &[PartUse],
    mut note: impl FnMut(StoreError),
) -> ViewpointSet {
    let mut viewpoints = ViewpointSet::default();
    for used in uses {
        match load(files, folder, uuid, std::slice::from_ref(used), StopSignal::NEVER) {
            Ok(LoadedParts { viewpoints: of_part, damaged, .. }) => {
                viewpoints.extend(of_part.iter().map(|(revision, it)| (revision, it.clone())));
                damaged.into_iter().for_each(&mut note);
            }
            Err(error) => note(error),
        }
        let [_, copy] = part_names(used.number).map(|name| folder.join(name));
        if let Err(error) = read(files, &copy, uuid, used, StopSignal::NEVER) {
            note(error);
        }
    }
    viewpoints
}

/// Reads the part that a snapshot means from the file at `path`.
fn read(
    files: &dyn FileSystem,
    path: &Path,
    uuid: Uuid,
    used: &PartUse,
    stop: StopSignal<'_>,
) -> Result<ViewpointPart, StoreError> {
    let bytes = match folder::read_until(files, path, stop) {
        Err(StoreError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            return Err(StoreError::damaged(path, "a snapshot names it, and it is missing"));
        }
        bytes => bytes?,
    };
    let part = ViewpointPart::decode(&bytes, stop);
    if stop.is_stopped() {
        return Err(StoreError::Cancelled);
    }
    let (found, part) = part.map_err(|reason| StoreError::damaged(path, reason))?;
    if found != uuid {
        return Err(StoreError::Foreign { path: path.to_owned(), found, expected: uuid });
    }
    if part.checksum != used.checksum {
        let reason = format!("checksum {:08x}, a snapshot says {:08x}", part.checksum, used.checksum);
        return Err(StoreError::damaged(path, reason));
    }
    let known = KnownPart::of(used.number, &part);
    match used.revisions.iter().find(|revision| !known.has(**revision)) {
        None => Ok(part),
        Some(missing) => {
            let reason = format!("it has no viewpoint of revision {missing}, which a snapshot names");
            Err(StoreError::damaged(path, reason))
        }
    }
}

/// Bytes of the files of parts; those that cannot be read count 0.
pub(crate) fn bytes_of(files: &dyn FileSystem, folder: &Path, uses: &[PartUse]) -> u64 {
    let names = uses.iter().map(|used| part_names(used.number)[0].clone());
    names.filter_map(|name| files.size(&folder.join(name)).ok()).sum()
}

/// Numbers of the parts in `folder`, ascending.
pub(crate) fn numbers_in(files: &dyn FileSystem, folder: &Path) -> Result<Vec<u64>, StoreError> {
    let names = files.list(folder).map_err(StoreError::io(folder))?;
    let mut numbers: Vec<u64> = names.iter().filter_map(|name| part_number(name)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    Ok(numbers)
}
