//! How the viewpoints of the next snapshot are written: which parts are kept, and which is new.

use uuid::Uuid;

use super::file::ViewpointPart;
use super::known_part::KnownPart;
use super::uses::PartUse;
use mrol_map::visibility::ViewpointSet;

/// Bytes of images of a part from which on it is large: it is not written again for being small.
const LARGE_PART_BYTES: u64 = 4 << 20;

/// The parts that the newest snapshot of a map's folder names, and what is in them.
#[derive(Debug, Default)]
pub(crate) struct ViewpointParts {
    pub(crate) parts: Vec<KnownPart>,
    /// The largest number that a part of the folder ever had.
    last_number: u64,
}

/// What is to be written so that a snapshot has its viewpoints in parts.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct PartsPlan {
    /// Parts that the snapshot names, with the revisions of what it has of each.
    kept: Vec<(KnownPart, Vec<u64>)>,
    /// Number of the part to write, and the revisions of what is in it; none where everything is in the others.
    new: Option<(u64, Vec<u64>)>,
}

impl ViewpointParts {
    /// The parts of a folder where the largest number of any is `last_number`, and the newest snapshot names `parts`.
    pub(crate) fn new(parts: Vec<KnownPart>, last_number: u64) -> Self {
        Self { parts, last_number }
    }

    /// How a snapshot with `viewpoints` is to be written.
    pub(crate) fn plan(&self, viewpoints: &ViewpointSet) -> PartsPlan {
        let is_known = |revision: u64| self.parts.iter().any(|part| part.has(revision));
        let bytes_of =
            |revision: u64| viewpoints.get(revision).map_or(0, |it| it.image().stored_bytes() as u64);
        let mut new: Vec<u64> =
            viewpoints.iter().map(|(revision, _)| revision).filter(|it| !is_known(*it)).collect();
        let has_new = !new.is_empty();
        let mut bytes: u64 = new.iter().map(|revision| bytes_of(*revision)).sum();
        let mut kept = Vec::new();
        // The newest first: a part is written again where as much comes with it, so that each viewpoint is written
        // again a few times at most before it lies in a large part.
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
    pub(crate) fn use_up_number(&mut self, plan: &PartsPlan) {
        self.last_number = plan.new.as_ref().map_or(self.last_number, |(number, _)| *number);
    }

    /// Notes that the snapshot of a plan was written; `written` is its new part.
    pub(crate) fn note_written(&mut self, plan: PartsPlan, written: Option<KnownPart>) {
        self.parts = plan.kept.into_iter().map(|(part, _)| part).chain(written).collect();
    }

    /// The numbers of the parts.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = u64> {
        self.parts.iter().map(|part| part.number)
    }
}

impl PartsPlan {
    /// The file of the part to write, of the map `uuid`, with what will be known of it.
    ///
    /// # Errors
    /// When compression fails, for want of memory.
    pub(crate) fn new_part(
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
    pub(crate) fn uses(&self, written: Option<&KnownPart>) -> Vec<PartUse> {
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
