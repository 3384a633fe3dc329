//! The counters of a counting Bloom filter (paper II-A).

use std::sync::atomic::{AtomicU64, Ordering};

use super::probe::Probe;
use crate::util::bits::for_each_bit;

/// A counter that reached this value no longer counts: it stays until the filter is rebuilt.
pub(super) const COUNTER_MAX: u64 = 15;
const COUNTER_BITS: u32 = 4;
const COUNTERS_PER_WORD: u32 = u64::BITS / COUNTER_BITS;

/// The counters of one word of the plane.
pub(crate) type CountersOfWord = [AtomicU64; COUNTER_BITS as usize];

/// How many keys set each bit of a plane.
///
/// Four bits each are ample: at the default size a counter reaches 15 about never, and one that does *saturates*: it
/// is never decremented again, so that the filter may forget to forget but never denies a key. (Counters of a byte
/// that wrap, as in the original code, do.)
///
/// Look-ups read the plane alone. So a map counts while they go on, through a shared reference, and keeps them
/// waiting for the plane's bits only; one thread counts at a time, and needs no atomic addition.
#[derive(Debug)]
pub(super) struct Counters(Vec<CountersOfWord>);

impl Counters {
    /// All zero, for a plane of `words` words.
    pub(super) fn zero(words: usize) -> Self {
        Self(std::iter::repeat_with(Default::default).take(words).collect())
    }

    /// One key more at `probe`.
    #[inline]
    pub(super) fn count_in(&self, probe: Probe) {
        let counters = &self.0[probe.word];
        for_each_bit(probe.mask, |bit| {
            let (part, shift) = place_of(bit);
            let now = counters[part].load(Ordering::Relaxed);
            // No branch: what a counter holds is not foreseen.
            let may_count = now >> shift & COUNTER_MAX != COUNTER_MAX;
            counters[part].store(now + (u64::from(may_count) << shift), Ordering::Relaxed);
        });
    }

    /// One key fewer at `probe`; the bits that no key sets any more.
    #[inline]
    pub(super) fn count_out(&self, probe: Probe) -> u64 {
        let (counters, mut cleared) = (&self.0[probe.word], 0);
        for_each_bit(probe.mask, |bit| {
            let (part, shift) = place_of(bit);
            let now = counters[part].load(Ordering::Relaxed);
            let count = now >> shift & COUNTER_MAX;
            let counts = count != COUNTER_MAX;
            counters[part].store(now - (u64::from(counts) << shift), Ordering::Relaxed);
            cleared |= u64::from(count == 1) << bit;
        });
        cleared
    }

    /// The counter of `bit` of the plane's `word`.
    pub(super) fn of_bit(&self, word: usize, bit: u32) -> u64 {
        let (part, shift) = place_of(bit);
        self.0[word][part].load(Ordering::Relaxed) >> shift & COUNTER_MAX
    }

    /// All counters, in order.
    pub(super) fn iter(&self) -> impl Iterator<Item = u64> {
        (0..self.0.len()).flat_map(move |word| (0..u64::BITS).map(move |bit| self.of_bit(word, bit)))
    }

    /// The counters of a word of the plane.
    #[inline]
    pub(super) fn of_word(&self, word: usize) -> &CountersOfWord {
        &self.0[word]
    }

    /// The counters of a word of the plane, to be changed.
    #[cfg(target_arch = "x86_64")]
    #[inline]
    pub(super) fn of_word_mut(&mut self, word: usize) -> &mut CountersOfWord {
        &mut self.0[word]
    }

    /// Bytes of memory held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }
}

/// Where the counter of a bit of a word lies: in which word of the counters, and how far up.
#[inline(always)]
fn place_of(bit: u32) -> (usize, u32) {
    ((bit / COUNTERS_PER_WORD) as usize, bit % COUNTERS_PER_WORD * COUNTER_BITS)
}
