use proptest::prelude::*;

use super::*;
use crate::geometry::Point;
use crate::map::{MapContents, MapSettings, MultiResolutionMap};
use crate::planning::tests::{RESOLUTION_M, history_and_level, point};
use crate::util::StopSignal;
use crate::voxel::{VoxelKey, VoxelSet};

/// A map of the voxels of these indices, of 1 m.
fn map_of(indices: &[[i32; 3]], levels: u32) -> MultiResolutionMap {
    let voxels: VoxelSet = indices.iter().filter_map(|&index| VoxelKey::new(index)).collect();
    MultiResolutionMap::restore(MapSettings::new(1.0, levels), MapContents::at(1, voxels)).unwrap()
}

fn cast(map: &MultiResolutionMap, rays: &Rays<'_>, level: u32) -> Result<RayHits, RayError> {
    cast_rays(&map.view(), rays, level, StopSignal::NEVER)
}

/// The distance and the voxel of one ray.
fn cast_one(
    map: &MultiResolutionMap,
    origin: [f32; 3],
    direction: [f32; 3],
    range_m: f64,
) -> Option<(f32, [i32; 3])> {
    let (origins, directions) = ([origin.into()], [direction.into()]);
    let rays = Rays { origins: &origins, toward: Toward::Directions { directions: &directions, range_m } };
    let hits = cast(map, &rays, 0).unwrap();
    (hits.hit[0] == 1).then(|| (hits.distances_m[0], hits.voxels[0].index()))
}

/// Part of a ray along one axis within voxel `index`, meters: where it enters and where it leaves.
fn within(origin: f64, direction: f64, index: i32, voxel_m: f64) -> (f64, f64) {
    let border_m = |index: i32| (f64::from(index) - origin / voxel_m) * (voxel_m / direction);
    if direction > 0.0 {
        (border_m(index), border_m(index + 1))
    } else if direction < 0.0 {
        (border_m(index + 1), border_m(index))
    } else if (origin / voxel_m).floor() == f64::from(index) {
        (f64::NEG_INFINITY, f64::INFINITY)
    } else {
        (f64::INFINITY, f64::NEG_INFINITY)
    }
}

/// The first hit, by a look at every voxel (the slab method of Kay and Kajiya).
fn first_of_all(
    map: &MultiResolutionMap,
    level: u32,
    origin: Point,
    (direction, range_m): ([f64; 3], f64),
) -> Option<(f32, VoxelKey)> {
    let (view, voxel_m, origin) =
        (map.view(), map.lattice().resolution_m(level), origin.xyz().map(f64::from));
    let met = |voxel: VoxelKey| {
        let (mut enters_m, mut leaves_m) = (0.0f64, range_m);
        for axis in 0..3 {
            let (enters, leaves) = within(origin[axis], direction[axis], voxel.index()[axis], voxel_m);
            (enters_m, leaves_m) = (enters_m.max(enters), leaves_m.min(leaves));
        }
        (enters_m < leaves_m).then_some((enters_m, voxel))
    };
    let all = view.lists(level).flat_map(|list| list.iter());
    // A ray may run in a voxel for less than an f32 tells.
    let first = all.filter_map(met).min_by(|a, b| a.0.total_cmp(&b.0));
    first.map(|(enters_m, voxel)| (enters_m as f32, voxel))
}

