//! Bodies as a level's field is asked for them: in groups of eight, with a ball around each link.

use super::parts::{Link, Sphere};
use super::placement::{CellsFromLink, EightTransforms};
use crate::geometry::Point;
use crate::planning::clearance::{Centers, LANES};
use crate::planning::error::{PlanningError, SpherePlace};

/// Largest radius with padding, in voxels of the level that is asked.
pub(super) const RADIUS_CELLS_MAX: f64 = 512.0;
/// Points whose surroundings are asked for at once.
pub(in crate::planning) const POINTS_PER_CLUMP: usize = 16;

/// Eight spheres at most.
#[derive(Debug, Clone)]
pub(in crate::planning) struct Group {
    /// The centers, meters in the link's frame, axis by axis; lanes that are not used repeat the first.
    centers_m: [[f64; LANES]; 3],
    /// The radii in cells; those of lanes that are not used are minus infinity, so that they meet nothing.
    pub(in crate::planning) radius: [f64; LANES],
    /// Bounds of the radii, rounded down and up.
    pub(in crate::planning) radius_low: [f32; LANES],
    pub(in crate::planning) radius_high: [f32; LANES],
    /// How many levels coarser the field is that is asked.
    pub(in crate::planning) coarser_by: u32,
}

/// A ball around something.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Ball {
    /// Meters in the link's frame.
    pub(super) center_m: [f64; 3],
    /// Cells.
    pub(super) radius: f64,
}

/// A link, in cells of a level.
#[derive(Debug, Clone)]
pub(in crate::planning) struct LinkInCells {
    /// The ball around all spheres, and points.
    pub(in crate::planning) ball: Ball,
    pub(in crate::planning) ball_group: Group,
    /// The spheres in order; points with padding after them.
    pub(in crate::planning) groups: Vec<Group>,
    /// How many there are.
    pub(in crate::planning) spheres: usize,
    /// Points without padding, in clumps of [`POINTS_PER_CLUMP`] near each other, and the number of each among the
    /// link's.
    pub(in crate::planning) points: Vec<Point>,
    pub(in crate::planning) numbers: Vec<usize>,
    /// The balls around the clumps, eight at a time.
    pub(in crate::planning) clumps: Vec<Group>,
    /// Those points as spheres of no radius.
    pub(in crate::planning) point_groups: Vec<Group>,
    /// How far from the link's origin the center of a sphere, or a point, is at most, and a point of the body; meters.
    pub(in crate::planning) center_extent_m: f64,
    pub(in crate::planning) extent_m: f64,
}

impl Group {
    /// Spheres with these centers (meters) and radii (cells); one at least, and eight at most.
    fn of(spheres: &[([f64; 3], f64)]) -> Self {
        let of_lane = |lane: usize| spheres.get(lane).unwrap_or(&spheres[0]).0;
        let centers_m = std::array::from_fn(|axis| std::array::from_fn(|lane| of_lane(lane)[axis]));
        let radius: [f64; LANES] =
            std::array::from_fn(|lane| spheres.get(lane).map_or(f64::NEG_INFINITY, |(_, radius)| *radius));
        let radius_low = radius.map(|radius| rounded(radius, -1.0));
        let radius_high = radius.map(|radius| rounded(radius, 1.0));
        let coarser_by = coarser_by(radius.into_iter().fold(0.0, f64::max));
        Self { centers_m, radius, radius_low, radius_high, coarser_by }
    }

    /// A ball eight times.
    pub(in crate::planning) fn of_one(ball: &Ball) -> Self {
        Self::of(&[(ball.center_m, ball.radius); LANES])
    }

    fn all(spheres: &[([f64; 3], f64)]) -> Vec<Self> {
        spheres.chunks(LANES).map(Self::of).collect()
    }

    /// The centers in cells, each by a transform of its own.
    #[inline(always)]
    pub(in crate::planning) fn centers_of_each(&self, transforms: &EightTransforms) -> Centers {
        transforms.cells(&self.centers_m)
    }

