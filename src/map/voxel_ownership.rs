//! Which voxels would not be there without certain scans.

use std::collections::BTreeSet;

use hashbrown::HashMap;

use super::{Change, MapContents, ScanRecord, WithdrawnScan};
use crate::util::StopSignal;
use crate::voxel::{BlockMask, MomentSet, Moments, VoxelKey, VoxelSet};

/// Who holds each voxel that scans which are to be undone, the targets, have touched: they, others, or both.
///
/// A scan holds the voxels that it touched, until a deletion takes them from everybody or the scan is undone; a
/// voxel is occupied as long as somebody holds it. So a map without certain scans follows from its changes: it is
/// what replaying them without those scans would give, with the deletions as they were.
///
/// VoxelOwnership are made in this order: each target is [touched](VoxelOwnership::touch), so that nothing else need be
/// remembered; the [base](VoxelOwnership::begin) and every change after it, the targets among them, are
/// [observed](VoxelOwnership::observe); what leaves with the targets is [found out](VoxelOwnership::leaving); and what is
/// observed after that [renews](VoxelOwnership::renew) it. They take memory by what the targets touched, whatever else
/// the map held.
#[derive(Debug)]
pub struct VoxelOwnership {
    /// By revision, ascending.
    targets: Vec<u64>,
    /// Scans that hold nothing any more, ascending.
    withdrawn: Vec<u64>,
    /// Blocks that the targets touched.
    blocks: HashMap<VoxelKey, Holders>,
    /// Voxels whose moments the targets changed, as they are without them.
    moments: HashMap<VoxelKey, Moments>,
    /// What of both changed since it was found out what leaves.
    since: Option<Since>,
}

/// Who holds which voxels of a block.
#[derive(Debug, Clone, Copy)]
struct Holders {
    targets: BlockMask,
    others: BlockMask,
}

#[derive(Debug, Default)]
struct Since {
    blocks: BTreeSet<VoxelKey>,
    moments: BTreeSet<VoxelKey>,
}

/// What leaves a map with the scans that are undone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leaving {
    /// The voxels that nobody but the targets holds.
    pub voxels: VoxelSet,
    /// The moments of all voxels that the targets touched, as they are without them: what they were, and of no points where
    /// nothing is left.
    pub moments: MomentSet,
}

/// Entries that are looked at between two looks at the stop signal.
const ENTRIES_PER_LOOK: usize = 16 << 10;

impl VoxelOwnership {
    /// The ownership of scans that are to be undone, by revision; those of `withdrawn` hold nothing any more.
    pub fn of(mut targets: Vec<u64>, withdrawn: &[WithdrawnScan]) -> Self {
        targets.sort_unstable();
        let mut withdrawn: Vec<u64> = withdrawn.iter().map(|withdrawn| withdrawn.scan).collect();
        withdrawn.sort_unstable();
        Self { targets, withdrawn, blocks: HashMap::new(), moments: HashMap::new(), since: None }
    }

    /// Bytes of memory that touching `target` takes at most: an entry of each of its blocks and voxels with moments, in
    /// tables that grow to twice their size beside the old ones.
    pub fn bytes_of(target: &ScanRecord) -> usize {
        const OF_BLOCK: usize = 4 * size_of::<(VoxelKey, Holders)>();
        const OF_MOMENTS: usize = 4 * size_of::<(VoxelKey, Moments)>();
        target.voxels.blocks().len() * OF_BLOCK + target.moments.as_slice().len() * OF_MOMENTS
    }

    /// Bytes of memory that finding out what leaves takes at most: it, once more while it is renewed, and what is noted
    /// meanwhile.
    pub fn leaving_bytes(&self) -> usize {
        const OF_BLOCK: usize = 2 * size_of::<(VoxelKey, BlockMask)>() + 2 * size_of::<VoxelKey>();
        const OF_MOMENTS: usize = 2 * size_of::<(VoxelKey, Moments)>() + 2 * size_of::<VoxelKey>();
        self.blocks.len() * OF_BLOCK + self.moments.len() * OF_MOMENTS
    }

    /// Takes note of what a target touches.
    pub fn touch(&mut self, target: &ScanRecord) {
        let nobody = Holders { targets: BlockMask::EMPTY, others: BlockMask::EMPTY };
        for (block, _) in target.voxels.blocks() {
            self.blocks.entry(*block).or_insert(nobody);
        }
        for (voxel, _) in target.moments.as_slice() {
            self.moments.entry(*voxel).or_default();
        }
    }

    /// Begins with `base`, what the map held at a revision before that of any target; its holders are others. False once
    /// stopped. No scan may lie before the base and be withdrawn after it.
    pub fn begin(&mut self, base: &MapContents, stop: StopSignal<'_>) -> bool {
        for (block, mask) in stop.pieces(base.voxels.blocks(), ENTRIES_PER_LOOK).flatten() {
            if let Some(holders) = self.blocks.get_mut(block) {
                holders.others = *mask;
            }
        }
        for (voxel, moments) in stop.pieces(base.moments.as_slice(), ENTRIES_PER_LOOK).flatten() {
            if let Some(without) = self.moments.get_mut(voxel) {
                *without = *moments;
            }
        }
        !stop.is_stopped()
    }

