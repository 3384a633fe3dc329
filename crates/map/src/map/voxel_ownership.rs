//! Which voxels a map would hold without certain changes.

use std::collections::BTreeSet;

use hashbrown::HashMap;

use super::change::Change;
use super::contents::MapContents;
use super::trajectory::{ScanRecord, WithdrawnChange};
use crate::util::StopSignal;
use crate::voxel::{BlockMask, MOMENT_LEVEL, MomentSet, Moments, VoxelKey, VoxelSet};

/// What a map holds of the voxels that scans and deletions which are to be undone, the targets, have touched: as it is,
/// and as it would be without them.
///
/// A map without certain changes is what replaying all others gives, with the deletions and what scans carved as they
/// were. So both are replayed side by side, in the blocks that the targets touched: no other voxel can differ. What is
/// there with the targets alone goes with them, and what is there only without them comes back.
///
/// VoxelOwnership are made in this order: each target is [touched](VoxelOwnership::touch), so that nothing else need be
/// remembered; the [base](VoxelOwnership::begin) and every change after it, the targets among them, are
/// [observed](VoxelOwnership::observe); what undoing the targets does is [found out](VoxelOwnership::reversal); and
/// what is observed after that [renews](VoxelOwnership::renew) it. They take memory by what the targets touched,
/// whatever else the map held.
#[derive(Debug)]
pub struct VoxelOwnership {
    /// By revision, ascending.
    targets: Vec<u64>,
    /// Changes that were taken back before, ascending.
    withdrawn: Vec<u64>,
    /// Blocks that the targets touched.
    blocks: HashMap<VoxelKey, Sides>,
    /// Voxels whose moments the targets changed, as they are without them.
    moments: HashMap<VoxelKey, Moments>,
    /// False of a map that keeps no moments: there are none to find out about.
    keeps_moments: bool,
    /// What of both changed since it was found out what undoing does.
    since: Option<Since>,
}

/// The voxels of a block, with the targets and without them.
#[derive(Debug, Clone, Copy)]
struct Sides {
    with: BlockMask,
    without: BlockMask,
}

#[derive(Debug, Default)]
struct Since {
    blocks: BTreeSet<VoxelKey>,
    moments: BTreeSet<VoxelKey>,
}

/// What undoing changes does to a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reversal {
    /// The voxels that go: those that are there with the targets alone.
    pub removed: VoxelSet,
    /// The voxels that come back: those that the targets took away.
    pub restored: VoxelSet,
    /// The moments of all voxels that the targets touched, as they are without them: what they were, and of no points
    /// where nothing is left.
    pub moments: MomentSet,
}

/// Entries that are looked at between two looks at the stop signal.
const ENTRIES_PER_STOP_CHECK: usize = 16 << 10;

impl VoxelOwnership {
    /// The ownership of changes that are to be undone, by revision, in a map with moments or without; those of
    /// `withdrawn` were taken back before.
    pub fn of(mut targets: Vec<u64>, withdrawn: &[WithdrawnChange], keeps_moments: bool) -> Self {
        targets.sort_unstable();
        let mut withdrawn: Vec<u64> = withdrawn.iter().map(|withdrawn| withdrawn.change).collect();
        withdrawn.sort_unstable();
        let (blocks, moments) = (HashMap::new(), HashMap::new());
        Self { targets, withdrawn, blocks, moments, keeps_moments, since: None }
    }

    /// Bytes of memory that touching `target` takes at most: an entry of each of its blocks and voxels with moments, in
    /// tables that grow to twice their size beside the old ones.
    pub fn bytes_of(&self, target: &Change) -> usize {
        const OF_BLOCK: usize = 4 * size_of::<(VoxelKey, Sides)>();
        const OF_MOMENTS: usize = 4 * size_of::<(VoxelKey, Moments)>();
        let coarse = |(_, mask): &(VoxelKey, BlockMask)| mask.count(MOMENT_LEVEL);
        let touched = target.touched().into_iter();
        let bytes_of = |voxels: &VoxelSet| {
            let with_moments = voxels.blocks().iter().filter(|_| self.keeps_moments);
            let moments: usize = with_moments.map(coarse).sum();
            voxels.blocks().len() * OF_BLOCK + moments * OF_MOMENTS
        };
        touched.map(bytes_of).sum()
    }

    /// Bytes of memory that finding out what undoing does takes at most: it, once more while it is renewed, and what is
    /// noted meanwhile.
    pub fn reversal_bytes(&self) -> usize {
        const OF_BLOCK: usize = 4 * size_of::<(VoxelKey, BlockMask)>() + 2 * size_of::<VoxelKey>();
        const OF_MOMENTS: usize = 2 * size_of::<(VoxelKey, Moments)>() + 2 * size_of::<VoxelKey>();
        self.blocks.len() * OF_BLOCK + self.moments.len() * OF_MOMENTS
    }