/// Directions along axes, along diagonals, and any.
fn direction() -> impl Strategy<Value = [f32; 3]> {
    let step = prop::array::uniform3(-1i32..=1).prop_map(|steps| steps.map(|step| step as f32));
    let any = prop::array::uniform3(-1.0f32..1.0);
    let tiny = prop::array::uniform3(prop::sample::select(vec![1.0f32, -1.0, 1e-7, -1e-20, 0.0]));
    prop_oneof![2 => step, 3 => any, 1 => tiny]
        .prop_filter("a direction", |d| d.iter().map(|c| c * c).sum::<f32>() > 1e-4)
        .prop_map(|d| {
            let length = d.iter().map(|c| c * c).sum::<f32>().sqrt();
            d.map(|c| c / length)
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, max_shrink_iters: 2000, ..ProptestConfig::default() })]

    #[test]
    fn a_leaping_ray_meets_what_a_look_at_every_voxel_finds(
        (history, level) in history_and_level(),
        rays in prop::collection::vec((point(), direction()), 1..40),
        range_m in prop_oneof![Just(f64::INFINITY), 0.1f64..60.0, (1i32..40).prop_map(|i| f64::from(i) * RESOLUTION_M)],
    ) {
        let map = history.map();
        let (origins, directions): (Vec<Point>, Vec<Point>) =
            rays.into_iter().map(|(origin, direction)| (origin, Point::from(direction))).unzip();
        let toward = Toward::Directions { directions: &directions, range_m };
        let hits = cast(&map, &Rays { origins: &origins, toward }, level).unwrap();
        prop_assert_eq!(hits.len(), origins.len());
        for (at, &origin) in origins.iter().enumerate() {
            let expected = first_of_all(&map, level, origin, toward.from(at, origin).unwrap());
            let found = (hits.hit[at / 64] >> (at % 64) & 1 == 1).then(|| (hits.distances_m[at], hits.voxels[at]));
            prop_assert_eq!(found, expected, "ray {} from {:?} along {:?}", at, origin, directions[at]);
            prop_assert!(found.is_some() || hits.distances_m[at].is_infinite());
        }
    }

    #[test]
    fn rays_that_begin_at_one_place_meet_what_a_look_at_every_voxel_finds(
        (history, level) in history_and_level(),
        bunches in prop::collection::vec((point(), prop::collection::vec(direction(), 1..12), 1usize..40), 1..3),
        range_m in prop_oneof![Just(f64::INFINITY), 0.1f64..60.0],
    ) {
        let map = history.map();
        // Each direction some times: the more rays begin at a place, the larger is the box that is looked for.
        let rays = bunches.iter().flat_map(|(origin, directions, times)| {
            directions.iter().flat_map(move |&direction| std::iter::repeat_n((*origin, Point::from(direction)), *times))
        });
        let (origins, directions): (Vec<Point>, Vec<Point>) = rays.unzip();
        let toward = Toward::Directions { directions: &directions, range_m };
        let hits = cast(&map, &Rays { origins: &origins, toward }, level).unwrap();
        let mut expected = None;
        for (at, &origin) in origins.iter().enumerate() {
            let is_new = at == 0 || (origins[at - 1].xyz(), directions[at - 1].xyz()) != (origin.xyz(), directions[at].xyz());
            if is_new {
                expected = first_of_all(&map, level, origin, toward.from(at, origin).unwrap());
            }
            let found = (hits.hit[at / 64] >> (at % 64) & 1 == 1).then(|| (hits.distances_m[at], hits.voxels[at]));
            prop_assert_eq!(found, expected, "ray {} from {:?} along {:?}", at, origin, directions[at]);
        }
        if let [(origin, ..)] = &bunches[..] {
            let one = cast(&map, &Rays { origins: &[*origin], toward }, level).unwrap();
            prop_assert_eq!(one, hits);
        }
    }

    #[test]
    fn a_ray_to_a_point_meets_what_a_look_at_every_voxel_finds(
        (history, level) in history_and_level(),
        rays in prop::collection::vec((point(), point()), 1..40),
    ) {
        let map = history.map();
        let (origins, ends): (Vec<Point>, Vec<Point>) =
            rays.into_iter().filter(|(origin, end)| origin.to_f64() != end.to_f64()).unzip();
        let toward = Toward::Ends(&ends);
        let hits = cast(&map, &Rays { origins: &origins, toward }, level);
        prop_assume!(!origins.is_empty());
        let hits = hits.unwrap();
        for (at, &origin) in origins.iter().enumerate() {
            let expected = first_of_all(&map, level, origin, toward.from(at, origin).unwrap());
            let found = (hits.hit[at / 64] >> (at % 64) & 1 == 1).then(|| (hits.distances_m[at], hits.voxels[at]));
            prop_assert_eq!(found, expected, "ray {} from {:?} to {:?}", at, origin, ends[at]);
        }
    }
}

#[test]
fn a_ray_ends_where_it_enters_the_voxel() {
    let map = map_of(&[[4, 0, 0]], 3);
    assert_eq!(cast_one(&map, [0.5, 0.5, 0.5], [1.0, 0.0, 0.0], 100.0), Some((3.5, [4, 0, 0])));
    assert_eq!(cast_one(&map, [9.25, 0.5, 0.5], [-1.0, 0.0, 0.0], 100.0), Some((4.25, [4, 0, 0])));
    assert_eq!(
        cast_one(&map, [4.5, 0.5, 0.5], [0.0, 0.0, 1.0], 100.0),
        Some((0.0, [4, 0, 0])),
        "it begins inside"
    );
    assert_eq!(cast_one(&map, [0.5, 0.5, 0.5], [1.0, 0.0, 0.0], 3.5), None, "it ends where it would enter");
    assert_eq!(cast_one(&map, [0.5, 0.5, 0.5], [1.0, 0.0, 0.0], 3.6), Some((3.5, [4, 0, 0])));
}

#[test]
fn a_ray_along_a_face_runs_in_the_upper_voxels() {
    let (upper, lower) = (map_of(&[[4, 0, 0]], 3), map_of(&[[4, -1, 0]], 3));
    for (origin, direction) in [([0.5, 0.0, 0.5], [1.0, 0.0, 0.0]), ([8.5, 0.0, 0.5], [-1.0, 0.0, 0.0])] {
        assert!(cast_one(&upper, origin, direction, 100.0).is_some());
        assert_eq!(cast_one(&lower, origin, direction, 100.0), None);
    }
}

