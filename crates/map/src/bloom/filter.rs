//! The counting Bloom filter (paper II-A).

use super::counters::{COUNTER_MAX, Counters, CountersOfWord};
use super::fill::fill;
use super::probe::Probe;
use super::rates::{FilterSettings, expected_rate, ideal_false_positive_rate};

/// A set of u64 keys that may answer "present" of an absent key, and never "absent" of a present one.
///
/// ```text
/// plane     [ word 0: 64 bits ][ word 1 ]...     hot: all that a look-up reads
/// counters  [ 4 words of 16 x 4 bits ]...        cold: how many keys set each bit, for removal
/// ```
///
/// A bit is set where its counter is not zero. A change has two steps, so that a writer that shares the filter with
/// readers takes the first one beside them: *counting*, and then setting or clearing the plane's bits.
#[derive(Debug)]
pub struct CountingBloomFilter {
    plane: Vec<u64>,
    counters: Counters,
    settings: FilterSettings,
    keys: usize,
    capacity: usize,
}

impl CountingBloomFilter {
    /// An empty filter of one word that is sized for no key: to be replaced by a larger one before the first comes.
    pub fn without_room(settings: FilterSettings) -> Self {
        Self { plane: vec![0; 1], counters: Counters::zero(1), settings, keys: 0, capacity: 0 }
    }

    /// An empty filter sized for `capacity` keys.
    pub fn with_capacity(capacity: usize, settings: FilterSettings) -> Self {
        let words = settings.words(capacity);
        Self {
            plane: vec![0; words],
            counters: Counters::zero(words),
            settings,
            keys: 0,
            capacity: capacity.max(1),
        }
    }

    /// True when `key` may be present; false means that it is absent.
    #[inline]
    pub fn contains(&self, key: u64) -> bool {
        let probe = self.probe(key);
        self.plane[probe.word] & probe.mask == probe.mask
    }

    /// Adds a key that is absent.
    #[inline]
    pub fn insert(&mut self, key: u64) {
        let probe = self.probe(key);
        let counted = self.count_in(probe);
        self.set_bits(counted);
    }

    /// Adds keys that are absent.
    pub fn insert_each(&mut self, keys: &[u64]) {
        self.keys += keys.len();
        fill(&mut self.plane, &mut self.counters, self.settings.hashes, keys);
    }

    /// Takes out a key that is present: confirm that in the exact set first (paper II-A). Removing a key that
    /// was never inserted would take away what other keys rely on.
    #[inline]
    pub fn remove(&mut self, key: u64) {
        let probe = self.probe(key);
        debug_assert!(self.contains(key), "a key is removed that was never inserted");
        let cleared = self.count_out(probe);
        self.clear_bits(cleared);
    }

    /// The first step of adding an absent key: it counts, and look-ups do not see it yet. The bits to set. One
    /// thread at a time.
    #[inline]
    pub(crate) fn count_in(&self, probe: Probe) -> Probe {
        self.counters.count_in(probe);
        probe
    }

    /// The second step of an insertion: sets the bits of the plane that look-ups read.
    #[inline]
    pub(crate) fn set_bits(&mut self, probe: Probe) {
        self.keys += 1;
        self.plane[probe.word] |= probe.mask;
    }

    /// The first step of taking a present key out: it counts no more, and look-ups still see it. The bits that no
    /// other key sets. One thread at a time.
    #[inline]
    pub(crate) fn count_out(&self, probe: Probe) -> Probe {
        Probe { mask: self.counters.count_out(probe), ..probe }
    }

    /// The second step of a removal: clears the bits of the plane that no other key sets.
    #[inline]
    pub(crate) fn clear_bits(&mut self, cleared: Probe) {
        self.keys -= 1;
        self.plane[cleared.word] &= !cleared.mask;
    }

    /// The second step of a removal of many keys at once: a plane without the bits that none but `keys_lost` keys set,
    /// all of them counted out, takes the place of the present one.
    pub(crate) fn set_plane(&mut self, plane: Vec<u64>, keys_lost: usize) {
        debug_assert_eq!(plane.len(), self.plane.len(), "the plane of another filter");
        self.keys -= keys_lost;
        self.plane = plane;
    }

    /// The word of the plane that a change at `probe` touches.
    #[inline]
    pub(crate) fn plane_at(&self, probe: Probe) -> &u64 {
        &self.plane[probe.word]
    }

    /// The counters of the word that a probe looks at.
    #[inline]
    pub(crate) fn counters_at(&self, probe: Probe) -> &CountersOfWord {
        self.counters.of_word(probe.word)
    }

    /// Where `key` is, or would be.
    #[inline(always)]
    pub(crate) fn probe(&self, key: u64) -> Probe {
        Probe::of(key, self.settings.hashes, self.plane.len())
    }

    /// Number of keys.
    pub fn len(&self) -> usize {
        self.keys
    }

    /// True without a key.
    pub fn is_empty(&self) -> bool {
        self.keys == 0
    }

    /// Number of keys that the filter is sized for.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// The size and shape of the filter.
    pub fn settings(&self) -> FilterSettings {
        self.settings
    }

