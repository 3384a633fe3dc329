//! The stages of a look-up, each by itself, as wide as the whole.
//!
//! What experiment 1 of the paper times one by one (IV-A), and what lets other structures be compared with ours
//! on equal terms: they get the same transform.

use super::{LevelView, Lookup, scalar};
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};
use crate::geometry::Point;
use crate::voxel::{LatticeFromPoints, VoxelKey};

/// Stands among keys for a point that has no voxel; no key sets bit 63.
pub const NO_KEY: u64 = u64::MAX;

/// Rotate, translate, quantize, pack: the key of each point's voxel of `level`, [`NO_KEY`] where it has none.
///
/// # Panics
/// When `keys` is not as long as `points`.
pub fn keys(points: &[Point], lattice_from_points: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    assert_eq!(keys.len(), points.len(), "one key for each point");
    #[cfg(target_arch = "x86_64")]
    if avx512::is_available() {
        return avx512::stages::keys(points, lattice_from_points, level, keys);
    }
    #[cfg(target_arch = "x86_64")]
    if avx2::is_available() {
        return avx2::stages::keys(points, lattice_from_points, level, keys);
    }
    keys_scalar(points, lattice_from_points, level, keys);
}

/// The scalar twin of [`keys`].
fn keys_scalar(points: &[Point], lattice_from_points: &LatticeFromPoints, level: u32, keys: &mut [u64]) {
    for (&point, key) in points.iter().zip(keys) {
        let index = lattice_from_points.index(point);
        *key = index.map_or(NO_KEY, |index| VoxelKey::pack(index.map(|i| i >> level)).to_bits());
    }
}

/// A box of voxels of one level, of less than 2^32 cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Index of its first voxel.
    pub min: [i32; 3],
    /// Voxels along x, y and z.
    pub size: [u32; 3],
}

impl Grid {
    /// The smallest box around `voxels`; none without a voxel.
    pub fn around(voxels: impl IntoIterator<Item = VoxelKey>) -> Option<Self> {
        let mut voxels = voxels.into_iter().map(VoxelKey::index);
        let first = voxels.next()?;
        let (min, max) = voxels.fold((first, first), |(min, max), index| {
            let each = |pick: fn(i32, i32) -> i32, a: [i32; 3]| std::array::from_fn(|k| pick(a[k], index[k]));
            (each(Ord::min, min), each(Ord::max, max))
        });
        Some(Self { min, size: std::array::from_fn(|k| max[k].abs_diff(min[k]) + 1) })
    }

    /// Number of cells.
    pub fn cells(&self) -> u64 {
        self.size.iter().map(|&size| u64::from(size)).product()
    }

    /// Where the cell of the voxel at `index` lies, x first, then y, then z; [`Grid::cells`] where that is outside.
    #[inline(always)]
    pub fn offset(&self, index: [i32; 3]) -> u32 {
        let [x, y, z]: [u32; 3] = std::array::from_fn(|k| index[k].wrapping_sub(self.min[k]) as u32);
        let inside = x < self.size[0] && y < self.size[1] && z < self.size[2];
        let offset = z.wrapping_mul(self.size[1]).wrapping_add(y).wrapping_mul(self.size[0]).wrapping_add(x);
        if inside { offset } else { self.cells() as u32 }
    }
}

/// Rotate, translate, quantize, and the offset of each point's voxel of `level` in `grid`: [`Grid::cells`] of
/// what lies outside or has no voxel.
///
/// # Panics
/// When `offsets` is not as long as `points`.
pub fn offsets(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    level: u32,
    grid: &Grid,
    offsets: &mut [u32],
) {
    assert_eq!(offsets.len(), points.len(), "one offset for each point");
    debug_assert!(grid.cells() < 1 << 32);
    #[cfg(target_arch = "x86_64")]
    if avx512::is_available() {
        return avx512::stages::offsets(points, lattice_from_points, level, grid, offsets);
    }
    #[cfg(target_arch = "x86_64")]
    if avx2::is_available() {
        return avx2::stages::offsets(points, lattice_from_points, level, grid, offsets);
    }
    offsets_scalar(points, lattice_from_points, level, grid, offsets);
}

/// The scalar twin of [`offsets`].
fn offsets_scalar(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    level: u32,
    grid: &Grid,
    offsets: &mut [u32],
) {
    for (&point, offset) in points.iter().zip(offsets) {
        let index = lattice_from_points.index(point);
        *offset = index.map_or(grid.cells() as u32, |index| grid.offset(index.map(|i| i >> level)));
    }
}

/// [`super::occupied`] by the filter, of voxels of the view's level whose keys are known.
///
/// # Panics
/// When `occupied` is not one word for each 64 keys.
pub fn filter_contains(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    assert_eq!(occupied.len(), keys.len().div_ceil(64), "one word of answers for each 64 keys");
    #[cfg(target_arch = "x86_64")]
    if avx512::is_available() {
        return avx512::stages::filter_contains(keys, view, occupied);
    }
    #[cfg(target_arch = "x86_64")]
    if avx2::is_available() {
        return avx2::stages::filter_contains(keys, view, occupied);
    }
    filter_contains_scalar(keys, view, occupied);
}

/// The scalar twin of [`filter_contains`].
fn filter_contains_scalar(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    let contains = |&key: &u64| VoxelKey::from_bits(key).is_some_and(|key| scalar::bloom(view, key.index()));
    for (keys, word) in keys.chunks(64).zip(occupied) {
        *word = (0..).zip(keys).fold(0, |word, (bit, key)| word | u64::from(contains(key)) << bit);
    }
}

