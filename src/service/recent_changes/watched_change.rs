//! A change as watches tell of it: without what only replaying needs.

use std::sync::OnceLock;

use crate::map::{Change, ContentHash, LevelChange, MappedScan, Region};
use crate::service::{BlockBytes, Cause, ChangePart, WatchForm};
use crate::voxel::{Lattice, VoxelSet};

/// Blocks of one message, at most: some 300 KB.
pub(in crate::service) const BLOCKS_PER_PART: usize = 4096;

/// A change as watches tell of it.
#[derive(Debug)]
pub(in crate::service) struct WatchedChange {
    pub(in crate::service) revision: u64,
    hash: Option<ContentHash>,
    cause: Cause,
    finest: Exchanged,
    /// Of the levels that somebody watched when it was made.
    levels: Vec<(u32, Exchanged)>,
}

/// Voxels that went, and voxels that came.
#[derive(Debug)]
struct Exchanged {
    removed: VoxelSet,
    added: VoxelSet,
    /// Both as they are sent, made once for all who are told of the whole.
    bytes: OnceLock<[BlockBytes; 2]>,
}

/// What is still to be told of a change.
#[derive(Debug, Clone)]
pub(in crate::service) struct ChangeParts {
    whole: ChangePart,
    is_over: bool,
}

impl WatchedChange {
    /// The change that made `revision`, after which the map has the hash, with what it did to levels.
    pub(in crate::service) fn of(
        revision: u64,
        hash: Option<ContentHash>,
        change: Change,
        levels: Vec<LevelChange>,
    ) -> Self {
        let (cause, removed, added) = match change {
            Change::Insertion(scan) => {
                let pose = MappedScan { carved_voxels: scan.carved.len(), ..scan.pose };
                (Cause::Scan(Box::new(pose.into())), scan.carved, scan.voxels)
            }
            Change::Deletion(deletion) => (Cause::Deletion, deletion.voxels, VoxelSet::default()),
            Change::Undo(undo) => {
                let cause = Cause::Undo { scans: undo.scans, deletions: undo.deletions };
                (cause, undo.removed, undo.restored)
            }
            Change::KeepOut(keep_out) => {
                (Cause::KeepOut(keep_out.change), VoxelSet::default(), VoxelSet::default())
            }
        };
        let levels = levels.into_iter().map(|of| (of.level, Exchanged::new(of.removed, of.added))).collect();
        Self { revision, hash, cause, finest: Exchanged::new(removed, added), levels }
    }

    /// Bytes of memory that it takes at most.
    pub(in crate::service) fn memory_bytes(&self) -> usize {
        let sets = std::iter::once(&self.finest).chain(self.levels.iter().map(|(_, of)| of));
        let of_cause = match &self.cause {
            Cause::Undo { scans, deletions } => (scans.len() + deletions.len()) * size_of::<u64>(),
            Cause::KeepOut(change) => change.corner_bytes(),
            Cause::Scan(_) | Cause::Deletion => 0,
        };
        size_of::<Self>() + of_cause + sets.map(Exchanged::memory_bytes).sum::<usize>()
    }

    /// The finest voxels that it touched: those that went, and those that came or were seen again.
    pub(in crate::service) fn touched(&self) -> [&VoxelSet; 2] {
        [&self.finest.removed, &self.finest.added]
    }

    /// Blocks of the finest voxels that went and came.
    pub(in crate::service) fn blocks(&self) -> usize {
        self.finest.removed.blocks().len() + self.finest.added.blocks().len()
    }

    /// True where it can be told in this form.
    pub(in crate::service) fn has(&self, form: WatchForm) -> bool {
        self.of_form(form).is_some()
    }

    fn of_form(&self, form: WatchForm) -> Option<(u32, &Exchanged)> {
        match form {
            WatchForm::Changes => Some((0, &self.finest)),
            WatchForm::Deltas { level } => {
                self.levels.iter().find(|(of, _)| *of == level).map(|(level, of)| (*level, of))
            }
        }
    }

    /// What there is to tell of it, of the part of the map in `region`; none where it cannot be told in this form.
    pub(in crate::service) fn parts(
        &self,
        form: WatchForm,
        region: Option<&Region>,
        lattice: &Lattice,
    ) -> Option<ChangeParts> {
        let (level, all) = self.of_form(form)?;
        let [removed, added] = match region {
            None => all.bytes().clone(),
            Some(region) => [&all.removed, &all.added]
                .map(|voxels| BlockBytes::of(voxels.part_in(region, lattice, level).blocks())),
        };
        let (revision, content_hash, cause) = (self.revision, self.hash, self.cause.clone());
        let whole = ChangePart { revision, is_last: false, content_hash, cause, removed, added };
        Some(ChangeParts { whole, is_over: false })
    }
}

impl Exchanged {
    fn new(removed: VoxelSet, added: VoxelSet) -> Self {
        Self { removed, added, bytes: OnceLock::new() }
    }

    fn bytes(&self) -> &[BlockBytes; 2] {
        self.bytes.get_or_init(|| [&self.removed, &self.added].map(|voxels| BlockBytes::of(voxels.blocks())))
    }

    /// As sets and as bytes.
    fn memory_bytes(&self) -> usize {
        2 * BlockBytes::OF_BLOCK * (self.removed.blocks().len() + self.added.blocks().len())
    }
}

impl Iterator for ChangeParts {
    type Item = ChangePart;

    fn next(&mut self) -> Option<ChangePart> {
        if self.is_over {
            return None;
        }
        let removed = self.whole.removed.split_to(BLOCKS_PER_PART);
        let added = self.whole.added.split_to(BLOCKS_PER_PART - removed.len());
        self.is_over = self.whole.removed.is_empty() && self.whole.added.is_empty();
        Some(ChangePart { is_last: self.is_over, removed, added, ..self.whole.clone() })
    }
}
