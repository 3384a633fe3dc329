//! The turn of a scan to be made: it was prepared against the map as it was.

use super::recent_changes::RecentChanges;
use mrol_map::map::{Change, MultiResolutionMap, ScanRecord, ViewpointRecord};
use mrol_map::mapping::Carving;
use mrol_map::visibility::{VIEWPOINT_MEMORY_MAX, Viewpoint};
use mrol_map::voxel::VoxelSet;

/// What a scan may still do when its turn comes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TurnLimits {
    /// The revision in which it saw what it carves.
    pub(crate) carved_at: u64,
    /// Bytes of memory of all viewpoints of the map, its own with them.
    pub(crate) viewpoint_bytes_max: usize,
}

/// A map when it is the turn of a scan: with what is made before it in its group.
pub(super) struct ScanTurn<'a> {
    pub(super) map: &'a MultiResolutionMap,
    pub(super) recent: &'a RecentChanges,
    pub(super) before: Vec<&'a Change>,
}

impl ScanTurn<'_> {
    /// Cuts the scan to what it may still do; true where something went.
    pub(super) fn cut(&self, scan: &mut ScanRecord, limits: TurnLimits) -> bool {
        let carves_less = self.cut_carving(scan, limits.carved_at);
        let leaves_none = !self.has_room_for_viewpoint(scan, limits.viewpoint_bytes_max);
        if leaves_none {
            scan.viewpoint = None;
        }
        carves_less || leaves_none
    }

    /// Cuts what a scan carves to what is there, and what no change since `carved_at` touched: another scan that saw
    /// something there meanwhile is not contradicted. Of changes that are no longer kept nobody knows what they
    /// touched: then the scan carves nothing.
    fn cut_carving(&self, scan: &mut ScanRecord, carved_at: u64) -> bool {
        if scan.carved.is_empty() {
            return false;
        }
        let mut carving = Carving { voxels: std::mem::take(&mut scan.carved), revision: carved_at };
        let carved = carving.voxels.clone();
        for revision in carved_at + 1..=self.map.revision() {
            match self.recent.get(revision) {
                Some(change) => change.touched().into_iter().for_each(|touched| carving.cut(touched)),
                None => carving.voxels = VoxelSet::default(),
            }
            if carving.voxels.is_empty() {
                break;
            }
        }
        let before_it = self.before.iter().flat_map(|change| change.touched());
        before_it.for_each(|touched| carving.cut(touched));
        let is_cut = carving.voxels != carved;
        scan.carved = carving.voxels;
        is_cut
    }

    /// False where the viewpoint that the scan leaves makes more of them than the map may have: others came while it
    /// was prepared, and those that it displaces are no longer enough.
    fn has_room_for_viewpoint(&self, scan: &ScanRecord, bytes_max: usize) -> bool {
        if scan.viewpoint.is_none() {
            return true;
        }
        let viewpoints = self.map.viewpoints();
        let leaving: Vec<_> =
            self.before.iter().filter_map(|change| left_by(change)).chain(left(scan)).collect();
        if viewpoints.memory_bytes() + leaving.len() * VIEWPOINT_MEMORY_MAX <= bytes_max {
            return true;
        }
        let come = leaving
            .iter()
            .map(|(scan, left)| Viewpoint::new(scan.pose.map_from_sensor, left.image.clone()).memory_bytes());
        let mut displaced: Vec<u64> =
            leaving.iter().flat_map(|(_, left)| left.displaced.iter().copied()).collect();
        displaced.sort_unstable();
        displaced.dedup();
        let gone = displaced.iter().filter_map(|&revision| viewpoints.get(revision));
        let gone: usize = gone.map(|viewpoint| viewpoint.memory_bytes()).sum();
        viewpoints.memory_bytes() + come.sum::<usize>() <= bytes_max + gone
    }
}

/// The viewpoint that a change leaves, with its scan.
fn left_by(change: &Change) -> Option<(&ScanRecord, &ViewpointRecord)> {
    match change {
        Change::Insertion(scan) => left(scan),
        Change::Deletion(_) | Change::Undo(_) | Change::KeepOut(_) => None,
    }
}

