//! Where a key's bits lie: one word of the plane, k bits of it.

pub(crate) const HASH_A: u64 = 0x9e37_79b9_7f4a_7c15;
pub(crate) const HASH_B: u64 = 0xd1b5_4a32_d192_ed03;
/// Odd and of 32 bits, so that the product with 32 bits is one widening multiply in every instruction set.
pub(crate) const HASH_C: u64 = 0xf135_7aeb;

/// A key's word of the bit plane and its bits there.
///
/// ```text
/// h    = mix(key)                     the key times A, folded, times B
/// word = high32(h) * words >> 32      any number of words, no remainder
/// g    = low32(h) * C                 k bits from its top:
/// bit  = g >> 58, g << 6 >> 58, ...   6 bits of g for each hash
/// ```
///
/// All k bits lie in one word (a *blocked* filter), so that a look-up is one load. The paper's two hashes
/// `5381 * 33 ^ key` and `2166136261 * 16777619 ^ key` differ by a constant: where the table's size is a power
/// of two their two positions collapse into one, and neighbouring keys fall on neighbouring counters. A hash
/// that mixes is as good at every size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Probe {
    /// Which word of the plane.
    pub word: usize,
    /// The bits of that word which are all set where the key is present.
    pub mask: u64,
}

impl Probe {
    /// The probe of `key` with `hashes` hashes in a plane of `words` words (less than 2^32).
    #[inline(always)]
    pub fn of(key: u64, hashes: u32, words: usize) -> Self {
        let h = key.wrapping_mul(HASH_A);
        let h = (h ^ h >> 32).wrapping_mul(HASH_B);
        let word = (((h >> 32) * words as u64) >> 32) as usize;
        let mut g = (h & 0xffff_ffff) * HASH_C;
        let mut mask = 0;
        for _ in 0..hashes {
            mask |= 1 << (g >> 58);
            g <<= 6;
        }
        Self { word, mask }
    }
}
