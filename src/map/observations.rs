//! Which voxels would not be there without certain scans.

use std::collections::{BTreeMap, BTreeSet};

use super::{Change, MapContents, WithdrawnScan};
use crate::util::StopSignal;
use crate::voxel::{BlockMask, MomentSet, Moments, VoxelKey, VoxelSet};

/// Who holds each voxel: scans that are to be undone, others, or both.
///
/// A scan holds the voxels that it touched, until a deletion takes them from everybody or the scan is undone; a
/// voxel is occupied as long as somebody holds it. So a map without certain scans follows from its changes: it is
/// what replaying them without those scans would give, with the deletions as they were.
///
/// What leaves with the targets can be found out beforehand ([`Observations::plan`]): what is observed afterwards is
/// noted, and changes the plan by that much and no more.
#[derive(Debug)]
pub struct Observations {
    /// By revision, ascending.
    targets: Vec<u64>,
    /// Scans that hold nothing any more, ascending.
    withdrawn: Vec<u64>,
    /// Blocks that the targets hold voxels of, or held.
    by_targets: BTreeMap<VoxelKey, BlockMask>,
    by_others: BTreeMap<VoxelKey, BlockMask>,
    /// As they are without the targets.
    moments: BTreeMap<VoxelKey, Moments>,
    /// The voxels whose moments the targets changed.
    touched: BTreeSet<VoxelKey>,
    planned: Option<Planned>,
}

/// What leaves with the targets, as it was when it was found out.
#[derive(Debug, Default)]
struct Planned {
    voxels: VoxelSet,
    moments: MomentSet,
    /// Blocks and voxels with moments that were observed since, of those that the targets touched.
    blocks_since: BTreeSet<VoxelKey>,
    moments_since: BTreeSet<VoxelKey>,
}

/// Entries of a base that are taken over between two looks at the stop signal.
const ENTRIES_PER_LOOK: usize = 16 << 10;
/// What a tree takes for an entry besides the entry itself, a node of eleven of them being full; rounded up.
const OF_ENTRY: usize = 16;

impl Observations {
    /// Begins with `base`, what the map held at a revision before that of any scan of `targets`; its holders are
    /// others; none once stopped. No scan may lie before the base and be withdrawn after it.
    pub fn new(
        mut targets: Vec<u64>,
        withdrawn: &[WithdrawnScan],
        base: &MapContents,
        stop: StopSignal<'_>,
    ) -> Option<Self> {
        targets.sort_unstable();
        let mut withdrawn: Vec<u64> = withdrawn.iter().map(|withdrawn| withdrawn.scan).collect();
        withdrawn.sort_unstable();
        let by_others = stop.pieces(base.voxels.blocks(), ENTRIES_PER_LOOK).flatten().copied().collect();
        let moments = stop.pieces(base.moments.as_slice(), ENTRIES_PER_LOOK).flatten().copied().collect();
        let (by_targets, touched) = (BTreeMap::new(), BTreeSet::new());
        let observations =
            Self { targets, withdrawn, by_targets, by_others, moments, touched, planned: None };
        (!stop.is_stopped()).then_some(observations)
    }

    /// Bytes that observations of a base of so many blocks and voxels with moments take, at most: each entry twice, since
    /// maps are sorted before they are built.
    pub fn bytes_max(blocks: usize, moments: usize) -> usize {
        // That the targets hold it as well.
        const OF_BLOCK: usize = 2 * size_of::<(VoxelKey, BlockMask)>();
        const OF_MOMENTS: usize = size_of::<(VoxelKey, Moments)>();
        let twice = |entry: usize| 2 * entry + OF_ENTRY;
        blocks.saturating_mul(twice(OF_BLOCK)).saturating_add(moments.saturating_mul(twice(OF_MOMENTS)))
    }

    /// The scans that are to be undone, by revision, ascending.
    pub fn targets(&self) -> &[u64] {
        &self.targets
    }