fn left(scan: &ScanRecord) -> Option<(&ScanRecord, &ViewpointRecord)> {
    Some((scan, scan.viewpoint.as_ref()?))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::commit::watched_change::WatchedChange;
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::map::{ContentHistory, ContentVersion, DeletionRecord, MapSettings, MappedScan, RobotName};
    use mrol_map::visibility::{IMAGE_BYTES_MAX, RangeImage, Sweep};
    use mrol_map::voxel::VoxelKey;

    fn voxels(x: std::ops::Range<i32>) -> VoxelSet {
        x.filter_map(|x| VoxelKey::new([x, 0, 0])).collect()
    }

    fn scan_record(seen: VoxelSet, carved: VoxelSet) -> ScanRecord {
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        ScanRecord { carved, ..ScanRecord::of_voxels(pose, seen) }
    }

    fn scan(seen: VoxelSet, carved: VoxelSet) -> Change {
        Change::Insertion(scan_record(seen, carved))
    }

    fn deletion(voxels: VoxelSet) -> Change {
        Change::Deletion(DeletionRecord { voxels, request: None })
    }

    /// A map to which these changes were made, and what of them so many bytes remember.
    fn map_of(changes: &[Change], recent_bytes: usize) -> (MultiResolutionMap, Arc<RecentChanges>) {
        let map = MultiResolutionMap::new(MapSettings::new(0.1, 2)).unwrap();
        let history = ContentHistory::of(ContentVersion::default(), map.state_hash());
        let recent = Arc::new(RecentChanges::new(0, history, recent_bytes));
        for change in changes {
            let committed = map.committer().apply(change);
            let change = WatchedChange::of(committed.revision, None, change.clone(), Vec::new());
            recent.push(change, map.state_hash());
        }
        (map, recent)
    }

    /// What a scan carves that saw voxels 0 to 99 gone at revision 1, when its turn comes.
    fn carved((map, recent): &(MultiResolutionMap, Arc<RecentChanges>), group: &[Change]) -> VoxelSet {
        let turn = ScanTurn { map, recent, before: group.iter().collect() };
        let mut scan = scan_record(voxels(200..210), voxels(0..100));
        let whole = scan.carved.clone();
        let is_cut = turn.cut(&mut scan, TurnLimits { carved_at: 1, viewpoint_bytes_max: 0 });
        assert_eq!(is_cut, scan.carved != whole);
        scan.carved
    }

    #[test]
    fn what_went_or_was_seen_since_is_not_carved() {
        let first = scan(voxels(0..100), VoxelSet::default());
        let (gone, seen) = (deletion(voxels(0..10)), scan(voxels(90..120), voxels(80..90)));
        let nothing = [];
        assert_eq!(carved(&map_of(std::slice::from_ref(&first), 1 << 20), &nothing), voxels(0..100));
        let all = [first.clone(), gone.clone(), seen.clone()];
        assert_eq!(carved(&map_of(&all, 1 << 20), &nothing), voxels(10..80));
        assert_eq!(
            carved(&map_of(&[first.clone(), gone], 1 << 20), std::slice::from_ref(&seen)),
            voxels(10..80)
        );
        assert_eq!(carved(&map_of(&[first], 1 << 20), &[seen]), voxels(0..80));
    }

    #[test]
    fn where_nobody_knows_what_came_between_nothing_is_carved() {
        let first = scan(voxels(0..100), VoxelSet::default());
        assert_eq!(carved(&map_of(std::slice::from_ref(&first), 0), &[]), voxels(0..100));
        assert!(carved(&map_of(&[first, deletion(voxels(50..51))], 0), &[]).is_empty());
    }

    /// A scan that leaves a viewpoint and displaces some.
    fn seeing(displaced: Vec<u64>) -> ScanRecord {
        let points: Vec<Point> =
            (0..10_000).map(|i| Point::new(5.0, (i % 100) as f32 * 0.05, (i / 100) as f32 * 0.05)).collect();
        let range = Sweep::standing(60.0);
        let image = RangeImage::of_points(&points, range, IMAGE_BYTES_MAX).unwrap();
        let viewpoint = Some(ViewpointRecord { image, displaced });
        ScanRecord { viewpoint, ..scan_record(voxels(0..1), VoxelSet::default()) }
    }

    #[test]
    fn robots_that_leave_viewpoints_at_once_leave_no_more_than_there_is_room_for() {
        let change = |displaced| Change::Insertion(seeing(displaced));
        let (map, recent) = map_of(&[change(vec![]), change(vec![])], 1 << 20);
        let one = map.viewpoints().memory_bytes() / 2;
        let leaves_one = |displaced: Vec<u64>, before: &[Change], viewpoint_bytes_max| {
            let turn = ScanTurn { map: &map, recent: &recent, before: before.iter().collect() };
            let mut scan = seeing(displaced);
            let is_cut = turn.cut(&mut scan, TurnLimits { carved_at: 0, viewpoint_bytes_max });
            assert_eq!(is_cut, scan.viewpoint.is_none());
            !is_cut
        };
        assert!(leaves_one(vec![], &[], 3 * one), "there is room for a third");
        assert!(!leaves_one(vec![], &[], 3 * one - 1));
        assert!(leaves_one(vec![1], &[], 2 * one), "one goes for it");
        assert!(!leaves_one(vec![1], &[change(vec![1])], 2 * one), "that one goes for another robot's");
        assert!(leaves_one(vec![2], &[change(vec![1])], 2 * one));
        assert!(!leaves_one(vec![7], &[], 2 * one), "none of that revision is there");
    }
}
