//! Words that are mixed into a hash.

/// A word mixed by the output function of SplitMix64 (Steele, Lea, Flood, *Fast splittable pseudorandom number
/// generators*, OOPSLA 2014). Different words stay different.
pub fn mixed(word: u64) -> u64 {
    let z = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

/// A hash of words in their order. It is the same on every machine, and no guard against somebody who looks for two
/// lists of words with the same hash.
#[derive(Debug, Clone, Copy, Default)]
pub struct Digest(u64);

impl Digest {
    /// With one more word.
    #[must_use]
    pub fn word(self, word: u64) -> Self {
        Self(mixed(self.0 ^ word))
    }

    /// With one more number. Both zeros count as the same, as they are equal.
    #[must_use]
    pub fn number(self, number: f64) -> Self {
        self.word(if number == 0.0 { 0 } else { number.to_bits() })
    }

    /// With each of some numbers.
    #[must_use]
    pub fn numbers(self, numbers: &[f64]) -> Self {
        numbers.iter().fold(self, |digest, &number| digest.number(number))
    }

    /// With how many bytes there are, and all of them.
    #[must_use]
    pub fn bytes(self, bytes: &[u8]) -> Self {
        let (words, rest) = bytes.as_chunks();
        let digest = self.word(bytes.len() as u64);
        let digest = words.iter().fold(digest, |digest, word| digest.word(u64::from_le_bytes(*word)));
        let rest = rest.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte));
        digest.word(rest)
    }

    /// The hash.
    pub fn finish(self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_mixed_as_splitmix64_does() {
        // The first outputs of the published generator from the seeds 0 and 1.
        assert_eq!(mixed(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(mixed(1), 0x910a_2dec_8902_5cc1);
    }

    #[test]
    fn every_byte_counts_and_so_does_their_order() {
        let bytes: Vec<u8> = (1..=19).collect();
        let hash = |bytes: &[u8]| Digest::default().bytes(bytes).finish();
        for i in 0..bytes.len() {
            let mut other = bytes.clone();
            other[i] ^= 0x80;
            assert_ne!(hash(&other), hash(&bytes), "byte {i}");
            assert_ne!(hash(&bytes[..i]), hash(&bytes), "{i} bytes");
        }
        assert_ne!(hash(&[1, 2]), hash(&[2, 1]));
        assert_ne!(hash(&[0]), hash(&[0, 0]));
    }

    #[test]
    fn both_zeros_are_the_same_number() {
        let hash = |number| Digest::default().number(number).finish();
        assert_eq!(hash(-0.0), hash(0.0));
        assert_ne!(hash(1.0), hash(-1.0));
    }
}
