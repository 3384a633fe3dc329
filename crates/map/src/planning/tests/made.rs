//! Maps, bodies and poses that are made at random.

use proptest::prelude::*;

use crate::geometry::Point;
use crate::map::{MultiResolutionMap, Region};
use crate::planning::*;
use crate::voxel::{VoxelKey, VoxelSet};

/// Side of a finest voxel, meters.
pub(super) const RESOLUTION_M: f64 = 0.5;

/// A change: voxels that go, and voxels that come.
pub(super) type Exchange = (Vec<[i32; 3]>, Vec<[i32; 3]>);

pub(super) fn voxels(indices: &[[i32; 3]]) -> VoxelSet {
    indices.iter().filter_map(|index| VoxelKey::new(*index)).collect()
}

pub(super) fn exchange(map: &MultiResolutionMap, (removed, added): &Exchange) {
    map.committer().exchange(&voxels(removed), &voxels(added));
}

/// Few voxels here and there, dense ones in a corner, and a part of a wall.
pub(super) fn indices() -> impl Strategy<Value = Vec<[i32; 3]>> {
    let anywhere = prop::collection::vec(prop::array::uniform3(-40i32..40), 0..12);
    let near = prop::collection::vec(prop::array::uniform3(-6i32..6), 0..40);
    let wall = (-20i32..20, 0..3usize, 0i32..14).prop_map(|(at, axis, size)| {
        let cells = (0..size * size).map(move |n| [n % size - 5, n / size - 7]);
        cells
            .map(|[a, b]| {
                let mut index = [a, b, at];
                index.swap(axis, 2);
                index
            })
            .collect::<Vec<_>>()
    });
    (anywhere, near, wall).prop_map(|(a, b, c)| [a, b, c].concat())
}

pub(super) fn exchanges() -> impl Strategy<Value = Vec<Exchange>> {
    prop::collection::vec((indices(), indices()), 0..4)
}

/// Numbers of which many are whole eighths, so that spheres touch faces exactly.
pub(super) fn number(most: i32) -> impl Strategy<Value = f32> {
    prop_oneof![
        (-8 * most..=8 * most).prop_map(|n| n as f32 / 8.0),
        (-1000i32..=1000).prop_map(move |n| n as f32 * most as f32 / 1000.0)
    ]
}

pub(super) fn radius_m() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => (0i32..16).prop_map(|n| n as f32 / 8.0),
        4 => 0.0f32..1.5,
        1 => 0.0f32..12.0,
        1 => Just(0.0),
        1 => Just(1e-6),
    ]
}

pub(super) fn link() -> impl Strategy<Value = Link> {
    let sphere = (prop::array::uniform3(number(1)), radius_m())
        .prop_map(|(center_m, radius_m)| Sphere { center_m, radius_m });
    let points = prop_oneof![3 => prop::collection::vec(prop::array::uniform3(number(1)), 0..4),
        1 => prop::collection::vec(prop::array::uniform3(number(3)), 60..90)];
    let padding = prop_oneof![2 => Just(0.0), 1 => 0.0f32..0.5, 1 => Just(0.25)];
    (prop::collection::vec(sphere, 0..12), points, padding).prop_map(|(spheres, points, padding_m)| Link {
        spheres,
        points: points.into_iter().map(Point::from).collect(),
        padding_m,
    })
}

pub(super) fn pose() -> impl Strategy<Value = [f32; 7]> {
    let turned = prop::array::uniform4(-1.0f32..1.0).prop_map(|q| {
        let norm = q.iter().map(|c| c * c).sum::<f32>().sqrt();
        if norm > 0.1 { q.map(|c| c / norm) } else { [0.0, 0.0, 0.0, 1.0] }
    });
    let rotation = prop_oneof![1 => Just([0.0, 0.0, 0.0, 1.0]), 2 => turned];
    let far = prop::sample::select(vec![-524_200.0f32, 524_200.5]);
    let coordinate = prop_oneof![30 => number(20).boxed(), 1 => far.boxed()];
    (prop::array::uniform3(coordinate), rotation).prop_map(|([x, y, z], [a, b, c, d])| [x, y, z, a, b, c, d])
}

pub(super) fn near_pose() -> impl Strategy<Value = [f32; 7]> {
    (pose(), prop::array::uniform3(number(4))).prop_map(|([.., a, b, c, d], [x, y, z])| [x, y, z, a, b, c, d])
}

pub(super) fn body_and_poses(poses: std::ops::Range<usize>) -> impl Strategy<Value = (Body, Vec<f32>)> {
    let links = prop::collection::vec(link(), 1..4)
        .prop_filter("a body has a part", |links| links.iter().any(Link::has_parts));
    (links, poses).prop_flat_map(|(links, count)| {
        let pose = prop_oneof![pose(), near_pose()];
        let poses = prop::collection::vec(pose, links.len() * count);
        (Just(Body::new(links).unwrap()), poses.prop_map(|poses| poses.concat()))
    })
}

pub(super) fn surroundings() -> impl Strategy<Value = Surroundings> {
    let cuboid = (prop::array::uniform3(-6.0f64..3.0), prop::array::uniform3(0.0f64..6.0))
        .prop_map(|(low, size)| Region::cuboid(low, std::array::from_fn(|i| low[i] + size[i])).unwrap());
    let ball = (prop::array::uniform3(-5.0f64..5.0), 0.0f64..4.0)
        .prop_map(|(center_m, radius_m)| Region::ball(center_m, radius_m).unwrap());
    let regions = prop::collection::vec(prop_oneof![cuboid, ball], 1..3);
    prop_oneof![3 => Just(Vec::new()), 1 => regions]
        .prop_map(|ignored| Surroundings { ignored, ..Surroundings::ALL_VOXELS })
}