    /// The centers in cells.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "a lane goes through several arrays")]
    pub(in crate::planning) fn centers(&self, cells_from_link: &CellsFromLink) -> Centers {
        let mut centers = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let center = cells_from_link.cells([0, 1, 2].map(|axis: usize| self.centers_m[axis][lane]));
            (0..3).for_each(|axis| centers[axis][lane] = center[axis]);
        }
        centers
    }
}

impl Ball {
    /// A ball around spheres with these centers (meters) and radii (cells).
    fn around(spheres: &[([f64; 3], f64)], cells_per_m: f64) -> Self {
        let count = spheres.len().max(1) as f64;
        let mean = |axis: usize| spheres.iter().map(|(center, _)| center[axis]).sum::<f64>() / count;
        let bounds = |axis: usize| {
            let ends = spheres.iter().map(|(center, _)| center[axis]);
            let (low, high) =
                ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
            if low <= high { (low + high) / 2.0 } else { 0.0 }
        };
        let ball = |center_m: [f64; 3]| {
            let radius =
                |(center, radius): &([f64; 3], f64)| distance(center_m, *center) * cells_per_m + radius;
            Self { center_m, radius: spheres.iter().map(radius).fold(0.0, f64::max) }
        };
        let [a, b] = [ball([0, 1, 2].map(mean)), ball([0, 1, 2].map(bounds))];
        if a.radius < b.radius { a } else { b }
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

impl LinkInCells {
    pub(super) fn of(link: &Link, number: usize, cells_per_m: f64) -> Result<Self, PlanningError> {
        let (balls, points) = link.balls_and_points();
        Self::of_parts(balls, &points, |sphere| SpherePlace::InLink { link: number, sphere }, cells_per_m)
    }

    /// A link of spheres alone: those of a group, after `before` others.
    pub(in crate::planning) fn of_spheres(
        spheres: &[Sphere],
        padding_m: f32,
        before: usize,
        cells_per_m: f64,
    ) -> Result<Self, PlanningError> {
        let balls = spheres.iter().map(|sphere| sphere.padded(padding_m)).collect();
        Self::of_parts(balls, &[], |sphere| SpherePlace::InGroups(before + sphere), cells_per_m)
    }

    /// True of a link without a sphere or a point.
    #[inline(always)]
    pub(super) fn is_nowhere(&self) -> bool {
        self.spheres == 0 && self.points.is_empty()
    }

    /// Each sphere eight times.
    fn singles(&self) -> Vec<Group> {
        let single = |sphere: usize| {
            let (group, lane) = (&self.groups[sphere / LANES], sphere % LANES);
            let center_m = std::array::from_fn(|axis| group.centers_m[axis][lane]);
            Group::of_one(&Ball { center_m, radius: group.radius[lane] })
        };
        (0..self.spheres).map(single).collect()
    }

    fn of_parts(
        balls_m: Vec<([f64; 3], f64)>,
        points_m: &[[f64; 3]],
        place_of: impl Fn(usize) -> SpherePlace,
        cells_per_m: f64,
    ) -> Result<Self, PlanningError> {
        let in_cells = |(center_m, radius_m): ([f64; 3], f64)| (center_m, radius_m * cells_per_m);
        let spheres: Vec<_> = balls_m.into_iter().map(in_cells).collect();
        if let Some(sphere) = spheres.iter().position(|(_, radius)| *radius > RADIUS_CELLS_MAX) {
            let (radius, radius_max) = (spheres[sphere].1, RADIUS_CELLS_MAX);
            return Err(PlanningError::RadiusInVoxels { place: place_of(sphere), radius, radius_max });
        }
        let (points, numbers, clumps) = clumps(points_m, cells_per_m);
        let of_points: Vec<_> = points.iter().map(|point| (point.xyz().map(f64::from), 0.0)).collect();
        let all = [&spheres[..], &of_points[..]].concat();
        let extent_m = |share: f64| {
            let from_origin = |(center, radius): &([f64; 3], f64)| {
                distance(*center, [0.0; 3]) + share * radius / cells_per_m
            };
            all.iter().map(from_origin).fold(0.0, f64::max)
        };
        let ball = Ball::around(&all, cells_per_m);
        Ok(Self {
            ball,
            ball_group: Group::of(&[(ball.center_m, ball.radius)]),
            groups: Group::all(&spheres),
            spheres: spheres.len(),
            point_groups: Group::all(&of_points),
            points,
            numbers,
            clumps,
            center_extent_m: extent_m(0.0),
            extent_m: extent_m(1.0),
        })
    }
}

/// Points in an order in which neighbors follow each other, the number of each, and balls around some of them at a
/// time.
fn clumps(points_m: &[[f64; 3]], cells_per_m: f64) -> (Vec<Point>, Vec<usize>, Vec<Group>) {
    let mut numbers: Vec<usize> = (0..points_m.len()).collect();
    split(points_m, &mut numbers);
    let points = numbers.iter().map(|&n| Point::from(points_m[n].map(|c| c as f32))).collect();
    let ball = |members: &[usize]| {
        let spheres: Vec<_> = members.iter().map(|&n| (points_m[n], 0.0)).collect();
        let Ball { center_m, radius } = Ball::around(&spheres, cells_per_m);
        (center_m, radius)
    };
    let balls: Vec<_> = numbers.chunks(POINTS_PER_CLUMP).map(ball).collect();
    (points, numbers, Group::all(&balls))
}

/// Orders points so that each clump's are near each other: halves along the longest axis, at whole clumps.
fn split(points_m: &[[f64; 3]], numbers: &mut [usize]) {
    if numbers.len() <= POINTS_PER_CLUMP {
        return;
    }
    let length = |axis: usize| {
        let ends = numbers.iter().map(|&n| points_m[n][axis]);
        let (low, high) =
            ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
        high - low
    };
    let axis = (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
    let middle = numbers.len().div_ceil(POINTS_PER_CLUMP) / 2 * POINTS_PER_CLUMP;
    numbers.select_nth_unstable_by(middle, |&a, &b| points_m[a][axis].total_cmp(&points_m[b][axis]));
    let (low, high) = numbers.split_at_mut(middle);
    split(points_m, low);
    split(points_m, high);
}

/// A body, in cells of a level.
#[derive(Debug, Clone)]
pub(in crate::planning) struct BodyInCells {
    pub(in crate::planning) links: Vec<LinkInCells>,
    /// The balls around the links, eight at a time.
    pub(in crate::planning) balls: Vec<Group>,
    /// Of a body of one link with few spheres, each sphere eight times: for eight places at once.
    pub(in crate::planning) singles: Vec<Group>,
}

/// Spheres of a link, at most, that are looked up one by one at eight places.
const SINGLES_MAX: usize = 4 * LANES;

impl BodyInCells {
    pub(super) fn of(links: &[Link], cells_per_m: f64) -> Result<Self, PlanningError> {
        let links = links.iter().enumerate();
        let links = links.map(|(number, link)| LinkInCells::of(link, number, cells_per_m));
        let links = links.collect::<Result<Vec<_>, _>>()?;
        let singles = match &links[..] {
            [link] if link.spheres <= SINGLES_MAX => link.singles(),
            _ => Vec::new(),
        };
        Ok(Self { singles, ..Self::of_links(links) })
    }

    /// A body of one link.
    pub(in crate::planning) fn of_link(link: LinkInCells) -> Self {
        Self::of_links(vec![link])
    }

    fn of_links(links: Vec<LinkInCells>) -> Self {
        let balls: Vec<_> = links.iter().map(|link| (link.ball.center_m, link.ball.radius)).collect();
        Self { balls: Group::all(&balls), links, singles: Vec::new() }
    }
}

/// A bound of a radius in f32, below or above it by more than rounding does.
fn rounded(radius: f64, sign: f64) -> f32 {
    if radius.is_finite() { (radius + sign * (radius * 1e-6 + 1e-6)) as f32 } else { f32::NEG_INFINITY }
}

/// Radius, in cells of a field, up to which that field decides best.
const RADIUS_CELLS_BEST: f64 = 5.0;

/// How many levels coarser the field is that decides best of a ball of `radius` cells.
fn coarser_by(radius: f64) -> u32 {
    (0..8).find(|&up| radius <= RADIUS_CELLS_BEST * f64::from(1u32 << up)).unwrap_or(8)
}
