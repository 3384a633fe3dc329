//! Sorting that can be stopped.

use super::stop_signal::StopSignal;

/// Items that are sorted between two looks at the stop signal: some ten milliseconds.
const ITEMS_PER_SORT: usize = 256 << 10;

/// Sorts by key, in place, equal keys in any order. Once stopped, the order is any.
pub fn sort_by_key_until<T, K: Ord>(items: &mut [T], key: impl Fn(&T) -> K + Copy, stop: StopSignal<'_>) {
    if stop.is_stopped() {
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
    sort_by_key_until(lower, key, stop);
    sort_by_key_until(upper, key, stop);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

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
}
