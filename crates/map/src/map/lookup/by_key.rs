//! The look-up in the filter alone, of voxels whose keys are known: what experiment 1 of the paper times by itself
//! (IV-A).

use super::level_view::LevelView;
use super::scalar;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::{Avx2, Avx512};
use crate::voxel::VoxelKey;

/// The look-up of points by the filter, which must be there, of voxels of the view's level whose keys are
/// known.
///
/// # Panics
/// When `occupied` is not one word for each 64 keys.
pub fn filter_contains(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    assert_eq!(occupied.len(), keys.len().div_ceil(64), "one word of answers for each 64 keys");
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx512::detect() {
        return avx512::by_key::filter_contains(cpu, keys, view, occupied);
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx2::detect() {
        return avx2::by_key::filter_contains(cpu, keys, view, occupied);
    }
    filter_contains_scalar(keys, view, occupied);
}

/// The reference implementation of [`filter_contains`].
fn filter_contains_scalar(keys: &[u64], view: &LevelView<'_>, occupied: &mut [u64]) {
    let contains = |&key: &u64| VoxelKey::from_bits(key).is_some_and(|key| scalar::bloom(view, key.index()));
    for (keys, word) in keys.chunks(64).zip(occupied) {
        *word = (0..).zip(keys).fold(0, |word, (bit, key)| word | u64::from(contains(key)) << bit);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::bloom::{FilterSettings, HASHES_MAX};
    use crate::geometry::Point;
    use crate::map::contents::MapContents;
    use crate::map::lookup;
    use crate::map::lookup::level_view::Lookup;
    use crate::map::multi_resolution_map::MultiResolutionMap;
    use crate::map::settings::MapSettings;
    use crate::voxel::{VoxelSet, quantize};

    /// Points of a cube of 60 voxels, on borders too, and some that no voxel holds.
    fn points() -> impl Strategy<Value = Vec<Point>> {
        let coordinate = prop_oneof![
            20 => (-120i32..120).prop_map(|i| i as f32 * 0.125),
            1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, -3e5, 524_288.0]),
        ];
        prop::collection::vec(prop::array::uniform3(coordinate).prop_map(Point::from), 0..150)
    }

    fn map_of(points: &[Point], levels: u32, hashes: u32) -> MultiResolutionMap {
        let filter = Some(FilterSettings { hashes, ..FilterSettings::default() });
        let settings = MapSettings { filter, ..MapSettings::new(0.5, levels) };
        let map = MultiResolutionMap::new(settings).unwrap();
        let (voxels, _) = VoxelSet::of_points(points, &map.lattice().from_map());
        MultiResolutionMap::restore(*map.settings(), MapContents::at(1, voxels)).unwrap()
    }

    type FilterContains = fn(&[u64], &LevelView<'_>, &mut [u64]);

    /// The SIMD variants that this machine can run.
    fn variants() -> Vec<(&'static str, FilterContains)> {
        #[cfg_attr(not(target_arch = "x86_64"), expect(unused_mut, reason = "there is no other variant"))]
        let mut variants: Vec<(&'static str, FilterContains)> = vec![("dispatched", filter_contains)];
        #[cfg(target_arch = "x86_64")]
        if Avx2::detect().is_some() {
            variants.push(("avx2", |keys, view, occupied| {
                avx2::by_key::filter_contains(Avx2::detect().expect("AVX2"), keys, view, occupied);
            }));
        }
        variants
    }

    proptest! {
        #[test]
        fn keys_and_then_the_filter_are_the_whole_look_up(
            occupied in points(),
            asked in points(),
            levels in 1u32..=5,
            hashes in 1u32..=HASHES_MAX,
        ) {
            let map = map_of(&occupied, levels, hashes);
            let (quantize, level, n) = (map.lattice().from_map(), levels - 1, asked.len());
            let view = map.view();
            let view = view.level_view(level);
            let (mut keys, mut expected) = (vec![1; n], vec![1; n.div_ceil(64)]);
            quantize::keys(&asked, &quantize, level, &mut keys);
            lookup::occupied_scalar(&asked, &quantize, &view, Lookup::Bloom, &mut expected);
            let mut scalar = vec![1; n.div_ceil(64)];
            filter_contains_scalar(&keys, &view, &mut scalar);
            prop_assert_eq!(&scalar, &expected);
            for (name, filter_contains) in variants() {
                let mut found = vec![2; n.div_ceil(64)];
                filter_contains(&keys, &view, &mut found);
                prop_assert_eq!(&found, &expected, "{}", name);
            }
        }
    }
}
