//! Where a map's folder keeps the viewpoints of its scans: in parts, so that a snapshot does not write all of them again.
//!
//! ```text
//! office.UUID/viewpoints-00000000000000000001.part    those of the scans up to the first snapshot
//! office.UUID/viewpoints-00000000000000000001.copy    the same once more
//! office.UUID/viewpoints-00000000000000000002.part    those since
//! office.UUID/viewpoints-00000000000000000002.copy
//! office.UUID/snapshot-00000000000000004711.mrol      names parts, and which viewpoints of each the map has
//! ```
//!
//! A part is written once, before the snapshot that first names it, under a number that no part had before; it goes when no
//! snapshot names it any more. Viewpoints that went stay in their part until most of it is of no use; what is left of it is
//! then written again with those that are new. So are small parts, so that there are few.
//!
//! Each part has a copy. Snapshots stand in for each other where one is damaged, but they share their parts: without a copy one
//! bad sector of an old part would keep the map from being opened.

mod file;
mod uses;

pub(super) use file::{PART_HEADER_BYTES, owner_of_part, part_names, part_number};
pub(super) use uses::{PartUse, section_of, uses_in};

use std::path::Path;

use uuid::Uuid;

use super::{FileSystem, StoreError, folder};
use file::ViewpointPart;
use mrol_map::util::StopSignal;
use mrol_map::visibility::ViewpointSet;

/// Bytes of images of a part from which on it is large: it is not written again for being small.
const LARGE_PART_BYTES: u64 = 4 << 20;

/// The parts that the newest snapshot of a map's folder names, and what is in them.
#[derive(Debug, Default)]
pub(super) struct ViewpointParts {
    parts: Vec<KnownPart>,
    /// The largest number that a part of the folder ever had.
    last_number: u64,
}

/// A part that lies in the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct KnownPart {
    number: u64,
    checksum: u32,
    /// Revisions and bytes of the images of all that is in it, ascending.
    stored: Vec<(u64, u32)>,
}

/// What is to be written so that a snapshot has its viewpoints in parts.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct PartsPlan {
    /// Parts that the snapshot names, with the revisions of what it has of each.
    kept: Vec<(KnownPart, Vec<u64>)>,
    /// Number of the part to write, and the revisions of what is in it; none where everything is in the others.
    new: Option<(u64, Vec<u64>)>,
}

impl ViewpointParts {
    /// The parts of a folder where the largest number of any is `last_number`, and the newest snapshot names `parts`.
    pub(super) fn new(parts: Vec<KnownPart>, last_number: u64) -> Self {
        Self { parts, last_number }
    }

    /// How a snapshot with `viewpoints` is to be written.
    pub(super) fn plan(&self, viewpoints: &ViewpointSet) -> PartsPlan {
        let is_known = |revision: u64| self.parts.iter().any(|part| part.has(revision));
        let bytes_of =
            |revision: u64| viewpoints.get(revision).map_or(0, |it| it.image().stored_bytes() as u64);
        let mut new: Vec<u64> =
            viewpoints.iter().map(|(revision, _)| revision).filter(|it| !is_known(*it)).collect();
        let has_new = !new.is_empty();
        let mut bytes: u64 = new.iter().map(|revision| bytes_of(*revision)).sum();
        let mut kept = Vec::new();
        // The newest first: a part is written again where as much comes with it, so that each viewpoint is written again a few
        // times at most before it lies in a large part.
        for part in self.parts.iter().rev() {
            let used: Vec<u64> =
                part.revisions().filter(|revision| viewpoints.get(*revision).is_some()).collect();
            let used_bytes: u64 = used.iter().map(|revision| bytes_of(*revision)).sum();
            let is_small = has_new && used_bytes <= bytes && used_bytes < LARGE_PART_BYTES;
            if is_small || used_bytes * 2 < part.bytes() {
                bytes += used_bytes;
                new.extend(used);
            } else {
                kept.push((part.clone(), used));
            }
        }
        kept.reverse();
        new.sort_unstable();
        PartsPlan { kept, new: (!new.is_empty()).then_some((self.last_number + 1, new)) }
    }

