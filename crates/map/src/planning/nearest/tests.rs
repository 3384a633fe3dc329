use proptest::prelude::*;

use super::*;
use crate::geometry::Point;
use crate::map::{MapContents, MapSettings, MultiResolutionMap};
use crate::planning::tests::{history_and_level, point};
use crate::util::StopSignal;
use crate::voxel::{VoxelKey, VoxelSet};

/// The nearest voxel, by a look at every one of them.
fn nearest_of_all(
    map: &MultiResolutionMap,
    request: &NearestRequest<'_>,
    point: Point,
) -> Option<(f64, VoxelKey, [f64; 3])> {
    let NearestRequest { level, radius_m, to, .. } = *request;
    let voxel_m = map.lattice().resolution_m(level);
    let at = point.xyz().map(|c| f64::from(c) / voxel_m);
    let (view, radius) = (map.view(), radius_m / voxel_m);
    let measured = |voxel: VoxelKey| {
        let gaps: [f64; 3] = std::array::from_fn(|axis| {
            let (low, high) = (f64::from(voxel.index()[axis]), f64::from(voxel.index()[axis] + 1));
            match to {
                MeasuredTo::Centers => at[axis] - (low + 0.5),
                MeasuredTo::Cubes => at[axis] - at[axis].clamp(low, high),
            }
        });
        let [x, y, z] = gaps;
        (x * x + y * y + z * z, voxel, gaps)
    };
    let all = view.lists(level).flat_map(|list| list.iter()).map(measured);
    let near = all.filter(|(squared, ..)| *squared <= radius * radius);
    let (squared, voxel, gaps) = near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
    let distance = squared.sqrt();
    Some((distance * voxel_m, voxel, gaps.map(|gap| if distance > 0.0 { gap / distance } else { 0.0 })))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, max_shrink_iters: 2000, ..ProptestConfig::default() })]

    #[test]
    fn the_search_finds_what_a_look_at_every_voxel_finds(
        (history, level) in history_and_level(),
        points in prop::collection::vec(point(), 1..40),
        voxels in prop_oneof![0.1f64..12.0, 12.0f64..=64.0, Just(64.0)],
        to in prop::sample::select(vec![MeasuredTo::Cubes, MeasuredTo::Centers]),
    ) {
        let map = history.map();
        let radius_m = voxels * map.lattice().resolution_m(level);
        let request = NearestRequest { points: &points, level, radius_m, to };
        let found = find_nearest(&map.view(), &request, StopSignal::NEVER).unwrap();
        prop_assert_eq!(found.len(), points.len());
        for (at, &point) in points.iter().enumerate() {
            let expected = nearest_of_all(&map, &request, point);
            let is_found = found.found[at / 64] >> (at % 64) & 1 == 1;
            let told = (found.distances_m[at], found.voxels[at], found.away[at]);
            let expected = expected.map(|(distance_m, voxel, away)| (distance_m as f32, voxel, away.map(|c| c as f32)));
            prop_assert_eq!(is_found.then_some(told), expected, "point {:?}", point);
            prop_assert!(is_found || told == (f32::INFINITY, VoxelKey::default(), [0.0; 3]));
        }
    }
}

fn map_of(indices: &[[i32; 3]]) -> MultiResolutionMap {
    let voxels: VoxelSet = indices.iter().filter_map(|&index| VoxelKey::new(index)).collect();
    MultiResolutionMap::restore(MapSettings::new(1.0, 3), MapContents::at(1, voxels)).unwrap()
}

fn nearest(
    map: &MultiResolutionMap,
    point: [f32; 3],
    radius_m: f64,
    to: MeasuredTo,
) -> Option<(f32, [i32; 3], [f32; 3])> {
    let points = [point.into()];
    let request = NearestRequest { points: &points, level: 0, radius_m, to };
    let found = find_nearest(&map.view(), &request, StopSignal::NEVER).unwrap();
    (found.found[0] == 1).then(|| (found.distances_m[0], found.voxels[0].index(), found.away[0]))
}

#[test]
fn a_point_in_a_cube_is_at_no_distance_and_no_way_leads_away() {
    let map = map_of(&[[3, 0, 0]]);
    assert_eq!(nearest(&map, [3.25, 0.5, 0.5], 1.0, MeasuredTo::Cubes), Some((0.0, [3, 0, 0], [0.0; 3])));
    assert_eq!(
        nearest(&map, [3.25, 0.5, 0.5], 1.0, MeasuredTo::Centers),
        Some((0.25, [3, 0, 0], [-1.0, 0.0, 0.0]))
    );
    assert_eq!(
        nearest(&map, [1.0, 0.5, 0.5], 2.0, MeasuredTo::Cubes),
        Some((2.0, [3, 0, 0], [-1.0, 0.0, 0.0]))
    );
    assert_eq!(nearest(&map, [1.0, 0.5, 0.5], 1.9, MeasuredTo::Cubes), None);
}

#[test]
fn of_voxels_equally_far_the_smallest_key_is_taken() {
    // In a key z comes first, and on each axis negative indices last.
    let map = map_of(&[[2, 0, 0], [-2, 0, 0], [0, 2, 0], [0, 0, 2]]);
    assert_eq!(nearest(&map, [0.5, 0.5, 0.5], 5.0, MeasuredTo::Centers).unwrap().1, [2, 0, 0]);
    let map = map_of(&[[-2, 0, 0], [0, 2, 0], [0, 0, 2]]);
    assert_eq!(nearest(&map, [0.5, 0.5, 0.5], 5.0, MeasuredTo::Centers).unwrap().1, [-2, 0, 0]);
}

#[test]
fn a_radius_beyond_its_limits_and_a_point_beyond_the_lattice_are_named() {
    let map = map_of(&[[0; 3]]);
    for radius_m in [0.0, -1.0, f64::NAN, 64.001, f64::INFINITY] {
        let request = NearestRequest { points: &[], level: 0, radius_m, to: MeasuredTo::Cubes };
        let said = find_nearest(&map.view(), &request, StopSignal::NEVER).unwrap_err().to_string();
        assert!(said.starts_with("radius_m must lie above 0 and at most 64 m"), "{said}");
    }
    for bad in [[f32::NAN, 0.0, 0.0], [f32::INFINITY, 0.0, 0.0], [f32::MAX, 0.0, 0.0], [0.0, f32::MIN, 0.0]] {
        let points = [Point::from([0.0; 3]), bad.into()];
        let request = NearestRequest { points: &points, level: 0, radius_m: 64.0, to: MeasuredTo::Cubes };
        let said = find_nearest(&map.view(), &request, StopSignal::NEVER).unwrap_err().to_string();
        assert!(said.starts_with("points[1] must be finite and lie in"), "{said}");
    }
}