    /// Takes note of what a target touches.
    pub fn touch(&mut self, target: &Change) {
        let nothing = Sides { with: BlockMask::EMPTY, without: BlockMask::EMPTY };
        for (block, mask) in target.touched().into_iter().flat_map(VoxelSet::blocks) {
            self.blocks.entry(*block).or_insert(nothing);
            for cell in mask.cells(MOMENT_LEVEL).filter(|_| self.keeps_moments) {
                self.moments.entry(cell.voxel(*block).ancestor(MOMENT_LEVEL)).or_default();
            }
        }
    }

    /// Begins with `base`, what the map held at a revision before that of any target. False once stopped. No change may
    /// lie before the base and be taken back after it.
    pub fn begin(&mut self, base: &MapContents, stop: StopSignal<'_>) -> bool {
        for (block, mask) in stop.pieces(base.voxels.blocks(), ENTRIES_PER_STOP_CHECK).flatten() {
            if let Some(sides) = self.blocks.get_mut(block) {
                *sides = Sides { with: *mask, without: *mask };
            }
        }
        for (voxel, moments) in stop.pieces(base.moments.as_slice(), ENTRIES_PER_STOP_CHECK).flatten() {
            if let Some(without) = self.moments.get_mut(voxel) {
                *without = *moments;
            }
        }
        !stop.is_stopped()
    }

    /// Takes note of the next change after the base.
    pub fn observe(&mut self, revision: u64, change: &Change) {
        if self.withdrawn.binary_search(&revision).is_ok() {
            return;
        }
        let is_target = self.targets.binary_search(&revision).is_ok();
        match change {
            Change::Insertion(scan) => {
                self.observe_removal(&scan.carved, is_target);
                self.observe_scan(scan, is_target);
            }
            Change::Deletion(deletion) => self.observe_removal(&deletion.voxels, is_target),
            // What it took back was passed over where it was made.
            Change::Undo(_) => {}
            // No voxel has to do with it.
            Change::KeepOut(_) => {}
        }
    }

    fn observe_scan(&mut self, scan: &ScanRecord, is_target: bool) {
        for (block, mask) in scan.voxels.blocks() {
            let Some(sides) = self.blocks.get_mut(block) else { continue };
            sides.with = sides.with.union(mask);
            if !is_target {
                sides.without = sides.without.union(mask);
            }
            self.since.iter_mut().for_each(|since| since.blocks.extend([*block]));
        }
        for &(voxel, moments) in scan.moments.as_slice().iter().filter(|_| !is_target) {
            let Some(without) = self.moments.get_mut(&voxel) else { continue };
            *without += moments;
            self.since.iter_mut().for_each(|since| since.moments.extend([voxel]));
        }
    }

    fn observe_removal(&mut self, voxels: &VoxelSet, is_target: bool) {
        for (block, mask) in voxels.blocks() {
            let Some(sides) = self.blocks.get_mut(block) else { continue };
            sides.with = sides.with.difference(mask);
            self.since.iter_mut().for_each(|since| since.blocks.extend([*block]));
            if is_target {
                continue;
            }
            let before = sides.without;
            sides.without = before.difference(mask);
            for (voxel, rebuilt) in sides.without.rebuilt_moments(&before, *block) {
                let Some(without) = self.moments.get_mut(&voxel) else { continue };
                *without = rebuilt;
                self.since.iter_mut().for_each(|since| since.moments.extend([voxel]));
            }
        }
    }

    /// What undoing the targets does; none once stopped. What is observed afterwards is noted, for
    /// [`VoxelOwnership::renew`].
    pub fn reversal(&mut self, stop: StopSignal<'_>) -> Option<Reversal> {
        let of_blocks = |of: fn(&Sides) -> BlockMask| {
            let blocks = stop.paced(&self.blocks, ENTRIES_PER_STOP_CHECK);
            VoxelSet::of_blocks_until(blocks.map(|(&block, sides)| (block, of(sides))).collect(), stop)
        };
        let (removed, restored) = (of_blocks(Sides::removed), of_blocks(Sides::restored));
        let moments =
            stop.paced(&self.moments, ENTRIES_PER_STOP_CHECK).map(|(&voxel, without)| (voxel, *without));
        let moments = MomentSet::of_voxels_until(moments.collect(), stop);
        self.since = Some(Since::default());
        (!stop.is_stopped()).then_some(Reversal { removed, restored, moments })
    }

