//! All questions among keep-outs of all four kinds, against brute force: the answer about voxels, and every shape.

use std::sync::Arc;

use proptest::prelude::*;

use crate::geometry::Point;
use crate::map::test_shapes::shape;
use crate::map::{
    KeepOut, KeepOutName, KeepOutShape, KeepOuts, MapContents, MapSettings, MultiResolutionMap, ShapeRay,
};
use crate::planning::body::{CellsFromLink, LinkPose};
use crate::planning::*;
use crate::util::StopSignal;
use crate::voxel::VoxelKey;

pub(super) const RESOLUTION_M: f64 = 0.5;
const NEVER: StopSignal<'static> = StopSignal::NEVER;

/// A map of a few voxels, and keep-outs.
pub(super) fn map() -> impl Strategy<Value = Arc<MultiResolutionMap>> {
    let voxels = prop::collection::vec(prop::array::uniform3(-40i32..40), 0..30);
    (voxels, prop::collection::vec(shape(), 1..5)).prop_map(|(voxels, shapes)| map_of(voxels, shapes))
}

/// A map of three levels.
pub(super) fn map_of(voxels: Vec<[i32; 3]>, shapes: Vec<KeepOutShape>) -> Arc<MultiResolutionMap> {
    let named = |(i, shape)| KeepOut {
        name: KeepOutName::new(&format!("k{i}")).unwrap(),
        shape,
        made_by: None,
        made_revision: 1,
        expires_at_ns: None,
    };
    let keep_outs: KeepOuts = shapes.into_iter().enumerate().map(named).collect();
    let voxels = voxels.into_iter().filter_map(VoxelKey::new).collect();
    let contents =
        MapContents { revision: 9, voxels, keep_outs: Arc::new(keep_outs), ..MapContents::default() };
    let settings = MapSettings::new(RESOLUTION_M, 3);
    Arc::new(MultiResolutionMap::restore(settings, contents.checked().unwrap()).unwrap())
}

fn link() -> impl Strategy<Value = Link> {
    let sphere = (prop::array::uniform3(-1.0f32..1.0), 0.0f32..0.8)
        .prop_map(|(center_m, radius_m)| Sphere { center_m, radius_m });
    let points = prop::collection::vec(prop::array::uniform3(-1.0f32..1.0).prop_map(Point::from), 0..4);
    let padding = prop_oneof![Just(0.0), 0.0f32..0.4];
    (prop::collection::vec(sphere, 0..4), points, padding).prop_map(|(spheres, points, padding_m)| Link {
        spheres,
        points,
        padding_m,
    })
}

fn pose() -> impl Strategy<Value = [f32; 7]> {
    let turned = prop::array::uniform4(-1.0f32..1.0).prop_map(|q| {
        let norm = q.iter().map(|c| c * c).sum::<f32>().sqrt();
        if norm > 0.1 { q.map(|c| c / norm) } else { [0.0, 0.0, 0.0, 1.0] }
    });
    (prop::array::uniform3(-25.0f32..25.0), turned)
        .prop_map(|([x, y, z], [a, b, c, d])| [x, y, z, a, b, c, d])
}

/// A body of two links, and an even number of configurations.
pub(super) fn body_and_poses() -> impl Strategy<Value = (Body, Vec<f32>)> {
    let links = prop::collection::vec(link(), 2)
        .prop_filter("a body has a part", |links| links.iter().any(Link::has_parts));
    (links, prop::collection::vec(pose(), 2 * 6))
        .prop_map(|(links, poses)| (Body::new(links).unwrap(), poses.concat()))
}

/// All shapes, looked at one by one.
pub(super) struct BruteForce(pub(super) Arc<KeepOuts>);

impl BruteForce {
    /// The parts of a link in the map frame: center, radius, and whether it is a bare point.
    fn parts(link: &Link, at: &CellsFromLink) -> Vec<([f64; 3], f64, bool)> {
        let padding_m = f64::from(link.padding_m);
        let center = |center: [f32; 3]| at.cells(center.map(f64::from));
        let spheres = link.spheres.iter();
        let spheres = spheres.map(|of| (center(of.center_m), f64::from(of.radius_m) + padding_m, false));
        let points = link.points.iter().map(|point| (center(point.xyz()), padding_m, padding_m == 0.0));
        spheres.chain(points).collect()
    }

