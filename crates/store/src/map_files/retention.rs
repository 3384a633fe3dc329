//! Retention: which snapshots are kept.
//!
//! Two for recovery: the newest, and the one before it in case the newest is damaged. And one or two older ones for
//! undo, which replays from a *base*: a snapshot from before the scans in question.
//!
//! ```text
//!          base         next base                  older   newest
//! ----------+--------------+-------------------------+-------+------> revisions
//!           |<--------------- undo_revisions, at least ------------>|
//!           |<--------------------- journal ----------------------->|
//! ```

use super::snapshot_files::Sizes;
use mrol_map::map::WithdrawnChange;

/// Number of snapshots that are kept for recovery: the newest, and one more in case that is damaged.
pub(super) const FOR_RECOVERY: usize = 2;

/// The revisions to keep of `snapshots` (ascending). The journal is kept from the first of them on.
pub(super) fn kept(
    snapshots: &[u64],
    head: u64,
    undo_revisions: u64,
    withdrawn: &[WithdrawnChange],
) -> Vec<u64> {
    let can_be_base = |snapshot: &&u64| is_base(**snapshot, withdrawn);
    let oldest = head.saturating_sub(undo_revisions);
    // Where none is old enough, the oldest that undo can begin with: what is older is of no use to it.
    let base = snapshots.iter().filter(|&&snapshot| snapshot <= oldest).rfind(can_be_base);
    let base = base.or_else(|| snapshots.iter().find(can_be_base));
    // So that the base can move on without all snapshots being kept until then.
    let next = snapshots.iter().filter(|&snapshot| Some(snapshot) > base).find(can_be_base);
    let newest = snapshots.iter().rev().take(FOR_RECOVERY);
    let mut kept: Vec<u64> = base.into_iter().chain(next).chain(newest).copied().collect();
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// How far back undo can go at most.
#[derive(Debug, Clone, Copy)]
pub(super) struct UndoWindow {
    pub(super) revisions: u64,
    /// Bytes of snapshots and journal that nothing else needs, at most.
    pub(super) bytes_max: u64,
}

/// The snapshots to keep within a number of bytes: where undo alone needs more, it can go less far back.
pub(super) fn kept_within(
    snapshots: &[u64],
    head: u64,
    window: UndoWindow,
    withdrawn: &[WithdrawnChange],
    sizes: &Sizes,
) -> Vec<u64> {
    let mut candidates = snapshots;
    loop {
        let kept = kept(candidates, head, window.revisions, withdrawn);
        if candidates.len() <= FOR_RECOVERY || undo_bytes(&kept, sizes) <= window.bytes_max {
            return kept;
        }
        let after_base = candidates.partition_point(|&snapshot| snapshot <= kept[0]);
        candidates = &candidates[after_base.min(candidates.len() - FOR_RECOVERY)..];
    }
}

/// Bytes of the snapshots `kept`, and of the journal from the first of them on, that recovery does not need.
fn undo_bytes(kept: &[u64], sizes: &Sizes) -> u64 {
    let (for_undo, for_recovery) = kept.split_at(kept.len().saturating_sub(FOR_RECOVERY));
    let (Some(&base), Some(&needed)) = (for_undo.first(), for_recovery.first()) else { return 0 };
    let snapshots = for_undo.iter().filter_map(|snapshot| sizes.snapshots.get(snapshot)).sum::<u64>();
    let firsts: Vec<u64> = sizes.segments.keys().copied().collect();
    let is_for_undo = |pair: &&[u64]| pair[1] > base + 1 && pair[1] <= needed + 1;
    let segments = firsts.windows(2).filter(is_for_undo).filter_map(|pair| sizes.segments.get(&pair[0]));
    snapshots + segments.sum::<u64>()
}

/// True when undo can begin with a snapshot: it holds nothing of a scan that was withdrawn later, whose voxels could
/// not be told apart.
pub(super) fn is_base(snapshot: u64, withdrawn: &[WithdrawnChange]) -> bool {
    withdrawn.iter().all(|withdrawn| snapshot < withdrawn.change || withdrawn.revision <= snapshot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_are_kept_for_recovery_and_two_for_undo() {
        let snapshots: Vec<u64> = (0..20).map(|i| i * 10).collect();
        assert_eq!(kept(&snapshots, 195, 0, &[]), [180, 190]);
        assert_eq!(kept(&snapshots, 195, 100, &[]), [90, 100, 180, 190]);
        assert_eq!(kept(&snapshots, 195, 1000, &[]), [0, 10, 180, 190]);
        assert_eq!(kept(&[7], 7, 0, &[]), [7]);
    }

    #[test]
    fn the_base_moves_on_though_those_between_are_dropped() {
        let (mut snapshots, undo) = (vec![0], 100);
        for head in (10..1000).step_by(10) {
            snapshots.push(head);
            snapshots = kept(&snapshots, head, undo, &[]);
            assert!(snapshots.len() <= 4);
            let covered = head - snapshots[0];
            assert!(covered >= undo.min(head) && covered <= 2 * undo + 20, "at {head}: {snapshots:?}");
        }
    }

    #[test]
    fn undo_reaches_less_far_back_where_it_would_take_too_many_bytes() {
        let snapshots: Vec<u64> = (0..10).map(|i| i * 10).collect();
        let sizes = Sizes {
            snapshots: snapshots.iter().map(|&snapshot| (snapshot, 5)).collect(),
            segments: snapshots.iter().map(|&snapshot| (snapshot + 1, 100)).collect(),
        };
        let kept = |bytes_max| {
            let window = UndoWindow { revisions: 1000, bytes_max };
            kept_within(&snapshots, 95, window, &[], &sizes)
        };
        // Two snapshots, and the segments from the first of them to that which recovery begins with.
        assert_eq!(kept(810), [0, 10, 80, 90]);
        assert_eq!(kept(809), [10, 20, 80, 90]);
        assert_eq!(kept(310), [50, 60, 80, 90]);
        assert_eq!(kept(0), [80, 90]);
    }

    #[test]
    fn a_snapshot_that_holds_a_scan_withdrawn_later_is_no_base() {
        let withdrawn = [WithdrawnChange { change: 15, revision: 45 }];
        let bases: Vec<u64> = (1..7).map(|i| i * 10).filter(|&s| is_base(s, &withdrawn)).collect();
        assert_eq!(bases, [10, 50, 60]);
        assert_eq!(kept(&[10, 20, 30, 40, 50, 60, 70], 70, 30, &withdrawn), [10, 50, 60, 70]);
    }

    #[test]
    fn what_is_kept_for_undo_begins_with_a_base_where_there_is_one() {
        let withdrawn = [WithdrawnChange { change: 5, revision: 45 }];
        let snapshots = [10, 20, 30, 50, 60, 70];
        assert_eq!(kept(&snapshots, 70, 1000, &withdrawn), [50, 60, 70]);
        assert_eq!(kept(&[10, 20, 30, 40], 40, 1000, &withdrawn), [30, 40]);
    }
}