    /// Takes note of the next change after the base.
    pub fn observe(&mut self, revision: u64, change: &Change) {
        match change {
            Change::Insertion(_) if self.withdrawn.binary_search(&revision).is_ok() => {}
            Change::Insertion(scan) => {
                let is_target = self.targets.binary_search(&revision).is_ok();
                let holders = if is_target { &mut self.by_targets } else { &mut self.by_others };
                for (block, mask) in scan.voxels.blocks() {
                    let by = holders.entry(*block).or_insert(BlockMask::EMPTY);
                    *by = by.union(mask);
                    self.planned.iter_mut().for_each(|planned| planned.blocks_since.extend([*block]));
                }
                for &(voxel, moments) in scan.moments.as_slice() {
                    match is_target {
                        true => drop(self.touched.insert(voxel)),
                        false => *self.moments.entry(voxel).or_default() += moments,
                    }
                    self.planned.iter_mut().for_each(|planned| planned.moments_since.extend([voxel]));
                }
            }
            Change::Deletion(deletion) => {
                for (block, mask) in deletion.voxels.blocks() {
                    self.planned.iter_mut().for_each(|planned| planned.blocks_since.extend([*block]));
                    if let Some(by_targets) = self.by_targets.get_mut(block) {
                        *by_targets = by_targets.difference(mask);
                    }
                    if let Some(by_others) = self.by_others.get_mut(block) {
                        let before = std::mem::replace(by_others, by_others.difference(mask));
                        let rebuilt = by_others.rebuilt_moments(&before, *block).inspect(|(voxel, _)| {
                            self.planned
                                .iter_mut()
                                .for_each(|planned| planned.moments_since.extend([*voxel]));
                        });
                        self.moments.extend(rebuilt);
                    }
                }
            }
            // The scans that it took out were passed over where they went in.
            Change::Undo(_) => {}
        }
    }

    /// The moments of all voxels that the targets touched, as they are without them: what they were, and of no points
    /// where nothing is left.
    pub fn moments_without_targets(&self) -> MomentSet {
        let Some(Planned { moments, moments_since, .. }) = &self.planned else {
            return self.moments_until(StopSignal::NEVER);
        };
        let since = moments_since.iter().filter(|voxel| self.touched.contains(voxel));
        merged(moments.as_slice(), since.map(|&voxel| (voxel, self.moment_without_targets(voxel)))).collect()
    }

    /// The voxels that nobody but the targets holds.
    pub fn held_by_targets_alone(&self) -> VoxelSet {
        let Some(Planned { voxels, blocks_since, .. }) = &self.planned else {
            return self.alone_until(StopSignal::NEVER);
        };
        let since = blocks_since
            .iter()
            .filter_map(|block| Some((*block, self.alone(*block, self.by_targets.get(block)?))));
        merged(voxels.blocks(), since).collect()
    }

    /// Finds out beforehand what leaves with the targets. False once stopped; there is no plan then.
    pub fn plan(&mut self, stop: StopSignal<'_>) -> bool {
        let (voxels, moments) = (self.alone_until(stop), self.moments_until(stop));
        self.planned = (!stop.is_stopped()).then(|| Planned { voxels, moments, ..Planned::default() });
        self.planned.is_some()
    }

    fn alone(&self, block: VoxelKey, by_targets: &BlockMask) -> BlockMask {
        by_targets.difference(self.by_others.get(&block).unwrap_or(&BlockMask::EMPTY))
    }

    fn alone_until(&self, stop: StopSignal<'_>) -> VoxelSet {
        let held = stop.paced(&self.by_targets, ENTRIES_PER_LOOK);
        held.map(|(&block, by_targets)| (block, self.alone(block, by_targets))).collect()
    }

    fn moment_without_targets(&self, voxel: VoxelKey) -> Moments {
        self.moments.get(&voxel).copied().unwrap_or_default()
    }

