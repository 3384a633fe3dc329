//! Encoding of voxel sets: gaps between block keys, and each block as an octree of three levels.

use super::unreadable::Unreadable;
use crate::pb;
use mrol_map::util::StopSignal;
use mrol_map::voxel::{BLOCKS_PER_STOP_CHECK, BlockMask, VoxelKey, VoxelSet};

impl From<&VoxelSet> for pb::Voxels {
    fn from(voxels: &VoxelSet) -> Self {
        write(voxels, StopSignal::NEVER)
    }
}

impl TryFrom<pb::Voxels> for VoxelSet {
    type Error = Unreadable;

    fn try_from(voxels: pb::Voxels) -> Result<Self, Unreadable> {
        read(&voxels, StopSignal::NEVER)
    }
}

/// The message of a set; incomplete once stopped.
pub(crate) fn write(voxels: &VoxelSet, stop: StopSignal<'_>) -> pb::Voxels {
    let (mut before, count) = (0, voxels.blocks().len());
    let (mut key_gaps, mut octrees) = (Vec::with_capacity(count), Vec::with_capacity(count * 16));
    for (key, mask) in stop.pieces(voxels.blocks(), BLOCKS_PER_STOP_CHECK).flatten() {
        let bits = key.to_bits();
        key_gaps.push(bits - std::mem::replace(&mut before, bits));
        write_octree(mask, &mut octrees);
    }
    pb::Voxels { key_gaps, octrees: octrees.into() }
}

/// Reads a set: the inverse of [`write`].
pub(crate) fn read(voxels: &pb::Voxels, stop: StopSignal<'_>) -> Result<VoxelSet, Unreadable> {
    if voxels.key_gaps.is_empty() && !voxels.octrees.is_empty() {
        return Err(format!("voxels.octrees has {} bytes, and there is no block", voxels.octrees.len()));
    }
    let mut blocks = Vec::with_capacity(voxels.key_gaps.len());
    for block in stop.paced(blocks_of(voxels), BLOCKS_PER_STOP_CHECK) {
        blocks.push(block?);
    }
    Ok(VoxelSet::of_blocks_until(blocks, stop))
}

/// The blocks of a set, ascending, read one after the other: an error is the last.
pub(crate) fn blocks_of(
    voxels: &pb::Voxels,
) -> impl Iterator<Item = Result<(VoxelKey, BlockMask), Unreadable>> {
    let (mut key, mut octrees, count) = (0u64, &voxels.octrees[..], voxels.key_gaps.len());
    voxels.key_gaps.iter().enumerate().map(move |(i, &gap)| {
        if gap == 0 && i > 0 {
            return Err(format!("voxels.key_gaps[{i}] is 0: a block comes twice"));
        }
        key = key.checked_add(gap).ok_or_else(|| format!("voxels.key_gaps[{i}] is too large: {gap}"))?;
        let block = VoxelSet::block_key(key).ok_or_else(|| format!("block key {key:#x} is out of range"))?;
        let mask = read_octree(&mut octrees)
            .ok_or_else(|| format!("voxels.octrees: that of block {i} is cut short or has an empty child"))?;
        if i + 1 == count && !octrees.is_empty() {
            return Err(format!("voxels.octrees has {} bytes too many", octrees.len()));
        }
        Ok((block, mask))
    })
}

/// Appends the tree of a block that is not empty.
fn write_octree(mask: &BlockMask, tree: &mut Vec<u8>) {
    let bytes = mask.to_le_bytes();
    let (words, _) = bytes.as_chunks::<8>();
    tree.push(children(std::array::from_fn(|w| words[w] != [0; 8])));
    for word in words.iter().filter(|word| **word != [0; 8]) {
        tree.push(children(word.map(|byte| byte != 0)));
        tree.extend(word.iter().filter(|byte| **byte != 0));
    }
}

/// Takes the octree of one block from the front of `tree`; none where it is not valid.
fn read_octree(tree: &mut &[u8]) -> Option<BlockMask> {
    let mut bytes = [0; BlockMask::BYTES];
    let (words, _) = bytes.as_chunks_mut::<8>();
    for word in present(words, next(tree)?) {
        for byte in present(word, next(tree)?) {
            *byte = next(tree)?;
        }
    }
    Some(BlockMask::from_le_bytes(&bytes))
}

/// Takes the next byte, which must not be 0: no node of a tree is empty.
fn next(tree: &mut &[u8]) -> Option<u8> {
    tree.split_off_first().copied().filter(|&byte| byte != 0)
}

/// The byte of a node: bit i is set where child i is there.
fn children(there: [bool; 8]) -> u8 {
    there.into_iter().rev().fold(0, |bits, there| bits << 1 | u8::from(there))
}

/// The children whose bits are set.
fn present<T>(children: &mut [T], bits: u8) -> impl Iterator<Item = &mut T> {
    children.iter_mut().enumerate().filter(move |(i, _)| bits >> i & 1 == 1).map(|(_, child)| child)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::voxel::VoxelKey;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_set_survives_its_message(keys in prop::collection::vec(prop::array::uniform3(-40i32..40), 0..300), far: [i16; 3]) {
            let far = VoxelKey::new(far.map(|i| i32::from(i) * 32)).unwrap();
            let voxels: VoxelSet = keys.into_iter().filter_map(VoxelKey::new).chain([far]).collect();
            prop_assert_eq!(VoxelSet::try_from(pb::Voxels::from(&voxels)).unwrap(), voxels);
        }

        #[test]
        fn bytes_that_are_no_tree_are_an_error_and_never_a_panic(key_gaps: Vec<u64>, octrees: Vec<u8>) {
            let message = pb::Voxels { key_gaps, octrees: octrees.into() };
            if let Ok(voxels) = VoxelSet::try_from(message.clone()) {
                prop_assert_eq!(pb::Voxels::from(&voxels), message);
            }
        }
    }

    #[test]
    fn a_single_voxel_is_three_bytes_beside_its_key() {
        let voxels: VoxelSet = [VoxelKey::new([1, 0, 4]).unwrap()].into_iter().collect();
        let message = pb::Voxels::from(&voxels);
        assert_eq!((&message.key_gaps[..], &message.octrees[..]), (&[0][..], &[1 << 4, 1, 2][..]));
    }
}