#[test]
fn a_border_that_a_ray_crosses_belongs_to_the_voxel_that_it_moves_into() {
    let map = map_of(&[[0, 0, 0], [-1, 0, 0]], 3);
    assert_eq!(cast_one(&map, [0.0, 0.5, 0.5], [1.0, 0.0, 0.0], 9.0), Some((0.0, [0, 0, 0])));
    assert_eq!(cast_one(&map, [0.0, 0.5, 0.5], [-1.0, 0.0, 0.0], 9.0), Some((0.0, [-1, 0, 0])));
}

#[test]
fn a_ray_through_an_edge_or_a_corner_goes_to_the_voxel_across() {
    let across = std::f32::consts::FRAC_1_SQRT_2;
    let beside = map_of(&[[2, 1, 0], [1, 2, 0]], 3);
    assert_eq!(cast_one(&beside, [0.5, 0.5, 0.5], [across, across, 0.0], 9.0), None);
    let across_it = map_of(&[[2, 1, 0], [1, 2, 0], [3, 3, 0]], 3);
    assert_eq!(cast_one(&across_it, [0.5, 0.5, 0.5], [across, across, 0.0], 9.0).unwrap().1, [3, 3, 0]);
    let downward = map_of(&[[4, 0, 0], [5, 1, 0], [3, 2, 0]], 3);
    assert_eq!(cast_one(&downward, [5.5, 0.5, 0.5], [-across, across, 0.0], 9.0).unwrap().1, [3, 2, 0]);
}

#[test]
fn a_level_is_met_where_its_larger_voxels_begin() {
    let map = map_of(&[[7, 0, 0]], 4);
    let (origins, directions) = ([Point::new(-3.5, 0.5, 0.5)], [Point::new(1.0, 0.0, 0.0)]);
    let rays =
        Rays { origins: &origins, toward: Toward::Directions { directions: &directions, range_m: 50.0 } };
    let distances = [0, 1, 2, 3].map(|level| cast(&map, &rays, level).unwrap().distances_m[0]);
    assert_eq!(distances, [10.5, 9.5, 7.5, 3.5]);
}

#[test]
fn what_is_no_ray_is_named() {
    let map = map_of(&[[4, 0, 0]], 3);
    fn said(map: &MultiResolutionMap, origins: &[Point], toward: Toward<'_>) -> String {
        cast(map, &Rays { origins, toward }, 0).unwrap_err().to_string()
    }
    let (here, along) = ([Point::new(0.5, 0.5, 0.5)], [Point::new(1.0, 0.0, 0.0); 2]);
    fn directions(directions: &[Point]) -> Toward<'_> {
        Toward::Directions { directions, range_m: 1.0 }
    }
    for bad in
        [[0.0, 0.0, 0.0], [0.99, 0.0, 0.0], [2.0, 0.0, 0.0], [f32::NAN, 1.0, 0.0], [f32::INFINITY, 0.0, 0.0]]
    {
        let bad = [along[0], bad.into()];
        assert!(
            said(&map, &here, directions(&bad)).starts_with("directions[1] must have length 1"),
            "{bad:?}"
        );
    }
    for bad in
        [[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [0.0, 0.0, 1_048_576.0], [-1_048_577.0, 0.0, 0.0]]
    {
        let bad = [here[0], bad.into()];
        assert!(said(&map, &bad, directions(&along)).starts_with("origins[1] must lie in"), "{bad:?}");
    }
    for bad in [[0.5, 0.5, 0.5], [f32::NAN, 0.0, 0.0], [f32::NEG_INFINITY, 0.0, 0.0]] {
        let bad = [bad.into()];
        assert!(
            said(&map, &here, Toward::Ends(&bad)).starts_with("ends[0] must be finite and apart"),
            "{bad:?}"
        );
    }
    for range_m in [0.0, -1.0, f64::NAN] {
        let toward = Toward::Directions { directions: &along, range_m };
        assert!(said(&map, &here, toward).starts_with("range_m must be above 0"));
    }
    assert!(said(&map, &[here[0]; 3], directions(&along)).contains("one for each of the 2 rays, got 3"));
    assert!(
        cast(&map, &Rays { origins: &here, toward: directions(&[[1.0009, 0.0, 0.0].into()]) }, 0).is_ok()
    );
}

#[test]
fn no_voxel_and_no_ray_are_no_trouble() {
    assert_eq!(cast_one(&map_of(&[], 3), [0.5; 3], [1.0, 0.0, 0.0], f64::INFINITY), None);
    let nothing = Rays { origins: &[], toward: Toward::Ends(&[]) };
    assert!(cast(&map_of(&[[0; 3]], 3), &nothing, 0).unwrap().is_empty());
}

#[test]
fn a_stopped_cast_ends_early() {
    let (origins, ends) = ([Point::new(0.5, 0.5, 0.5)], [Point::new(9.0, 0.5, 0.5); 10]);
    let rays = Rays { origins: &origins, toward: Toward::Ends(&ends) };
    let map = map_of(&[[4, 0, 0]], 3);
    assert_eq!(cast(&map, &rays, 0).unwrap().hits(), 10);
    let hits = cast_rays(&map.view(), &rays, 0, StopSignal::when(&|| true)).unwrap();
    assert_eq!((hits.len(), hits.hits()), (10, 0));
}
