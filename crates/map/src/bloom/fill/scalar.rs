//! The reference implementation.

use crate::bloom::counters::Counters;
use crate::bloom::probe::Probe;
use crate::util::prefetch;

/// Keys whose words and counters are fetched at once: their cache misses are under way together.
pub(super) const AT_ONCE: usize = 16;

/// The reference implementation.
pub(super) fn fill_scalar(plane: &mut [u64], counters: &mut Counters, hashes: u32, keys: &[u64]) {
    for keys in keys.chunks(AT_ONCE) {
        let mut probes = [Probe::default(); AT_ONCE];
        for (probe, &key) in probes.iter_mut().zip(keys) {
            *probe = Probe::of(key, hashes, plane.len());
            prefetch(counters.of_word(probe.word));
            prefetch(&plane[probe.word]);
        }
        for &probe in &probes[..keys.len()] {
            counters.count_in(probe);
            plane[probe.word] |= probe.mask;
        }
    }
}