    /// Makes what undoing the targets did what it does now; true where that may be something else. It takes as long as
    /// what was observed since, and where that was something, a copy.
    pub fn renew(&self, removed: &mut VoxelSet, restored: &mut VoxelSet, moments: &mut MomentSet) -> bool {
        let Some(since) = self.since.as_ref().filter(|since| !since.is_empty()) else { return false };
        for (voxels, of) in
            [(removed, Sides::removed as fn(&Sides) -> BlockMask), (restored, Sides::restored)]
        {
            let changed = |block: &VoxelKey| Some((*block, of(self.blocks.get(block)?)));
            *voxels = merged(voxels.blocks(), since.blocks.iter().filter_map(changed)).collect();
        }
        let changed = |voxel: &VoxelKey| Some((*voxel, *self.moments.get(voxel)?));
        *moments = merged(moments.as_slice(), since.moments.iter().filter_map(changed)).collect();
        true
    }

    /// The changes that are to be undone, by revision, ascending.
    pub fn targets(&self) -> &[u64] {
        &self.targets
    }
}

impl Since {
    fn is_empty(&self) -> bool {
        self.blocks.is_empty() && self.moments.is_empty()
    }
}

impl Sides {
    fn removed(&self) -> BlockMask {
        self.with.difference(&self.without)
    }

    fn restored(&self) -> BlockMask {
        self.without.difference(&self.with)
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
    use crate::map::change::DeletionRecord;
    use crate::map::name::RobotName;
    use crate::map::trajectory::MappedScan;
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
        let mut observations = VoxelOwnership::of(targets.to_vec(), &[], true);
        for (_, change) in (2..).zip(changes).filter(|(revision, _)| targets.contains(revision)) {
            observations.touch(change);
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
            assert!(
                entries / looks.get() <= ENTRIES_PER_STOP_CHECK,
                "{entries} entries, {} looks",
                looks.get()
            );
            let gone = || true;
            assert!(!observations.begin(&base, StopSignal::when(&gone)));
        }
    }

    #[test]
    fn what_undoing_does_becomes_what_is_found_out_at_the_end_whatever_comes_between() {
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
                (begun(&[2, 4, 5], &changes, &base(3)), begun(&[2, 4, 5], &changes, &base(3)));
            let mut reversal = None;
            for (at, (revision, change)) in (2..).zip(&changes).enumerate() {
                if at == found_out_after {
                    reversal = early.reversal(StopSignal::NEVER);
                }
                early.observe(revision, change);
                late.observe(revision, change);
                if let Some(reversal) = &reversal {
                    let mut now = Reversal::clone(reversal);
                    early.renew(&mut now.removed, &mut now.restored, &mut now.moments);
                    assert_eq!(now, late.reversal(StopSignal::NEVER).unwrap(), "{found_out_after}, {at}");
                }
            }
        }
    }

    #[test]
    fn what_the_targets_did_not_touch_changes_nothing_and_takes_no_memory() {
        let mut observations = begun(&[2], &[insertion(2, 0..10)], &base(300));
        observations.observe(2, &insertion(2, 0..10));
        let mut reversal = observations.reversal(StopSignal::NEVER).unwrap();
        observations.observe(3, &insertion(3, 1000..100_000));
        observations.observe(4, &deletion(2000..90_000));
        let Reversal { removed, restored, moments } = &mut reversal;
        assert!(!observations.renew(removed, restored, moments));
        assert_eq!((observations.blocks.len(), observations.moments.len()), (2, 3));
    }

    #[test]
    fn what_undoing_does_is_found_out_with_looks_in_proportion_to_what_they_touched() {
        let target = insertion(2, 0..1_000_000);
        let mut observations = begun(&[2], std::slice::from_ref(&target), &base(400));
        observations.observe(2, &target);
        let looks = Cell::new(0);
        let count = || looks.replace(looks.get() + 1) == usize::MAX;
        assert!(observations.reversal(StopSignal::when(&count)).is_some());
        let entries = observations.blocks.len() + observations.moments.len();
        assert!(
            looks.get() >= entries / ENTRIES_PER_STOP_CHECK && entries > 10 * ENTRIES_PER_STOP_CHECK,
            "{entries}"
        );
        let gone = || true;
        assert_eq!(observations.reversal(StopSignal::when(&gone)), None);
    }

    #[test]
    fn what_a_target_is_said_to_add_covers_its_tables() {
        for target in [insertion(2, 0..100_000), deletion(0..100_000)] {
            let mut observations = VoxelOwnership::of(vec![2], &[], true);
            observations.touch(&target);
            let tables = observations.blocks.allocation_size() + observations.moments.allocation_size();
            assert!(tables <= observations.bytes_of(&target), "{tables} bytes");
        }
    }
}
