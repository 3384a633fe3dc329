//! A change as watches tell of it: without what only replaying needs.

use std::sync::OnceLock;

use bytes::Bytes;

use crate::request::{BlockBytes, Cause, ChangePart, LeftViewpoint, WatchForm};
use mrol_map::geometry::Pose;
use mrol_map::map::{Change, ContentHash, LevelChange, MappedScan, Region, ViewpointRecord};
use mrol_map::visibility::Viewpoint;
use mrol_map::voxel::{Lattice, VoxelSet};

/// Blocks of one message, at most: some 300 KB.
pub(crate) const BLOCKS_PER_PART: usize = 4096;

/// What somebody asked to be told of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Watched {
    pub(crate) form: WatchForm,
    /// The part of the map; everything without.
    pub(crate) region: Option<Region>,
    /// True where viewpoints are told.
    pub(crate) viewpoints: bool,
}

/// A change as watches tell of it.
#[derive(Debug)]
pub(crate) struct WatchedChange {
    pub(crate) revision: u64,
    pub(crate) hash: Option<ContentHash>,
    cause: Cause,
    viewpoint: Option<ToldViewpoint>,
    finest: Exchanged,
    /// Of the levels that somebody watched when it was made.
    levels: Vec<(u32, Exchanged)>,
}

/// The viewpoint that a scan left.
#[derive(Debug)]
struct ToldViewpoint {
    map_from_sensor: Pose,
    of_record: ViewpointRecord,
    /// As it is told, made once for all watchers.
    told: OnceLock<LeftViewpoint>,
}

/// Voxels that went, and voxels that came.
#[derive(Debug)]
struct Exchanged {
    removed: VoxelSet,
    added: VoxelSet,
    /// Both as they are sent, made once for all watchers of the whole map.
    bytes: OnceLock<[BlockBytes; 2]>,
}

/// What is still to be told of a change.
#[derive(Debug, Clone)]
pub(crate) struct ChangeParts {
    whole: ChangePart,
    is_over: bool,
}

impl WatchedChange {
    /// The change that made `revision`, after which the map has the hash, with what it did to levels.
    pub(crate) fn of(
        revision: u64,
        hash: Option<ContentHash>,
        change: Change,
        levels: Vec<LevelChange>,
    ) -> Self {
        let mut viewpoint = None;
        let (cause, removed, added) = match change {
            Change::Insertion(scan) => {
                let map_from_sensor = scan.pose.map_from_sensor;
                viewpoint = scan.viewpoint.map(|of_record| ToldViewpoint::new(map_from_sensor, of_record));
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
        Self { revision, hash, cause, viewpoint, finest: Exchanged::new(removed, added), levels }
    }

    /// Bytes of memory that it takes at most.
    pub(crate) fn memory_bytes(&self) -> usize {
        let sets = std::iter::once(&self.finest).chain(self.levels.iter().map(|(_, of)| of));
        let of_cause = match &self.cause {
            Cause::Undo { scans, deletions } => (scans.len() + deletions.len()) * size_of::<u64>(),
            Cause::KeepOut(change) => change.corner_bytes(),
            Cause::Scan(_) | Cause::Deletion => 0,
        };
        let of_viewpoint = self.viewpoint.as_ref().map_or(0, ToldViewpoint::memory_bytes);
        size_of::<Self>() + of_cause + of_viewpoint + sets.map(Exchanged::memory_bytes).sum::<usize>()
    }

    /// The finest voxels that it touched: those that went, and those that came or were seen again.
    pub(crate) fn touched(&self) -> [&VoxelSet; 2] {
        [&self.finest.removed, &self.finest.added]
    }

    /// Blocks of the finest voxels that went and came.
    pub(crate) fn blocks(&self) -> usize {
        self.finest.removed.blocks().len() + self.finest.added.blocks().len()
    }

    /// True of a scan that left a viewpoint.
    pub(crate) fn has_viewpoint(&self) -> bool {
        self.viewpoint.is_some()
    }

    /// True where it can be told in this form.
    pub(crate) fn has(&self, form: WatchForm) -> bool {
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

    /// The message for a watcher that asked for this; none where it cannot be told in its form.
    pub(crate) fn parts(&self, watched: &Watched, lattice: &Lattice) -> Option<ChangeParts> {
        let Watched { form, region, viewpoints } = watched;
        let (level, all) = self.of_form(*form)?;
        let [removed, added] = match region {
            None => all.bytes().clone(),
            Some(region) => [&all.removed, &all.added]
                .map(|voxels| BlockBytes::of(voxels.part_in(region, lattice, level).blocks())),
        };
        let (revision, content_hash, cause) = (self.revision, self.hash, self.cause.clone());
        let viewpoint = self.viewpoint.as_ref().filter(|_| *viewpoints);
        let viewpoint = viewpoint.map(|viewpoint| viewpoint.told_of(region.as_ref()));
        let whole = ChangePart { revision, is_last: false, content_hash, cause, removed, added, viewpoint };
        Some(ChangeParts { whole, is_over: false })
    }
}

impl ToldViewpoint {
    fn new(map_from_sensor: Pose, of_record: ViewpointRecord) -> Self {
        Self { map_from_sensor, of_record, told: OnceLock::new() }
    }

    /// The message for watchers of `region`, or of everything.
    fn told_of(&self, region: Option<&Region>) -> LeftViewpoint {
        let told = self.told.get_or_init(|| LeftViewpoint {
            image: self.of_record.image.to_bytes().into(),
            displaced: self.of_record.displaced.clone(),
        });
        let viewpoint = || Viewpoint::new(self.map_from_sensor, self.of_record.image.clone());
        match region.is_none_or(|region| has_looked_into(&viewpoint(), region)) {
            true => told.clone(),
            false => LeftViewpoint { image: Bytes::new(), ..told.clone() },
        }
    }

    /// Bytes of memory that it takes at most.
    fn memory_bytes(&self) -> usize {
        let ViewpointRecord { image, displaced } = &self.of_record;
        let of_displaced = 2 * displaced.len() * size_of::<u64>();
        image.memory_bytes() + image.stored_bytes() + of_displaced
    }
}

/// True where a viewpoint may have seen a point of a region, or one near it.
pub(crate) fn has_looked_into(viewpoint: &Viewpoint, region: &Region) -> bool {
    viewpoint.boxes_m().any(|[min_m, max_m]| {
        let center_m = std::array::from_fn(|axis| (min_m[axis] + max_m[axis]) / 2.0);
        let half_m = (0..3).map(|axis| ((max_m[axis] - min_m[axis]) / 2.0).powi(2)).sum::<f64>().sqrt();
        region.distance_m(center_m) <= half_m
    })
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
        let viewpoint = self.whole.viewpoint.take_if(|_| self.is_over);
        Some(ChangePart { is_last: self.is_over, removed, added, viewpoint, ..self.whole.clone() })
    }
}
