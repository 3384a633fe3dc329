//! Every SIMD variant against the reference implementation, bit for bit.

use proptest::prelude::*;

use super::level_view::{LevelView, Lookup};
use super::scalar;
use crate::bloom::{FilterSettings, HASHES_MAX};
use crate::geometry::{Point, Pose};
use crate::map::contents::MapContents;
use crate::map::multi_resolution_map::MultiResolutionMap;
use crate::map::settings::MapSettings;
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::{Avx2, Avx512};
use crate::voxel::{
    BLOCK_LEVELS, CLUSTER_LEVELS, INDEX_MAX, INDEX_MIN, LatticeFromPoints, VoxelKey, VoxelSet,
};

type Kernel = fn(&[Point], &LatticeFromPoints, &LevelView<'_>, Lookup, &mut [u64]) -> bool;

/// The SIMD variants that this machine can run.
fn wide_kernels() -> Vec<(&'static str, Kernel)> {
    #[cfg_attr(not(target_arch = "x86_64"), expect(unused_mut, reason = "there is no other variant"))]
    let mut kernels: Vec<(&'static str, Kernel)> = vec![("dispatched", super::by_point::occupied)];
    #[cfg(target_arch = "x86_64")]
    if Avx512::detect().is_some() {
        kernels.push(("avx512", |points, quantize, view, lookup, occupied| {
            super::avx512::occupied(Avx512::detect().expect("it"), points, quantize, view, lookup, occupied)
        }));
    }
    #[cfg(target_arch = "x86_64")]
    if Avx2::detect().is_some() {
        kernels.push(("avx2", |points, quantize, view, lookup, occupied| {
            super::avx2::occupied(Avx2::detect().expect("it"), points, quantize, view, lookup, occupied)
        }));
    }
    kernels
}

fn assert_variants_agree(map: &MultiResolutionMap, points: &[Point], pose: &Pose) {
    let quantize = map.lattice().from_points(pose);
    let view = map.view();
    for (name, kernel) in wide_kernels() {
        for level in 0..map.settings().levels {
            for lookup in [Lookup::Exact, Lookup::Bloom] {
                let (mut expected, mut found) =
                    (vec![0; points.len().div_ceil(64)], vec![7; points.len().div_ceil(64)]);
                let level_view = view.level_view(level);
                let all = scalar::occupied(points, &quantize, &level_view, lookup, &mut expected);
                assert_eq!(kernel(points, &quantize, &level_view, lookup, &mut found), all, "{name}");
                assert_eq!(found, expected, "{name}, level {level}, {lookup:?}");
            }
        }
    }
}

fn map_of(keys: impl IntoIterator<Item = [i32; 3]>, settings: MapSettings) -> MultiResolutionMap {
    let voxels: VoxelSet = keys.into_iter().filter_map(VoxelKey::new).collect();
    MultiResolutionMap::restore(settings, MapContents::at(1, voxels)).unwrap()
}

/// Indices crowded enough to hit, near the origin, at region borders, and at the ends of the range.
fn index() -> impl Strategy<Value = [i32; 3]> {
    let axis = prop_oneof![
        8 => -20i32..20,
        2 => prop::sample::select(vec![-65, -64, -1, 0, 63, 64, 127, 128]),
        1 => prop::sample::select(vec![INDEX_MIN, INDEX_MIN + 1, INDEX_MAX - 1, INDEX_MAX]),
    ];
    prop::array::uniform3(axis)
}

/// Points in, on the borders of and beside the voxels of 0.5 m, and some that no voxel holds.
fn point() -> impl Strategy<Value = Point> {
    let on_lattice = (index(), prop::array::uniform3(prop::sample::select(vec![0.0f32, 0.25, 0.499_999])));
    prop_oneof![
        20 => on_lattice.prop_map(|(i, d)| Point::new(
            i[0] as f32 * 0.5 + d[0], i[1] as f32 * 0.5 + d[1], i[2] as f32 * 0.5 + d[2])),
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 524_288.0, -524_288.5, 1e30])
            .prop_map(|bad| Point::new(bad, 0.0, 0.0)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn wide_kernels_agree_with_the_scalar_one(
        keys in prop::collection::vec(index(), 0..600),
        points in prop::collection::vec(point(), 0..150),
        levels in 1u32..=12,
        hashes in 1u32..=HASHES_MAX,
        bits_per_key in 2.0f64..20.0,
        turned in any::<bool>(),
    ) {
        let filter = Some(FilterSettings { hashes, bits_per_key });
        let map = map_of(keys, MapSettings { filter, ..MapSettings::new(0.5, levels) });
        let pose = match turned {
            true => Pose::new([0.3, -7.0, 1.0].into(), [0.4, -0.2, 2.0].into()),
            false => Pose::identity(),
        };
        assert_variants_agree(&map, &points, &pose);
    }

    #[test]
    fn without_a_filter_the_exact_set_answers_both_look_ups(
        keys in prop::collection::vec(index(), 0..600),
        // So many that a filter would be asked for those behind the first 512.
        points in prop::collection::vec(point(), 0..1200),
        levels in 1u32..=12,
    ) {
        let map = map_of(keys, MapSettings::query_only(0.5, levels));
        let (quantize, view) = (map.lattice().from_map(), map.view());
        for level in 0..levels {
            let level_view = view.level_view(level);
            let [mut expected, mut found] = [(); 2].map(|()| vec![7; points.len().div_ceil(64)]);
            let all = scalar::occupied(&points, &quantize, &level_view, Lookup::Exact, &mut expected);
            for lookup in [Lookup::Exact, Lookup::Bloom] {
                let found_all = super::by_point::occupied(&points, &quantize, &level_view, lookup, &mut found);
                prop_assert_eq!((found_all, &found), (all, &expected));
            }
        }
    }
}

#[test]
fn exact_answers_are_exact_whichever_way_they_are_found() {
    // Chunks of few hits, of many, and of few again, with a filter that lets much through.
    let filter = Some(FilterSettings { hashes: 1, bits_per_key: 2.0 });
    let floor = (0..1600).map(|i| [i % 40, i / 40, 0]);
    let map = map_of(floor, MapSettings { filter, ..MapSettings::new(1.0, 2) });
    let at = |i: usize, height: f32| Point::new((i % 40) as f32 + 0.5, (i / 40 % 40) as f32 + 0.5, height);
    let sparse = |i: usize| at(i, if i.is_multiple_of(50) { 0.5 } else { 3.5 });
    let points: Vec<_> = (0..20_000)
        .map(sparse)
        .chain((0..20_000).map(|i| at(i, 0.5)))
        .chain((0..19_999).map(sparse))
        .collect();
    assert_variants_agree(&map, &points, &Pose::identity());
}

/// So many that tags agree by chance, and buckets overflow.
#[test]
fn clusters_that_are_not_where_their_tags_say_are_found() {
    const SIDE: i32 = 1 << (BLOCK_LEVELS + CLUSTER_LEVELS);
    let first_voxels = |z: i32| (0..40_000).map(move |i| [i % 200 - 100, i / 200 - 100, z].map(|c| c * SIDE));
    let map = map_of(first_voxels(0), MapSettings::new(1.0, 5));
    // In clusters that are there, and in those below, which are not.
    let asked = first_voxels(0).zip(first_voxels(-1)).flat_map(|(above, below)| [above, below]);
    let points: Vec<_> = asked.map(|index| Point::from(index.map(|i| i as f32 + 0.5))).collect();
    assert_variants_agree(&map, &points, &Pose::identity());
}

#[test]
fn bits_past_the_last_point_are_zero() {
    let map = map_of([[0, 0, 0]], MapSettings::new(1.0, 3));
    let points = vec![Point::new(0.5, 0.5, 0.5); 67];
    let mut bits = [u64::MAX; 2];
    let view = map.view();
    assert!(super::by_point::occupied(
        &points,
        &map.lattice().from_map(),
        &view.level_view(0),
        Lookup::Exact,
        &mut bits
    ));
    assert_eq!(bits, [u64::MAX, 0b111]);
}
