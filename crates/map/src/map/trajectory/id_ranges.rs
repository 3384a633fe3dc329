//! Ids that were accepted once and whose scans are no longer kept.

use std::sync::Arc;

/// Ranges of ids that a map remembers of one session's forgotten scans, at most: 64 KiB. Beyond, the two of the
/// smallest ids become one, with the gap between them: an id from there counts as accepted, whether it was or not.
pub const ID_RANGES_PER_SESSION_MAX: usize = 4096;

/// Sorted ranges of ids, both ends within, with a gap between any two.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct IdRanges(Arc<Vec<(u64, u64)>>);

impl IdRanges {
    pub(super) fn as_slice(&self) -> &[(u64, u64)] {
        &self.0
    }

    pub(super) fn contains(&self, id: u64) -> bool {
        let at = self.0.partition_point(|&(_, last)| last < id);
        self.0.get(at).is_some_and(|&(first, _)| first <= id)
    }

    /// Adds the ids `first..=last`.
    pub(super) fn insert(&mut self, first: u64, last: u64) {
        if first > last {
            return;
        }
        let ranges = Arc::make_mut(&mut self.0);
        // Those that it meets, or that begin or end next to it.
        let begin = ranges.partition_point(|&(_, end)| end < first && first - end > 1);
        let end = ranges.partition_point(|&(start, _)| start <= last || start - last == 1);
        let met = ranges.get(begin..end).unwrap_or_default();
        let first = met.first().map_or(first, |&(start, _)| start.min(first));
        let last = met.last().map_or(last, |&(_, end)| end.max(last));
        ranges.splice(begin..end.max(begin), [(first, last)]);
        if ranges.len() > ID_RANGES_PER_SESSION_MAX {
            ranges[1].0 = ranges[0].0;
            ranges.remove(0);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<(u64, u64)>()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn ranges_hold_what_was_put_in_and_nothing_else(
            ids in prop::collection::vec((0..400u64, 0..6u64), 0..200),
        ) {
            let (mut ranges, mut model) = (IdRanges::default(), BTreeSet::new());
            for (first, more) in ids {
                ranges.insert(first, first + more);
                model.extend(first..=first + more);
                prop_assert!(ranges.as_slice().windows(2).all(|pair| pair[0].1 + 1 < pair[1].0));
                prop_assert!((0..420).all(|id| ranges.contains(id) == model.contains(&id)));
            }
        }
    }

    #[test]
    fn ranges_reach_to_both_ends_of_the_numbers() {
        let mut ranges = IdRanges::default();
        for id in [u64::MAX, 0, u64::MAX - 1, 1, 5] {
            ranges.insert(id, id);
        }
        assert_eq!(ranges.as_slice(), [(0, 1), (5, 5), (u64::MAX - 1, u64::MAX)]);
    }

    #[test]
    fn beyond_the_bound_the_oldest_ranges_take_their_gap_in() {
        let mut ranges = IdRanges::default();
        let most = ID_RANGES_PER_SESSION_MAX as u64;
        (0..most).for_each(|n| ranges.insert(n * 10, n * 10));
        assert_eq!(ranges.as_slice().len(), ID_RANGES_PER_SESSION_MAX);
        assert!(!ranges.contains(5));
        ranges.insert(most * 10, most * 10);
        assert_eq!(ranges.as_slice().len(), ID_RANGES_PER_SESSION_MAX);
        assert!(ranges.contains(5) && !ranges.contains(15) && ranges.contains(most * 10));
    }
}
