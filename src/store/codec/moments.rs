//! Moments of the points in voxels: gaps between keys, and ten numbers each.

use super::Unreadable;
use crate::store::pb;
use crate::voxel::{MomentSet, Moments};

impl From<&MomentSet> for pb::Moments {
    fn from(set: &MomentSet) -> Self {
        let mut before = 0;
        let key_gaps = set.as_slice().iter().map(|(key, _)| {
            let bits = key.to_bits();
            bits - std::mem::replace(&mut before, bits)
        });
        Self {
            key_gaps: key_gaps.collect(),
            numbers: set.as_slice().iter().flat_map(|(_, moments)| moments.to_numbers()).collect(),
        }
    }
}

impl TryFrom<pb::Moments> for MomentSet {
    type Error = Unreadable;

    fn try_from(message: pb::Moments) -> Result<Self, Unreadable> {
        let (moments, rest) = message.numbers.as_chunks::<{ Moments::NUMBERS }>();
        if moments.len() != message.key_gaps.len() || !rest.is_empty() {
            let (keys, numbers) = (message.key_gaps.len(), message.numbers.len());
            return Err(format!("moments has {keys} key_gaps with {numbers} numbers"));
        }
        let mut bits = 0u64;
        let voxel = |(i, (&gap, &numbers)): (usize, (&u64, &[i64; Moments::NUMBERS]))| {
            if gap == 0 && i > 0 {
                return Err(format!("moments.key_gaps[{i}] is 0: a voxel comes twice"));
            }
            bits =
                bits.checked_add(gap).ok_or_else(|| format!("moments.key_gaps[{i}] is too large: {gap}"))?;
            let key = Self::key(bits).ok_or_else(|| format!("voxel key {bits:#x} is out of range"))?;
            Ok((key, Moments::from_numbers(numbers)))
        };
        message.key_gaps.iter().zip(moments).enumerate().map(voxel).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::VoxelKey;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_set_survives_its_message(keys in prop::collection::btree_set(prop::array::uniform3(-40i32..40), 0..30), numbers: [i64; 10]) {
            let moments = |key: [i32; 3]| (VoxelKey::new(key).unwrap(), Moments::from_numbers(numbers.map(|n| n ^ i64::from(key[0]))));
            let set: MomentSet = keys.into_iter().map(moments).collect();
            prop_assert_eq!(MomentSet::try_from(pb::Moments::from(&set)).unwrap(), set);
        }

        #[test]
        fn numbers_that_are_no_moments_are_an_error_and_never_a_panic(key_gaps: Vec<u64>, numbers: Vec<i64>) {
            let message = pb::Moments { key_gaps, numbers };
            if let Ok(set) = MomentSet::try_from(message.clone()) {
                prop_assert_eq!(pb::Moments::from(&set), message);
            }
        }
    }
}