    /// Takes note of the next change after the base.
    pub fn observe(&mut self, revision: u64, change: &Change) {
        match change {
            Change::Insertion(_) if self.withdrawn.binary_search(&revision).is_ok() => {}
            Change::Insertion(scan) => self.observe_scan(scan, self.targets.binary_search(&revision).is_ok()),
            Change::Deletion(deletion) => self.observe_deletion(&deletion.voxels),
            // The scans that it took out were passed over where they went in.
            Change::Undo(_) => {}
        }
    }

    fn observe_scan(&mut self, scan: &ScanRecord, is_target: bool) {
        for (block, mask) in scan.voxels.blocks() {
            let Some(holders) = self.blocks.get_mut(block) else { continue };
            let of = if is_target { &mut holders.targets } else { &mut holders.others };
            *of = of.union(mask);
            self.since.iter_mut().for_each(|since| since.blocks.extend([*block]));
        }
        for &(voxel, moments) in scan.moments.as_slice().iter().filter(|_| !is_target) {
            let Some(without) = self.moments.get_mut(&voxel) else { continue };
            *without += moments;
            self.since.iter_mut().for_each(|since| since.moments.extend([voxel]));
        }
    }

    fn observe_deletion(&mut self, voxels: &VoxelSet) {
        for (block, mask) in voxels.blocks() {
            let Some(holders) = self.blocks.get_mut(block) else { continue };
            let before = holders.others;
            holders.targets = holders.targets.difference(mask);
            holders.others = before.difference(mask);
            self.since.iter_mut().for_each(|since| since.blocks.extend([*block]));
            for (voxel, rebuilt) in holders.others.rebuilt_moments(&before, *block) {
                let Some(without) = self.moments.get_mut(&voxel) else { continue };
                *without = rebuilt;
                self.since.iter_mut().for_each(|since| since.moments.extend([voxel]));
            }
        }
    }

    /// What leaves with the targets; none once stopped. What is observed afterwards is noted, for
    /// [`VoxelOwnership::renew`].
    pub fn leaving(&mut self, stop: StopSignal<'_>) -> Option<Leaving> {
        let blocks = stop.paced(&self.blocks, ENTRIES_PER_LOOK);
        let blocks = blocks.map(|(&block, holders)| (block, holders.targets_alone())).collect();
        let moments = stop.paced(&self.moments, ENTRIES_PER_LOOK).map(|(&voxel, without)| (voxel, *without));
        let moments = MomentSet::of_voxels_until(moments.collect(), stop);
        let leaving = Leaving { voxels: VoxelSet::of_blocks_until(blocks, stop), moments };
        self.since = Some(Since::default());
        (!stop.is_stopped()).then_some(leaving)
    }

    /// Makes what left with the targets what leaves now; true where that may be something else. It takes as long as what was
    /// observed since, and where that was something, a copy.
    pub fn renew(&self, voxels: &mut VoxelSet, moments: &mut MomentSet) -> bool {
        let Some(since) = self.since.as_ref().filter(|since| !since.is_empty()) else { return false };
        let changed = |block: &VoxelKey| Some((*block, self.blocks.get(block)?.targets_alone()));
        *voxels = merged(voxels.blocks(), since.blocks.iter().filter_map(changed)).collect();
        let changed = |voxel: &VoxelKey| Some((*voxel, *self.moments.get(voxel)?));
        *moments = merged(moments.as_slice(), since.moments.iter().filter_map(changed)).collect();
        true
    }

    /// The scans that are to be undone, by revision, ascending.
    pub fn targets(&self) -> &[u64] {
        &self.targets
    }
}

impl Since {
    fn is_empty(&self) -> bool {
        self.blocks.is_empty() && self.moments.is_empty()
    }
}

impl Holders {
    fn targets_alone(&self) -> BlockMask {
        self.targets.difference(&self.others)
    }
}

