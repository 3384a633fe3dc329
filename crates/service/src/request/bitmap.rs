//! Bits of a request's points, as bytes of its answer.

use bytes::Bytes;

/// The first `points` bits of `words`, as bytes: bit i % 8 (lowest first) of byte i / 8.
pub(crate) fn bitmap(words: Vec<u64>, points: usize) -> Bytes {
    struct Owner(Vec<u64>);
    impl AsRef<[u8]> for Owner {
        fn as_ref(&self) -> &[u8] {
            bytemuck::cast_slice(&self.0)
        }
    }
    let words = if cfg!(target_endian = "big") { words.into_iter().map(u64::to_le).collect() } else { words };
    Bytes::from_owner(Owner(words)).slice(..points.div_ceil(8))
}