    /// The bit plane, for the look-up kernels.
    pub fn plane(&self) -> &[u64] {
        &self.plane
    }

    /// Bytes of memory held: (plane, counters).
    pub fn bytes(&self) -> (usize, usize) {
        (size_of_val(&self.plane[..]), self.counters.bytes())
    }

    /// Number of counters that are neither zero nor saturated, and of those that are saturated.
    pub fn counters_in_use(&self) -> (usize, usize) {
        let saturated = self.counters.iter().filter(|&count| count == COUNTER_MAX).count();
        (self.counters.iter().filter(|&count| count != 0).count() - saturated, saturated)
    }

    /// True when the filter holds exactly `keys`: each counter that is not saturated equals a recount, and the
    /// plane follows from the counters.
    pub fn is_recount_of(&self, keys: impl IntoIterator<Item = u64>) -> bool {
        let words = self.plane.len();
        let mut recount = Self { plane: vec![0; words], counters: Counters::zero(words), keys: 0, ..*self };
        keys.into_iter().for_each(|key| recount.insert(key));
        let bits = 0..self.plane.len() * u64::BITS as usize;
        self.keys == recount.keys && { bits }.all(|bit| {
            let (word, bit) = (bit / u64::BITS as usize, bit as u32 % u64::BITS);
            let (count, set) = (self.counters.of_bit(word, bit), self.plane[word] >> bit & 1 == 1);
            (count == COUNTER_MAX || count == recount.counters.of_bit(word, bit)) && set == (count != 0)
        })
    }

    /// The false positive rate to expect of this layout as it is filled now; see [`expected_rate`].
    pub fn expected_rate(&self) -> f64 {
        expected_rate(self.keys, self.plane.len(), self.settings.hashes)
    }

    /// What eq. (1) of the paper gives for as many keys, bits and hashes.
    pub fn ideal_false_positive_rate(&self) -> f64 {
        ideal_false_positive_rate(self.keys, self.plane.len() * u64::BITS as usize, self.settings.hashes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bloom::rates::HASHES_MAX;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn filter_of(keys: impl Iterator<Item = u64> + Clone, settings: FilterSettings) -> CountingBloomFilter {
        let mut filter = CountingBloomFilter::with_capacity(keys.clone().count(), settings);
        keys.for_each(|key| filter.insert(key));
        filter
    }

    proptest! {
        #[test]
        fn a_filter_never_denies_a_key_and_forgets_the_removed(
            keys in prop::collection::btree_set(any::<u64>(), 1..300),
            removed in prop::collection::vec(any::<prop::sample::Index>(), 0..200),
            hashes in 1u32..=HASHES_MAX,
        ) {
            let settings = FilterSettings { hashes, bits_per_key: 8.0 };
            let mut filter = filter_of(keys.iter().copied(), settings);
            let mut left: BTreeSet<u64> = keys.clone();
            let order: Vec<u64> = keys.iter().copied().collect();
            for index in removed {
                let key = *index.get(&order);
                if left.remove(&key) {
                    filter.remove(key);
                }
            }
            prop_assert!(left.iter().all(|&key| filter.contains(key)));
            prop_assert!(filter.is_recount_of(left.iter().copied()));
            prop_assert!(left.is_empty() || !filter.is_recount_of(left.iter().copied().skip(1)));
        }
    }

    #[test]
    fn a_saturated_counter_stays_and_the_others_go_to_zero() {
        let settings = FilterSettings { hashes: 1, bits_per_key: 1.0 };
        let mut filter = CountingBloomFilter::with_capacity(64, settings);
        (0..10_000).for_each(|key| filter.insert(key));
        let (_, saturated) = filter.counters_in_use();
        assert!(saturated > 32);
        (0..10_000).for_each(|key| filter.remove(key));
        assert_eq!(filter.counters_in_use(), (0, saturated));
        assert_eq!(filter.plane[0].count_ones() as usize, saturated);
    }

    /// Keys as a map's are: a wavy sheet of voxels, packed.
    fn sheet(height: u64) -> impl Iterator<Item = u64> + Clone {
        (0..200u64 * 200).map(move |i| {
            let (x, y) = (i % 200, i / 200);
            x | y << 21 | (height + (x * x + y) / 100 % 30) << 42
        })
    }

    #[test]
    fn measured_false_positives_match_the_closed_form_at_every_size() {
        // Powers of two among them, where the paper's pair of hashes collapses (80 % measured).
        for (hashes, words) in [(1, 4096), (2, 8192), (2, 9000), (2, 65_536), (3, 9000), (4, 8191), (8, 8192)]
        {
            let settings = FilterSettings { hashes, bits_per_key: (words as f64 - 0.5) * 64.0 / 40_000.0 };
            let filter = filter_of(sheet(0), settings);
            assert_eq!(filter.plane.len(), words);
            let absent = (1..80).flat_map(|layer| sheet(30 * layer));
            let found = absent.filter(|&key| filter.contains(key)).count();
            let ratio = found as f64 / (79.0 * 40_000.0) / filter.expected_rate();
            assert!((0.7..1.2).contains(&ratio), "k {hashes}, {words} words: {ratio} of the closed form");
        }
    }
}