/// Both in ascending order of their keys; where both have a key, the newer value.
fn merged<T: Copy>(
    older: &[(VoxelKey, T)],
    newer: impl Iterator<Item = (VoxelKey, T)>,
) -> impl Iterator<Item = (VoxelKey, T)> {
    let (mut older, mut newer) = (older.iter().copied().peekable(), newer.peekable());
    std::iter::from_fn(move || match (older.peek(), newer.peek()) {
        (Some((one, _)), Some((other, _))) if one == other => {
            older.next();
            newer.next()
        }
        (Some((one, _)), Some((other, _))) if one < other => older.next(),
        (Some(_), None) => older.next(),
        _ => newer.next(),
    })
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::geometry::{Point, Pose};
    use crate::map::{DeletionRecord, MappedScan, RobotName};
    use crate::voxel::Lattice;

    fn base(side: i32) -> MapContents {
        let square = (0..side).flat_map(|x| (0..side).map(move |y| [x * 8, y * 8, 0]));
        MapContents::at(1, square.filter_map(VoxelKey::new).collect())
    }

    fn scan(revision: u64, x: std::ops::Range<i32>) -> ScanRecord {
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        let points: Vec<Point> = x.map(|x| Point::new(x as f32 + 0.5, 0.5, 0.5)).collect();
        let lattice = Lattice::new(1.0, 1).unwrap();
        ScanRecord::of_points(MappedScan { revision, ..pose }, &points, &lattice)
    }

    fn insertion(revision: u64, x: std::ops::Range<i32>) -> Change {
        Change::Insertion(scan(revision, x))
    }

    fn deletion(x: std::ops::Range<i32>) -> Change {
        let voxels = x.filter_map(|x| VoxelKey::new([x, 0, 0])).collect();
        Change::Deletion(DeletionRecord { voxels, request: None })
    }

    /// Of targets among `changes`, the first of which makes revision 2.
    fn begun(targets: &[u64], changes: &[Change], base: &MapContents) -> VoxelOwnership {
        let mut observations = VoxelOwnership::of(targets.to_vec(), &[]);
        for (revision, change) in (2..).zip(changes) {
            match change {
                Change::Insertion(scan) if targets.contains(&revision) => observations.touch(scan),
                _ => {}
            }
        }
        assert!(observations.begin(base, StopSignal::NEVER));
        observations
    }

    #[test]
    fn a_base_is_looked_at_with_looks_at_the_signal_in_proportion_to_its_size() {
        for side in [50, 200, 400] {
            let (base, looks) = (base(side), Cell::new(0));
            let count = || looks.replace(looks.get() + 1) == usize::MAX;
            let mut observations = begun(&[2], &[insertion(2, 0..10)], &base);
            assert!(observations.begin(&base, StopSignal::when(&count)));
            let entries = base.voxels.blocks().len() + base.moments.as_slice().len();
            assert!(entries / looks.get() <= ENTRIES_PER_LOOK, "{entries} entries, {} looks", looks.get());
            let gone = || true;
            assert!(!observations.begin(&base, StopSignal::when(&gone)));
        }
    }

    #[test]
    fn what_leaves_becomes_what_is_found_out_at_the_end_whatever_comes_between() {
        let changes = [
            insertion(2, 0..100),
            insertion(3, 50..60),
            deletion(10..30),
            insertion(4, 90..300),
            insertion(5, 20..95),
            deletion(0..12),
            insertion(6, 1000..1020),
            deletion(200..1010),
            insertion(7, 5000..5010),
        ];
        for found_out_after in 0..=changes.len() {
            let (mut early, mut late) =
                (begun(&[2, 4], &changes, &base(3)), begun(&[2, 4], &changes, &base(3)));
            let mut leaving = None;
            for (at, (revision, change)) in (2..).zip(&changes).enumerate() {
                if at == found_out_after {
                    leaving = early.leaving(StopSignal::NEVER);
                }
                early.observe(revision, change);
                late.observe(revision, change);
                if let Some(leaving) = &leaving {
                    let mut now = Leaving::clone(leaving);
                    early.renew(&mut now.voxels, &mut now.moments);
                    assert_eq!(now, late.leaving(StopSignal::NEVER).unwrap(), "{found_out_after}, {at}");
                }
            }
        }
    }

    #[test]
    fn what_the_targets_did_not_touch_changes_nothing_and_takes_no_memory() {
        let mut observations = begun(&[2], &[insertion(2, 0..10)], &base(300));
        observations.observe(2, &insertion(2, 0..10));
        let mut leaving = observations.leaving(StopSignal::NEVER).unwrap();
        observations.observe(3, &insertion(3, 1000..100_000));
        observations.observe(4, &deletion(2000..90_000));
        assert!(!observations.renew(&mut leaving.voxels, &mut leaving.moments));
        assert_eq!((observations.blocks.len(), observations.moments.len()), (2, 3));
    }

    #[test]
    fn what_leaves_with_the_targets_is_found_out_with_looks_in_proportion_to_what_they_touched() {
        let target = insertion(2, 0..1_000_000);
        let mut observations = begun(&[2], std::slice::from_ref(&target), &base(400));
        observations.observe(2, &target);
        let looks = Cell::new(0);
        let count = || looks.replace(looks.get() + 1) == usize::MAX;
        assert!(observations.leaving(StopSignal::when(&count)).is_some());
        let entries = observations.blocks.len() + observations.moments.len();
        assert!(looks.get() >= entries / ENTRIES_PER_LOOK && entries > 10 * ENTRIES_PER_LOOK, "{entries}");
        let gone = || true;
        assert_eq!(observations.leaving(StopSignal::when(&gone)), None);
    }

    #[test]
    fn what_a_target_is_said_to_add_covers_its_tables() {
        let scan = scan(2, 0..100_000);
        let mut observations = VoxelOwnership::of(vec![2], &[]);
        observations.touch(&scan);
        let tables = observations.blocks.allocation_size() + observations.moments.allocation_size();
        assert!(tables <= VoxelOwnership::bytes_of(&scan), "{tables} bytes");
    }
}
