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
            let moments = Moments::from_numbers(numbers)
                .ok_or_else(|| format!("moments.numbers of voxel {i} are those of no points: {numbers:?}"))?;
            Ok((key, moments))
        };
        message.key_gaps.iter().zip(moments).enumerate().map(voxel).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::VoxelKey;
    use proptest::prelude::*;

    /// Of a few points, or of none.
    fn moments() -> impl Strategy<Value = Moments> {
        prop::collection::vec(prop::array::uniform3(-2048i64..=2048), 0..20).prop_map(|offsets| {
            let mut sum = Moments::default();
            offsets.into_iter().for_each(|offset| sum += Moments::of_offset(offset));
            sum
        })
    }

    proptest! {
        #[test]
        fn a_set_survives_its_message(voxels in prop::collection::btree_map(prop::array::uniform3(-40i32..40), moments(), 0..30)) {
            let set: MomentSet =
                voxels.into_iter().map(|(index, moments)| (VoxelKey::new(index).unwrap(), moments)).collect();
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