    /// Notes that the part of a plan is being written: its number is used up, whether that succeeds or not.
    pub(super) fn use_up_number(&mut self, plan: &PartsPlan) {
        self.last_number = plan.new.as_ref().map_or(self.last_number, |(number, _)| *number);
    }

    /// Notes that the snapshot of a plan was written; `written` is its new part.
    pub(super) fn tell_written(&mut self, plan: PartsPlan, written: Option<KnownPart>) {
        self.parts = plan.kept.into_iter().map(|(part, _)| part).chain(written).collect();
    }

    /// The numbers of the parts.
    pub(super) fn numbers(&self) -> impl Iterator<Item = u64> {
        self.parts.iter().map(|part| part.number)
    }
}

impl KnownPart {
    /// The part `number` of that content.
    pub(super) fn of(number: u64, part: &ViewpointPart) -> Self {
        let stored = part.viewpoints.iter();
        let stored = stored.map(|(revision, it)| (*revision, it.image().stored_bytes() as u32)).collect();
        Self { number, checksum: part.checksum, stored }
    }

    pub(super) fn number(&self) -> u64 {
        self.number
    }

    fn has(&self, revision: u64) -> bool {
        self.stored.binary_search_by_key(&revision, |(revision, _)| *revision).is_ok()
    }

    fn revisions(&self) -> impl Iterator<Item = u64> {
        self.stored.iter().map(|(revision, _)| *revision)
    }

    fn bytes(&self) -> u64 {
        self.stored.iter().map(|(_, bytes)| u64::from(*bytes)).sum()
    }
}

impl PartsPlan {
    /// The file of the part to write, of the map `uuid`, with what will be known of it.
    ///
    /// # Errors
    /// When compression fails, for want of memory.
    pub(super) fn new_part(
        &self,
        viewpoints: &ViewpointSet,
        uuid: Uuid,
    ) -> std::io::Result<Option<(KnownPart, Vec<u8>)>> {
        let Some((number, revisions)) = &self.new else { return Ok(None) };
        let of_revision = |revision: &u64| Some((*revision, viewpoints.get(*revision)?.clone()));
        let part = ViewpointPart::new(revisions.iter().filter_map(of_revision).collect());
        let (part, bytes) = part.encode(uuid)?;
        Ok(Some((KnownPart::of(*number, &part), bytes)))
    }

    /// What the snapshot says of its parts, where `written` is the new one.
    pub(super) fn uses(&self, written: Option<&KnownPart>) -> Vec<PartUse> {
        let of = |part: &KnownPart, revisions: Vec<u64>| PartUse {
            number: part.number,
            checksum: part.checksum,
            revisions,
        };
        let kept = self.kept.iter().filter(|(_, used)| !used.is_empty());
        let kept = kept.map(|(part, used)| of(part, used.clone()));
        kept.chain(written.map(|part| of(part, part.revisions().collect()))).collect()
    }
}

/// The viewpoints of a snapshot.
#[derive(Debug, Default)]
pub(super) struct LoadedParts {
    pub(super) viewpoints: ViewpointSet,
    /// Parts that are well.
    pub(super) known: Vec<KnownPart>,
    /// Parts of which only the copy can be read: the next snapshot writes what is in them again.
    pub(super) damaged: Vec<StoreError>,
}

/// Reads the viewpoints of a snapshot of the map `uuid` from the parts that it names in `folder`.
///
/// # Errors
/// `Damaged` or `Foreign` for a part that cannot be read and has no copy that can; when the system refuses.
pub(super) fn load(
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
pub(super) fn load_readable(
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
pub(super) fn bytes_of(files: &dyn FileSystem, folder: &Path, uses: &[PartUse]) -> u64 {
    let names = uses.iter().map(|used| part_names(used.number)[0].clone());
    names.filter_map(|name| files.size(&folder.join(name)).ok()).sum()
}

/// Numbers of the parts in `folder`, ascending.
pub(super) fn numbers_in(files: &dyn FileSystem, folder: &Path) -> Result<Vec<u64>, StoreError> {
    let names = files.list(folder).map_err(StoreError::io(folder))?;
    let mut numbers: Vec<u64> = names.iter().filter_map(|name| part_number(name)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    Ok(numbers)
}

#[cfg(test)]
mod tests;