    fn moments_until(&self, stop: StopSignal<'_>) -> MomentSet {
        let touched = stop.paced(&self.touched, ENTRIES_PER_LOOK);
        touched.map(|&voxel| (voxel, self.moment_without_targets(voxel))).collect()
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
    use crate::map::{DeletionRecord, RobotName, ScanRecord, TrajectoryPose};
    use crate::voxel::Lattice;

    fn base(side: i32) -> MapContents {
        let square = (0..side).flat_map(|x| (0..side).map(move |y| [x * 8, y * 8, 0]));
        MapContents::at(1, square.filter_map(VoxelKey::new).collect())
    }

    #[test]
    fn a_base_is_taken_over_with_looks_at_the_signal_in_proportion_to_its_size() {
        for side in [50, 200, 400] {
            let (base, looks) = (base(side), Cell::new(0));
            let count = || looks.replace(looks.get() + 1) == usize::MAX;
            assert!(Observations::new(vec![2], &[], &base, StopSignal::when(&count)).is_some());
            let entries = base.voxels.blocks().len() + base.moments.as_slice().len();
            assert!(entries / looks.get() <= ENTRIES_PER_LOOK, "{entries} entries, {} looks", looks.get());
        }
        let gone = || true;
        assert!(Observations::new(vec![2], &[], &base(50), StopSignal::when(&gone)).is_none());
    }

    fn insertion(revision: u64, x: std::ops::Range<i32>) -> Change {
        let pose = TrajectoryPose::new(RobotName::new("r").unwrap(), Pose::identity());
        let points: Vec<Point> = x.map(|x| Point::new(x as f32 + 0.5, 0.5, 0.5)).collect();
        let lattice = Lattice::new(1.0, 1).unwrap();
        Change::Insertion(ScanRecord::of_points(TrajectoryPose { revision, ..pose }, &points, &lattice))
    }

    fn deletion(x: std::ops::Range<i32>) -> Change {
        let voxels = x.filter_map(|x| VoxelKey::new([x, 0, 0])).collect();
        Change::Deletion(DeletionRecord { voxels, request: None })
    }

    #[test]
    fn a_plan_becomes_what_is_found_out_at_the_end_whatever_comes_between() {
        let changes = [
            insertion(2, 0..100),
            insertion(3, 50..60),
            deletion(10..30),
            insertion(4, 90..300),
            insertion(5, 20..95),
            deletion(0..12),
            insertion(6, 1000..1020),
            deletion(200..1010),
        ];
        for planned_after in 0..=changes.len() {
            let begin = || Observations::new(vec![2, 4], &[], &base(3), StopSignal::NEVER).unwrap();
            let (mut planned, mut fresh) = (begin(), begin());
            for (at, (revision, change)) in (2..).zip(&changes).enumerate() {
                if at == planned_after {
                    assert!(planned.plan(StopSignal::NEVER));
                }
                planned.observe(revision, change);
                fresh.observe(revision, change);
                assert_eq!(planned.held_by_targets_alone(), fresh.held_by_targets_alone());
                assert_eq!(planned.moments_without_targets(), fresh.moments_without_targets());
            }
        }
    }

    #[test]
    fn what_leaves_with_the_targets_costs_what_they_hold_and_not_what_the_map_holds() {
        let mut observations = Observations::new(vec![2], &[], &base(400), StopSignal::NEVER).unwrap();
        observations.observe(2, &insertion(2, 0..100_000));
        let looks = Cell::new(0);
        let count = || looks.replace(looks.get() + 1) == usize::MAX;
        assert!(observations.plan(StopSignal::when(&count)));
        let entries = observations.by_targets.len() + observations.touched.len();
        assert!(
            (1..=2 * entries.div_ceil(ENTRIES_PER_LOOK) + 2).contains(&looks.get()),
            "{} looks",
            looks.get()
        );
        let gone = || true;
        assert!(!observations.plan(StopSignal::when(&gone)));
    }

    #[test]
    fn what_is_reserved_for_a_base_covers_its_entries_twice() {
        let base = base(100);
        let (blocks, moments) = (base.voxels.blocks().len(), base.moments.as_slice().len());
        let entries =
            2 * blocks * size_of::<(VoxelKey, BlockMask)>() + moments * size_of::<(VoxelKey, Moments)>();
        let reserved = Observations::bytes_max(blocks, moments);
        assert!((2 * entries..3 * entries).contains(&reserved), "{reserved} for {entries} bytes of entries");
    }
}
