//! Packed voxel keys (paper II-B): the three indices of a voxel *are* its identity, unique and reversible.

/// Bits of one axis in a key.
pub(super) const AXIS_BITS: u32 = 21;
pub(super) const AXIS_MASK: u64 = (1 << AXIS_BITS) - 1;

/// The lowest bit of each axis.
pub(super) const AXIS_UNITS: u64 = 1 | 1 << AXIS_BITS | 1 << (2 * AXIS_BITS);

/// Smallest voxel index an axis can hold, at level 0.
pub const INDEX_MIN: i32 = -(1 << (AXIS_BITS - 1));
/// Largest voxel index an axis can hold, at level 0.
pub const INDEX_MAX: i32 = (1 << (AXIS_BITS - 1)) - 1;

/// One voxel's indices on its level's lattice, packed into 63 bits.
///
/// ```text
/// bit 63 | 62 ......... 42 | 41 ......... 21 | 20 .......... 0
///      0 | z, two's compl. | y, two's compl. | x, two's compl.
/// ```
///
/// The paper packs 4 x 16 bits and says that larger integers lift its limit of +-32,768; 3 x 21 bits reach
/// +-1,048,576 voxels an axis, +-52 km at 5 cm. Two's complement needs no level to be decoded, and the parent
/// of a voxel is an arithmetic shift of each field.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct VoxelKey(u64);

impl VoxelKey {
    /// The key of voxel (x, y, z), or none when an index is outside [`INDEX_MIN`]..=[`INDEX_MAX`].
    pub fn new(index: [i32; 3]) -> Option<Self> {
        let fits = |i: &i32| (INDEX_MIN..=INDEX_MAX).contains(i);
        index.iter().all(fits).then(|| Self::pack(index))
    }

    /// Packs indices that are known to be in range; others would alias.
    #[inline(always)]
    pub(crate) fn pack([x, y, z]: [i32; 3]) -> Self {
        let field = |i: i32| i as i64 as u64 & AXIS_MASK;
        Self(field(x) | field(y) << AXIS_BITS | field(z) << (2 * AXIS_BITS))
    }

    /// The key whose packed form is `bits`, or none when bit 63 is set.
    pub fn from_bits(bits: u64) -> Option<Self> {
        (bits >> (3 * AXIS_BITS) == 0).then_some(Self(bits))
    }

    /// The packed form.
    #[inline(always)]
    pub fn to_bits(self) -> u64 {
        self.0
    }

    /// The voxel's indices \[x, y, z\].
    #[inline(always)]
    pub fn index(self) -> [i32; 3] {
        let field = |shift: u32| {
            let left = u64::BITS - AXIS_BITS;
            (((self.0 >> shift) << left) as i64 >> left) as i32
        };
        [field(0), field(AXIS_BITS), field(2 * AXIS_BITS)]
    }

    /// The voxel `levels` levels coarser that contains this one (r_n = r_0 * 2^n, paper III).
    #[inline(always)]
    pub fn ancestor(self, levels: u32) -> Self {
        // All three shifted at once: each drops its lowest bits, and its sign fills the highest.
        let beyond_signs = (self.0 & (AXIS_UNITS << (AXIS_BITS - 1))) << 1;
        let kept = self.0 & (AXIS_UNITS * (AXIS_MASK >> levels << levels));
        Self(kept >> levels | (beyond_signs - (beyond_signs >> levels)))
    }

    /// The first of the voxels `levels` levels finer within this one.
    #[inline(always)]
    pub(crate) fn first_within(self, levels: u32) -> Self {
        Self((self.0 & (AXIS_UNITS * (AXIS_MASK >> levels))) << levels)
    }

    /// The voxel `offset` further along the axes, where no axis of this one has a bit of the offset's.
    #[inline(always)]
    pub(super) fn offset_by(self, offset: u64) -> Self {
        Self(self.0 | offset)
    }

    /// One step along an axis, packed.
    pub(super) const fn axis_unit(axis: u32) -> u64 {
        1 << (axis * AXIS_BITS)
    }
}

impl std::fmt::Debug for VoxelKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.index();
        write!(f, "voxel({x}, {y}, {z})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn packing_is_reversible(x in INDEX_MIN..=INDEX_MAX, y in INDEX_MIN..=INDEX_MAX, z in INDEX_MIN..=INDEX_MAX) {
            let key = VoxelKey::new([x, y, z]).unwrap();
            prop_assert_eq!(key.index(), [x, y, z]);
            prop_assert_eq!(VoxelKey::from_bits(key.to_bits()), Some(key));
        }

        #[test]
        fn an_ancestor_is_the_floor_of_the_index(x in INDEX_MIN..=INDEX_MAX, n in 0u32..12) {
            let key = VoxelKey::new([x, -x - 1, 0]).unwrap();
            let side = f64::from(1 << n);
            let floor = |i: i32| (f64::from(i) / side).floor() as i32;
            prop_assert_eq!(key.ancestor(n).index(), [floor(x), floor(-x - 1), 0]);
        }
    }

    #[test]
    fn an_index_out_of_range_never_aliases() {
        assert_eq!(VoxelKey::new([INDEX_MAX + 1, 0, 0]), None);
        assert_eq!(VoxelKey::new([0, INDEX_MIN - 1, 0]), None);
        assert_eq!(VoxelKey::from_bits(1 << 63), None);
    }
}
