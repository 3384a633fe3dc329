//! How many false positives to expect, and the settings that decide it.

use super::probe::BITS_OF_HASH;

/// Most hash functions a filter may have: each takes 6 bits of one of two hashes of 32.
pub const HASHES_MAX: u32 = 2 * BITS_OF_HASH;
const BITS_PER_KEY_MIN: f64 = 1.0;
const BITS_PER_KEY_MAX: f64 = 4096.0;
const WORD_BITS: f64 = 64.0;

/// Size and shape of a filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterSettings {
    /// Hash functions, k of eq. (1): 1 to [`HASHES_MAX`]. Default 2, as in the paper.
    pub hashes: u32,
    /// Bits of the plane for each key that the filter is sized for, m / n of eq. (1). Default 14: 1.75 bytes
    /// a voxel for the plane and 7 for its counters, for about 2 % of false positives just before growth.
    pub bits_per_key: f64,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self { hashes: 2, bits_per_key: 14.0 }
    }
}

/// Why numbers cannot shape a filter.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FilterSettingsError {
    /// Number of hash functions out of range.
    #[error("filter_hashes must lie in 1..={HASHES_MAX}, got {0}")]
    Hashes(u32),
    /// Bits a key out of range.
    #[error("filter_bits_per_key must lie in {BITS_PER_KEY_MIN}..={BITS_PER_KEY_MAX}, got {0}")]
    BitsPerKey(f64),
}

impl FilterSettings {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the number out of range and the range.
    pub fn checked(self) -> Result<Self, FilterSettingsError> {
        if !(1..=HASHES_MAX).contains(&self.hashes) {
            return Err(FilterSettingsError::Hashes(self.hashes));
        }
        if !(BITS_PER_KEY_MIN..=BITS_PER_KEY_MAX).contains(&self.bits_per_key) {
            return Err(FilterSettingsError::BitsPerKey(self.bits_per_key));
        }
        Ok(self)
    }

    /// Words of a plane sized for `keys` keys: at least one.
    pub(crate) fn words(&self, keys: usize) -> usize {
        ((keys as f64 * self.bits_per_key / WORD_BITS).ceil() as usize).max(1)
    }
}

/// Eq. (1) of the paper: the false positive rate of `keys` keys in `bits` bits with `hashes` hash functions
/// that may fall anywhere, (1 - (1 - 1/m)^(kn))^k.
pub fn ideal_false_positive_rate(keys: usize, bits: usize, hashes: u32) -> f64 {
    let hits = f64::from(hashes) * keys as f64;
    (1.0 - (1.0 - 1.0 / bits as f64).powf(hits)).powi(hashes as i32)
}

/// The false positive rate of the layout used here, where a key's bits share one 64-bit word.
///
/// The keys of a word are Poisson distributed about n / words. Given i of them, a bit of the word is set with
/// p_i = 1 - (1 - 1/64)^(ki); an absent key whose k draws hit d distinct bits is taken for present with
/// probability p_i^d. So the rate is sum_i Poisson(i) sum_d P(d) p_i^d: eq. (1), averaged over how unevenly
/// words fill and over draws that coincide.
pub fn expected_rate(keys: usize, words: usize, hashes: u32) -> f64 {
    let mean = keys as f64 / words as f64;
    let distinct = distinct_draws(hashes);
    let rate_given = |i: f64| {
        let p = 1.0 - (1.0 - 1.0 / WORD_BITS).powf(f64::from(hashes) * i);
        distinct.iter().enumerate().map(|(d, chance)| chance * p.powi(d as i32)).sum::<f64>()
    };
    // The Poisson terms in logarithms, so that a crowded word (a mean of hundreds) does not underflow.
    let last = (mean + 12.0 * mean.sqrt() + 20.0) as usize;
    let mut ln_chance = -mean;
    let mut rate = 0.0;
    for i in 1..=last {
        ln_chance += mean.ln() - (i as f64).ln();
        rate += ln_chance.exp() * rate_given(i as f64);
    }
    if keys == 0 { 0.0 } else { rate }
}

/// P(d) = the chance that `hashes` draws of 64 bits hit d distinct ones, for d = 0 ..= hashes.
fn distinct_draws(hashes: u32) -> Vec<f64> {
    let mut chances = vec![0.0; hashes as usize + 1];
    chances[0] = 1.0;
    for _ in 0..hashes {
        for d in (0..chances.len()).rev() {
            let repeat = chances[d] * d as f64 / WORD_BITS;
            let fresh = if d > 0 { chances[d - 1] * (1.0 - (d as f64 - 1.0) / WORD_BITS) } else { 0.0 };
            chances[d] = repeat + fresh;
        }
    }
    chances
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equation_1_gives_the_papers_own_rate() {
        // 142,812 voxels in 6,000,000 counters with two hashes.
        let rate = ideal_false_positive_rate(142_812, 6_000_000, 2);
        assert!((rate - 0.00216).abs() < 1e-4, "{rate}");
    }

    #[test]
    fn a_blocked_filter_pays_a_little_for_its_single_load() {
        for (hashes, bits_per_key) in [(2, 13.4), (2, 27.0), (3, 14.0), (5, 200.0)] {
            let keys = 100_000;
            let words = FilterSettings { hashes, bits_per_key }.words(keys);
            let blocked = expected_rate(keys, words, hashes);
            let free = ideal_false_positive_rate(keys, words * 64, hashes);
            assert!(blocked > free, "k {hashes}, {bits_per_key} bits: {blocked} against {free}");
        }
    }

    #[test]
    fn the_closed_form_holds_from_empty_to_overfull() {
        assert_eq!(expected_rate(0, 10, 2), 0.0);
        assert!((expected_rate(1_000_000, 10, 2) - 1.0).abs() < 1e-6);
        let chances: f64 = distinct_draws(7).iter().sum();
        assert!((chances - 1.0).abs() < 1e-12);
    }

    #[test]
    fn settings_out_of_range_are_named() {
        let hashes = FilterSettings { hashes: 11, ..Default::default() }.checked().unwrap_err();
        assert!(hashes.to_string().contains("filter_hashes"));
        let bits = FilterSettings { bits_per_key: f64::NAN, ..Default::default() }.checked().unwrap_err();
        assert!(bits.to_string().contains("filter_bits_per_key"));
    }
}