/// [`super::occupied`] as machines without wide instructions run it.
///
/// # Panics
/// As there.
pub fn occupied_scalar(
    points: &[Point],
    lattice_from_points: &LatticeFromPoints,
    view: &LevelView<'_>,
    lookup: Lookup,
    occupied: &mut [u64],
) -> bool {
    assert_eq!(occupied.len(), points.len().div_ceil(64), "one word of answers for each 64 points");
    scalar::occupied(points, lattice_from_points, view, lookup, occupied)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::bloom::{FilterSettings, HASHES_MAX};
    use crate::geometry::Pose;
    use crate::map::{MapContents, MapSettings, MultiResolutionMap};
    use crate::voxel::VoxelSet;

    /// Points of a cube of 60 voxels, on borders too, and some that no voxel holds.
    fn points() -> impl Strategy<Value = Vec<Point>> {
        let coordinate = prop_oneof![
            20 => (-120i32..120).prop_map(|i| i as f32 * 0.125),
            1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, -3e5, 524_288.0]),
        ];
        prop::collection::vec(prop::array::uniform3(coordinate).prop_map(Point::from), 0..150)
    }

    fn map_of(points: &[Point], levels: u32, hashes: u32) -> MultiResolutionMap {
        let filter = FilterSettings { hashes, ..FilterSettings::default() };
        let settings = MapSettings { filter, ..MapSettings::new(0.5, levels) };
        let map = MultiResolutionMap::new(settings).unwrap();
        let (voxels, _) = VoxelSet::of_points(points, &map.lattice().from_map());
        MultiResolutionMap::restore(*map.settings(), MapContents::at(1, voxels)).unwrap()
    }

    type Keys = fn(&[Point], &LatticeFromPoints, u32, &mut [u64]);
    type Offsets = fn(&[Point], &LatticeFromPoints, u32, &Grid, &mut [u32]);
    type FilterContains = fn(&[u64], &LevelView<'_>, &mut [u64]);

    /// The wide twins that this machine can run.
    fn wide() -> Vec<(&'static str, Keys, Offsets, FilterContains)> {
        let mut wide: Vec<(_, Keys, Offsets, FilterContains)> =
            vec![("dispatched", keys, offsets, filter_contains)];
        #[cfg(target_arch = "x86_64")]
        if avx2::is_available() {
            wide.push(("avx2", avx2::stages::keys, avx2::stages::offsets, avx2::stages::filter_contains));
        }
        wide
    }

    proptest! {
        #[test]
        fn the_wide_stages_agree_with_the_scalar_ones(
            occupied in points(),
            asked in points(),
            levels in 1u32..=5,
            hashes in 1u32..=HASHES_MAX,
            turned in any::<bool>(),
        ) {
            let map = map_of(&occupied, levels, hashes);
            let pose = match turned {
                true => Pose::new([0.3, -7.0, 1.0].into(), [0.4, -0.2, 2.0].into()),
                false => Pose::identity(),
            };
            let (quantize, level, n) = (map.lattice().from_points(&pose), levels - 1, asked.len());
            let view = map.view();
            let view = view.level_view(level);
            let grid = Grid { min: [-20, -9, 3], size: [33, 18, 7] };

            let (mut all_keys, mut all_offsets) = (vec![1; n], vec![1; n]);
            let (mut bits, mut whole) = (vec![1; n.div_ceil(64)], vec![1; n.div_ceil(64)]);
            keys_scalar(&asked, &quantize, level, &mut all_keys);
            offsets_scalar(&asked, &quantize, level, &grid, &mut all_offsets);
            filter_contains_scalar(&all_keys, &view, &mut bits);
            // And the parts make the whole.
            occupied_scalar(&asked, &quantize, &view, Lookup::Bloom, &mut whole);
            prop_assert_eq!(&bits, &whole);

            for (name, keys, offsets, filter_contains) in wide() {
                let (mut found_keys, mut found_offsets, mut found) =
                    (vec![2; n], vec![2; n], vec![2; n.div_ceil(64)]);
                keys(&asked, &quantize, level, &mut found_keys);
                offsets(&asked, &quantize, level, &grid, &mut found_offsets);
                filter_contains(&all_keys, &view, &mut found);
                prop_assert_eq!(&found_keys, &all_keys, "{}", name);
                prop_assert_eq!(&found_offsets, &all_offsets, "{}", name);
                prop_assert_eq!(&found, &bits, "{}", name);
            }
        }
    }

    #[test]
    fn a_grid_has_a_cell_for_each_of_its_voxels_and_one_for_all_others() {
        let voxels = [[-3, 5, 0], [1, 5, 2], [0, 4, 1]].map(|index| VoxelKey::new(index).unwrap());
        let grid = Grid::around(voxels).unwrap();
        assert_eq!((grid.min, grid.size, grid.cells()), ([-3, 4, 0], [5, 2, 3], 30));
        let cells = (0..3).flat_map(|z| (4..6).flat_map(move |y| (-3..2).map(move |x| [x, y, z])));
        assert!(cells.map(|index| grid.offset(index)).eq(0..30));
        for outside in [[-4, 5, 0], [2, 5, 0], [0, 3, 0], [0, 5, -1], [i32::MAX, i32::MIN, 0]] {
            assert_eq!(grid.offset(outside), 30);
        }
        assert_eq!(Grid::around([]), None);
    }
}
