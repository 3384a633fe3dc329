//! Arrays of numbers as bytes: little-endian, one after the other.

use bytes::Bytes;

use mrol_map::voxel::VoxelKey;
use mrol_service::{Reason, ServiceError};

/// A number of an array.
pub trait Number: Copy {
    /// Its bytes, little-endian.
    type Bytes: AsRef<[u8]>;

    /// The bytes of this number.
    fn to_bytes(self) -> Self::Bytes;

    /// The numbers of bytes; what is left over at the end makes none.
    fn all_of(bytes: &[u8]) -> Vec<Self>;
}

/// Makes a [`Number`] of each type.
macro_rules! numbers {
    ($($of:ty),+) => {
        $(impl Number for $of {
            type Bytes = [u8; size_of::<$of>()];

            #[inline]
            fn to_bytes(self) -> Self::Bytes {
                self.to_le_bytes()
            }

            fn all_of(bytes: &[u8]) -> Vec<Self> {
                let numbers = bytes.as_chunks::<{ size_of::<$of>() }>().0;
                numbers.iter().map(|bytes| Self::from_le_bytes(*bytes)).collect()
            }
        })+
    };
}

numbers!(f32, u32, u64);

/// The bytes of `numbers`.
pub fn bytes_of<T: Number>(numbers: impl IntoIterator<Item = T>) -> Bytes {
    let numbers = numbers.into_iter();
    let mut bytes = Vec::with_capacity(numbers.size_hint().0 * size_of::<T>());
    numbers.for_each(|number| bytes.extend_from_slice(number.to_bytes().as_ref()));
    bytes.into()
}

/// The numbers of `bytes`, of which there must be `count`.
pub(crate) fn numbers_of<T: Number>(
    bytes: &Bytes,
    count: usize,
    field: &str,
) -> Result<Vec<T>, ServiceError> {
    if Some(bytes.len()) != count.checked_mul(size_of::<T>()) {
        return Err(wrong_length(field, bytes.len(), count, size_of::<T>()));
    }
    Ok(T::all_of(bytes))
}

/// The bytes of the first `count` bits of `words`: bit i is bit i % 8, lowest first, of byte i / 8.
pub fn bitmap_of(words: Vec<u64>, count: usize) -> Bytes {
    bytes_of(words).slice(..count.div_ceil(8))
}

/// The inverse of [`bitmap_of`].
pub(crate) fn words_of(bytes: &Bytes, count: usize, field: &str) -> Result<Vec<u64>, ServiceError> {
    if bytes.len() != count.div_ceil(8) {
        let message = format!("{field} must have a bit for each of {count}, got {} bytes", bytes.len());
        return Err(ServiceError::new(Reason::BadArray, message));
    }
    let word = |bytes: &[u8]| {
        let mut word = [0; size_of::<u64>()];
        word[..bytes.len()].copy_from_slice(bytes);
        u64::from_le_bytes(word)
    };
    Ok(bytes.chunks(size_of::<u64>()).map(word).collect())
}

/// Packed keys, of which there must be `count`.
pub(crate) fn voxels_of(bytes: &Bytes, count: usize, field: &str) -> Result<Vec<VoxelKey>, ServiceError> {
    let key = |(at, bits): (usize, u64)| {
        let none = || {
            ServiceError::new(
                Reason::BadKey,
                format!("{field}[{at}] must have bit 63 clear, got {bits:#018x}"),
            )
        };
        VoxelKey::from_bits(bits).ok_or_else(none)
    };
    numbers_of(bytes, count, field)?.into_iter().enumerate().map(key).collect()
}

fn wrong_length(field: &str, got: usize, count: usize, each: usize) -> ServiceError {
    let message = format!("{field} must have {each} bytes for each of {count}, got {got} bytes");
    ServiceError::new(Reason::BadArray, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn arrays_survive_their_bytes(
            floats in prop::collection::vec(any::<f32>(), 0..40),
            bits in prop::collection::vec(any::<bool>(), 0..200),
        ) {
            let back: Vec<f32> = numbers_of(&bytes_of(floats.clone()), floats.len(), "x").unwrap();
            prop_assert!(back.iter().zip(&floats).all(|(a, b)| a.to_bits() == b.to_bits()));
            let mut words = vec![0u64; bits.len().div_ceil(64)];
            bits.iter().enumerate().for_each(|(i, &bit)| words[i / 64] |= u64::from(bit) << (i % 64));
            let bytes = bitmap_of(words.clone(), bits.len());
            prop_assert_eq!(bytes.len(), bits.len().div_ceil(8));
            prop_assert_eq!(words_of(&bytes, bits.len(), "x").unwrap(), words);
        }
    }

    #[test]
    fn arrays_of_another_length_are_refused_by_name() {
        let bytes = Bytes::from_static(&[0; 9]);
        for error in [
            numbers_of::<f32>(&bytes, 2, "distances").unwrap_err(),
            voxels_of(&bytes, 1, "distances").unwrap_err(),
            words_of(&bytes, 65 + 8, "distances").unwrap_err(),
        ] {
            assert!(error.message.starts_with("distances must have"), "{error}");
        }
        let key = Bytes::copy_from_slice(&(1u64 << 63).to_le_bytes());
        assert!(voxels_of(&key, 1, "voxels").unwrap_err().message.contains("bit 63"));
    }
}
