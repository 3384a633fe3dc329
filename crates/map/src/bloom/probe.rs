//! Where a key's bits lie: one word of the plane, k bits of it.

/// What the halves of a key are multiplied by, for the word and for the bits there.
pub(crate) const HASH_WORD: [u32; 2] = [0x9e37_79b1, 0xc2b2_ae3e];
pub(crate) const HASH_BITS: [u32; 2] = [0x27d4_eb2f, 0x1656_67b1];
const _: () = assert!(
    (HASH_WORD[0] & HASH_BITS[1] ^ HASH_WORD[1] & HASH_BITS[0]) & 1 == 1,
    "an odd determinant: no two keys agree in both sums"
);
/// Odd: what mixes the sum that the word is taken from.
pub(crate) const HASH_MIX: u32 = 0x85eb_ca77;
/// Odd: from the first bits of a key to further ones.
pub(crate) const HASH_NEXT: u32 = 0xf135_7aeb;
/// How many bits of a word one hash of 32 bits selects, six of it each.
pub(crate) const BITS_OF_HASH: u32 = 5;

/// A key's word of the bit plane and its bits there.
///
/// ```text
/// u    = low * A + high * B           the key's halves; all in 32 bits
/// h    = (u ^ u >> 16) * MIX
/// word = h * words >> 32              any number of words, no remainder
/// g    = low * C + high * D           k bits from its top:
/// bit  = g >> 26, g << 6 >> 26, ...   6 bits of g for each hash; after five of them, of g * NEXT
/// ```
///
/// All k bits lie in one word (a *blocked* filter), so that a look-up is one load. The paper's two hashes
/// `5381 * 33 ^ key` and `2166136261 * 16777619 ^ key` differ by a constant: where the table's size is a power
/// of two their two positions collapse into one, and neighboring keys fall on neighboring counters. A hash
/// that mixes is as good at every size; one of 32 bits takes a register of sixteen keys where one of 64 takes two.
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
        let halves = [key as u32, (key >> 32) as u32];
        let sum = |by: [u32; 2]| halves[0].wrapping_mul(by[0]).wrapping_add(halves[1].wrapping_mul(by[1]));
        let u = sum(HASH_WORD);
        let h = (u ^ u >> 16).wrapping_mul(HASH_MIX);
        let word = ((u64::from(h) * words as u64) >> 32) as usize;
        let (mut g, mut mask) = (sum(HASH_BITS), 0);
        let mut next = g.wrapping_mul(HASH_NEXT);
        for i in 0..hashes {
            if i == BITS_OF_HASH {
                std::mem::swap(&mut g, &mut next);
            }
            mask |= 1 << (g >> 26);
            g <<= 6;
        }
        Self { word, mask }
    }
}