    /// What a part meets: the nearest, and of those as near the first.
    fn met(&self, (center, radius, is_point): ([f64; 3], f64, bool)) -> Option<&KeepOutName> {
        let meeting = self.0.iter().filter(|keep_out| match is_point {
            true => keep_out.shape.contains(center),
            false => keep_out.shape.distance_m(center) <= radius,
        });
        let distance = |keep_out: &KeepOut| keep_out.shape.distance_m(center);
        meeting.min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|keep_out| &keep_out.name)
    }

    pub(super) fn first_hit(&self, body: &Body, poses: &[LinkPose]) -> Option<Hit> {
        body.links().iter().zip(poses).zip(0..).find_map(|((link, pose), number)| {
            let parts = Self::parts(link, &CellsFromLink::of(pose, 1.0));
            let met = parts.into_iter().zip(0..).find_map(|(part, i)| Some((i, self.met(part)?)));
            met.map(|(part, name)| Hit { link: number, part, met: Met::KeepOut(name.clone()) })
        })
    }

    /// How far a part is within a shape at most, meters: spheres by their radius, bare points not at all; less than 0
    /// outside.
    pub(super) fn depth_m(&self, body: &Body, poses: &[LinkPose]) -> f64 {
        let parts = body.links().iter().zip(poses);
        let parts = parts.flat_map(|(link, pose)| Self::parts(link, &CellsFromLink::of(pose, 1.0)));
        let depths = parts.flat_map(|(center, radius, _)| {
            self.0.iter().map(move |keep_out| radius - keep_out.shape.distance_m(center))
        });
        depths.fold(f64::NEG_INFINITY, f64::max)
    }

    /// The distance of each link.
    pub(super) fn distances_m(&self, body: &Body, poses: &[LinkPose]) -> Vec<f64> {
        let of_link = |(link, pose): (&Link, &LinkPose)| {
            let parts = Self::parts(link, &CellsFromLink::of(pose, 1.0)).into_iter();
            let far = parts.flat_map(|(center, radius, _)| {
                self.0.iter().map(move |keep_out| (keep_out.shape.distance_m(center) - radius).max(0.0))
            });
            far.fold(f64::INFINITY, f64::min)
        };
        body.links().iter().zip(poses).map(of_link).collect()
    }

    fn clearance(&self, body: &Body, poses: &[LinkPose], voxels: Clearance) -> Clearance {
        self.distances_m(body, poses).into_iter().zip(0u32..).fold(voxels, |best, (distance_m, link)| {
            let distance_m = distance_m as f32;
            let is_first = distance_m == best.distance_m && best.link.is_some_and(|best| link < best);
            if distance_m < best.distance_m || is_first {
                Clearance { distance_m, link: Some(link) }
            } else {
                best
            }
        })
    }
}

pub(super) fn poses_of(numbers: &[f32]) -> Vec<LinkPose> {
    numbers.as_chunks().0.iter().map(LinkPose::of).collect()
}

