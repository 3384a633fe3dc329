//! Sorting that can be stopped.

use super::stop_signal::StopSignal;

/// Items that are sorted between two looks at the stop signal: some ten milliseconds.
const ITEMS_PER_SORT: usize = 256 << 10;

/// Sorts by key, in place, equal keys in any order. Once stopped, the order is any.
pub fn sort_by_key_until<T, K: Ord>(items: &mut [T], key: impl Fn(&T) -> K + Copy, stop: StopSignal<'_>) {
    sort_while(items, key, &|| !stop.is_stopped());
}

/// [`sort_by_key_until`] that lets other work go first between its parts: for callers that hold no lock.
pub fn sort_by_key_giving_way<T, K: Ord>(
    items: &mut [T],
    key: impl Fn(&T) -> K + Copy,
    stop: StopSignal<'_>,
) {
    let goes_on = || {
        stop.give_way();
        !stop.is_stopped()
    };
    sort_while(items, key, &goes_on);
}

fn sort_while<T, K: Ord>(items: &mut [T], key: impl Fn(&T) -> K + Copy, goes_on: &dyn Fn() -> bool) {
    if !goes_on() {
        return;
    }
    // What is in order already is known in one pass.
    if items.len() <= ITEMS_PER_SORT || items.is_sorted_by_key(key) {
        items.sort_unstable_by_key(key);
        return;
    }
    let middle = items.len() / 2;
    items.select_nth_unstable_by_key(middle, key);
    let (lower, upper) = items.split_at_mut(middle);
    sort_while(lower, key, goes_on);
    sort_while(upper, key, goes_on);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::util::GiveWay;
    use std::cell::Cell;
    use std::time::Duration;

    #[test]
    fn items_are_sorted_with_looks_in_proportion_to_their_number() {
        for count in [0, 1, 1000, 3_000_000u64] {
            let mut items: Vec<u64> =
                (0..count).map(|i| i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 44).collect();
            let looks = Cell::new(0);
            let count_look = || looks.replace(looks.get() + 1) == usize::MAX;
            sort_by_key_until(&mut items, |&item| item, StopSignal::when(&count_look));
            assert!(items.is_sorted());
            assert!(items.len() / looks.get() <= ITEMS_PER_SORT, "{count} items, {} looks", looks.get());
        }
    }

    /// Counts how often work lets other work go first.
    struct Counted(Cell<usize>);

    impl GiveWay for Counted {
        fn is_due(&self) -> bool {
            true
        }

        fn give_way(&self) {
            self.0.set(self.0.get() + 1);
        }

        fn paused_for(&self) -> Duration {
            Duration::ZERO
        }
    }

    #[test]
    fn others_go_first_between_the_parts_where_that_is_asked_for_and_not_elsewhere() {
        let mut items: Vec<u64> = (0..3_000_000).rev().collect();
        let turns = Counted(Cell::new(0));
        let stop = StopSignal::NEVER.giving_way_by(&turns);
        sort_by_key_until(&mut items.clone(), |&item| item, stop);
        assert_eq!(turns.0.get(), 0);
        sort_by_key_giving_way(&mut items, |&item| item, stop);
        assert!(items.is_sorted() && turns.0.get() >= 3_000_000 / ITEMS_PER_SORT);
    }
}
