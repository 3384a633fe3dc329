//! New keys of a block, with the widest kernel that the machine has.

use super::scalar::keys_gained_scalar;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::{Avx2, Avx512};
use crate::voxel::block::{BLOCK_LEVELS, BlockMask};
use crate::voxel::key::VoxelKey;

impl BlockMask {
    /// Appends to `keys` those of the voxels of `block`, `up` (0, 1 or 2) levels up in it, that are occupied with the
    /// voxels of `added` and were not with these alone.
    #[inline]
    pub(crate) fn keys_gained(&self, added: &Self, block: VoxelKey, up: u32, keys: &mut Vec<u64>) {
        let first = block.first_within(BLOCK_LEVELS - up).to_bits();
        #[cfg(target_arch = "x86_64")]
        if let Some(cpu) = Avx512::detect() {
            return avx512::keys_gained(cpu, self, added, first, up, keys);
        } else if let Some(cpu) = Avx2::detect() {
            return avx2::keys_gained(cpu, self, added, first, up, keys);
        }
        keys_gained_scalar(self, added, first, up, keys);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::block::Cell;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn mask_of(cells: &BTreeSet<u16>) -> BlockMask {
        let mut mask = BlockMask::EMPTY;
        cells.iter().for_each(|&cell| assert!(mask.insert(Cell::from_bits(cell))));
        mask
    }

    /// From no voxel to all of them.
    fn cells() -> impl Strategy<Value = BTreeSet<u16>> {
        let some = prop::collection::btree_set(0u16..512, 0..80);
        let absent = |absent: BTreeSet<u16>| (0..512).filter(|cell| !absent.contains(cell)).collect();
        prop_oneof![3 => some.clone(), 1 => some.prop_map(absent)]
    }

    proptest! {
        #[test]
        fn what_is_gained_are_the_ancestors_of_what_is_added_that_were_not_there(
            before in cells(),
            added in cells(),
            block in prop::array::uniform3(-131_072i32..131_072),
        ) {
            let block = VoxelKey::pack(block);
            let (mask, added_mask) = (mask_of(&before), mask_of(&added));
            for up in 0..BLOCK_LEVELS {
                let voxels = |cells: &BTreeSet<u16>| -> BTreeSet<u64> {
                    let voxel = |&cell| Cell::from_bits(cell).voxel(block).ancestor(up).to_bits();
                    cells.iter().map(voxel).collect()
                };
                // Behind what is there already.
                let mut keys = vec![7];
                mask.keys_gained(&added_mask, block, up, &mut keys);
                let gained: BTreeSet<u64> = keys[1..].iter().copied().collect();
                prop_assert_eq!(gained.len(), keys.len() - 1);
                prop_assert_eq!(gained, voxels(&added).difference(&voxels(&before)).copied().collect());
                let mut scalar = vec![7];
                let first = block.first_within(BLOCK_LEVELS - up).to_bits();
                keys_gained_scalar(&mask, &added_mask, first, up, &mut scalar);
                prop_assert_eq!(&keys, &scalar);
                #[cfg(target_arch = "x86_64")]
                if let Some(cpu) = Avx2::detect() {
                    let mut keys = vec![7];
                    avx2::keys_gained(cpu, &mask, &added_mask, first, up, &mut keys);
                    prop_assert_eq!(keys, scalar);
                }
            }
        }
    }
}