fn is_set(words: &[u64], i: usize) -> bool {
    words[i / 64] >> (i % 64) & 1 == 1
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn bodies_meet_what_voxels_or_shapes_they_meet((body, numbers) in body_and_poses(), map in map(), level in 0u32..3) {
        let planner = Planner::new(Arc::clone(&map));
        let configurations = Configurations::new(&numbers, 2).unwrap();
        let question = PoseQuestion { body: &body, configurations, level, surroundings: &Surroundings::ALL_VOXELS };
        let (of_voxels, brute) = (planner.view(), BruteForce(map.keep_outs()));
        let voxel_hits = of_voxels.first_hits(&question, NEVER).unwrap().unwrap();
        let voxel_clearances = of_voxels.clearances(&question, 8.0, NEVER).unwrap().unwrap();
        drop(of_voxels);
        let view = planner.view().with_keep_outs();
        let bits = view.bodies_meet(&question, NEVER).unwrap().unwrap();
        let hits = view.first_hits(&question, NEVER).unwrap().unwrap();
        let clearances = view.clearances(&question, 8.0, NEVER).unwrap().unwrap();
        for i in 0..6 {
            let poses = poses_of(&numbers[14 * i..14 * (i + 1)]);
            let place = |hit: &Hit| (hit.link, hit.part, hit.met.voxel().is_none());
            let first = voxel_hits[i].iter().cloned().chain(brute.first_hit(&body, &poses)).min_by_key(place);
            prop_assert_eq!(&hits[i], &first);
            prop_assert_eq!(is_set(&bits, i), first.is_some());
            prop_assert_eq!(clearances[i], brute.clearance(&body, &poses, voxel_clearances[i]));
        }
    }

    #[test]
    fn spheres_meet_what_a_body_of_them_meets((body, _) in body_and_poses(), map in map(), at in prop::array::uniform3(-20.0f32..20.0)) {
        let planner = Planner::new(Arc::clone(&map));
        let [x, y, z] = at;
        let placed = |of: &Sphere| Sphere { center_m: std::array::from_fn(|axis| of.center_m[axis] + at[axis]), ..*of };
        let spheres: Vec<Sphere> = body.links().iter().flat_map(|link| &link.spheres).map(placed).collect();
        let sizes = [spheres.len() as u32];
        let groups = SphereGroups::new(&spheres, &sizes).unwrap();
        let question = SphereQuestion { groups, padding_m: 0.2, level: 0, surroundings: &Surroundings::ALL_VOXELS };
        prop_assume!(!spheres.is_empty());
        let one = Body::new(vec![Link { spheres: spheres.clone(), padding_m: 0.2, ..Link::default() }]).unwrap();
        let numbers = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let configurations = Configurations::new(&numbers, 1).unwrap();
        let same = PoseQuestion { body: &one, configurations, level: 0, surroundings: &Surroundings::ALL_VOXELS };
        let view = planner.view().with_keep_outs();
        prop_assert_eq!(view.spheres_meet(&question, NEVER), view.bodies_meet(&same, NEVER), "at {} {} {}", x, y, z);
        prop_assert_eq!(view.first_sphere_hits(&question, NEVER), view.first_hits(&same, NEVER));
        prop_assert_eq!(view.sphere_clearances(&question, 5.0, NEVER), view.clearances(&same, 5.0, NEVER));
    }

    #[test]
    fn rays_end_at_the_first_voxel_or_shape(
        map in map(), ways in prop::collection::vec((prop::array::uniform3(-25.0f32..25.0), prop::array::uniform3(-25.0f32..25.0)), 20), level in 0u32..3,
    ) {
        let ways = ways.into_iter().filter(|(from, to)| from != to);
        let (from, to): (Vec<Point>, Vec<Point>) = ways.map(|(from, to)| (Point::from(from), Point::from(to))).unzip();
        let rays = Rays { origins: &from, toward: Toward::Ends(&to) };
        let of_voxels = cast_rays(&map.view(), &rays, level, NEVER).unwrap();
        let told = cast_rays(&map.view().with_keep_outs(), &rays, level, NEVER).unwrap();
        for (i, (from, to)) in from.iter().zip(&to).enumerate() {
            let (origin_m, end) = (from.xyz().map(f64::from), to.xyz().map(f64::from));
            let way: [f64; 3] = std::array::from_fn(|axis| end[axis] - origin_m[axis]);
            let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
            let ray = ShapeRay { origin_m, direction: way.map(|c| c / length) };
            let keep_outs = map.keep_outs();
            let entered = keep_outs.iter().filter_map(|of| Some((of.shape.entered_m(&ray)?, &of.name)));
            let before = entered.filter(|(at, _)| *at < length && *at < f64::from(of_voxels.distances_m[i]));
            let first = before.min_by(|a, b| a.0.total_cmp(&b.0));
            let name = told.keep_outs.get(i).cloned().flatten();
            prop_assert_eq!(name.as_ref(), first.map(|(_, name)| name));
            prop_assert_eq!(told.distances_m[i], first.map_or(of_voxels.distances_m[i], |(at, _)| at as f32));
            prop_assert_eq!(is_set(&told.hit, i), first.is_some() || is_set(&of_voxels.hit, i));
            prop_assert_eq!(told.voxels[i], if first.is_some() { VoxelKey::default() } else { of_voxels.voxels[i] });
        }
    }

    #[test]
    fn the_nearest_is_a_shape_where_no_voxel_is_nearer(
        map in map(), points in prop::collection::vec(prop::array::uniform3(-25.0f32..25.0), 20), to in prop::sample::select(vec![MeasuredTo::Cubes, MeasuredTo::Centers]),
    ) {
        let points: Vec<Point> = points.into_iter().map(Point::from).collect();
        let request = NearestRequest { points: &points, level: 0, radius_m: 4.0, to };
        let of_voxels = find_nearest(&map.view(), &request, NEVER).unwrap();
        let told = find_nearest(&map.view().with_keep_outs(), &request, NEVER).unwrap();
        for (i, point) in points.iter().enumerate() {
            let (at, keep_outs) = (point.xyz().map(f64::from), map.keep_outs());
            let near = keep_outs.iter().map(|of| (of.shape.distance_m(at), of));
            let near = near.filter(|(d, _)| *d <= 4.0 && *d < f64::from(of_voxels.distances_m[i]));
            let first = near.min_by(|a, b| a.0.total_cmp(&b.0));
            let name = told.keep_outs.get(i).cloned().flatten();
            prop_assert_eq!(name.as_ref(), first.map(|(_, of)| &of.name));
            prop_assert_eq!(told.distances_m[i], first.map_or(of_voxels.distances_m[i], |(d, _)| d as f32));
            prop_assert_eq!(is_set(&told.found, i), first.is_some() || is_set(&of_voxels.found, i));
            let Some((distance_m, keep_out)) = first else { continue };
            let back: [f64; 3] = std::array::from_fn(|axis| at[axis] - distance_m * f64::from(told.away[i][axis]));
            prop_assert!(keep_out.shape.distance_m(back) < 1e-5, "the way away begins at the shape");
            let length = told.away[i].iter().map(|c| c * c).sum::<f32>().sqrt();
            let expected = if distance_m > 0.0 { 1.0 } else { 0.0 };
            prop_assert!((length - expected).abs() < 1e-5);
        }
    }

    #[test]
    fn a_cell_is_occupied_where_a_voxel_or_a_point_of_a_shape_is(map in map(), low in -20.0..20.0f64, height in 0.5..9.0f64, side in 1u32..4) {
        let area = GridArea::Rectangle { min_m: [-12.0; 2], max_m: [12.0; 2] };
        let cell_m = f64::from(side) * RESOLUTION_M;
        let request = GridRequest { level: 0, area, band_m: [low, low + height], band_from: BandFrom::Map, cell_m, tells_unknown: false, cells_max: 10_000 };
        let of_voxels = project_grid(&mut map.view().into(), &request, NEVER).unwrap();
        let told = project_grid(&mut map.view().with_keep_outs().into(), &request, NEVER).unwrap();
        prop_assert_eq!(told.tops_m.iter().map(|top| top.to_bits()).collect::<Vec<_>>(), of_voxels.tops_m.iter().map(|top| top.to_bits()).collect::<Vec<_>>());
        let keep_outs = map.keep_outs();
        for number in 0..told.cells() {
            let corner = [number % told.size[0], number / told.size[0]];
            let corner: [f64; 2] = std::array::from_fn(|axis| told.origin_m[axis] + corner[axis] as f64 * told.cell_m);
            let points = || (0..5 * 5 * 9).map(|n: usize| {
                let share = |n: usize, of: usize| (n as f64 + 0.5) / of as f64;
                [corner[0] + cell_m * share(n % 5, 5), corner[1] + cell_m * share(n / 5 % 5, 5), low + height * share(n / 25, 9)]
            });
            let is_occupied = told.is_occupied(number);
            prop_assert!(is_occupied || !of_voxels.is_occupied(number) && !points().any(|point| keep_outs.contains(point)));
            if is_occupied && !of_voxels.is_occupied(number) {
                let far = points().flat_map(|point| keep_outs.iter().map(move |of| of.shape.distance_m(point)));
                let apart = (cell_m / 10.0 * 1.42).hypot(height / 18.0) + 1e-5;
                prop_assert!(far.fold(f64::INFINITY, f64::min) <= apart, "nothing is near");
            }
        }
    }
}
