//! Free space: what scans looked through cannot be occupied, neither where an alignment puts this scan nor where others
//! were.
//!
//! The paper stores no free space and generates it where it is asked for, from the recorded poses (III-B). Here it is
//! asked for at a sample of rays: those of the scan, which must not pass through what the map holds, and those from
//! earlier viewpoints to the scan's points, which must not go on to surfaces behind them. In a building that repeats
//! itself a scan fits at places where it was not taken; there it is contradicted by one or the other.

use crate::geometry::{Point, Pose};
use crate::map::{Lookup, MapView, MultiResolutionMap};
use crate::util::StopSignal;
use crate::voxel::LatticeFromPoints;

/// When free space contradicts where an alignment puts a scan.
///
/// It is asked of poses far from their guess alone: near it there is no better explanation, and a robot in a crowd, or one
/// whose points do not come from one place, is believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeSpaceSettings {
    /// Number of the scan's points whose rays are followed. 300; 0 asks nothing.
    pub rays: usize,
    /// Number of earlier viewpoints that the points are looked at from. 8.
    pub viewpoints: usize,
    /// A pose is far from its guess beyond so many r_0. 12.
    pub far_above: f64,
    /// Or beyond so many degrees. 25.
    pub far_above_deg: f64,
    /// Of the points within 8 r_0 of what the map holds, the share that has to be on it. 0.72: right poses in maps of several
    /// scans have 0.74 to 1, wrong ones up to 0.71 but in rooms of one shape.
    pub explained_min: f64,
    /// Share of the rays that may pass through what the map holds. 0.5: on a street with rough ground right poses have 0.4.
    pub blocked_max: f64,
    /// Share of the points that may lie where earlier scans saw through. 0.1; right poses have up to 0.03.
    pub seen_through_max: f64,
}

impl Default for FreeSpaceSettings {
    fn default() -> Self {
        Self {
            rays: 300,
            viewpoints: 8,
            far_above: 12.0,
            far_above_deg: 25.0,
            explained_min: 0.72,
            blocked_max: 0.5,
            seen_through_max: 0.1,
        }
    }
}

impl FreeSpaceSettings {
    /// True where free space is asked of a pose so many meters and degrees from its guess.
    pub(super) fn is_asked_at(&self, (meters, degrees): (f64, f64), resolution_m: f64) -> bool {
        self.rays > 0 && (meters > self.far_above * resolution_m || degrees > self.far_above_deg)
    }
}

/// What free space says against a scan at a pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Contradiction {
    /// Share of the scan's rays that pass through what the map holds and come out behind it.
    pub blocked: f64,
    /// Share of the scan's points that an earlier viewpoint sees through: nothing is in the map before them or around
    /// them, and there is something behind them.
    pub seen_through: f64,
    /// Of the points near what the map holds, the share that is not on it.
    pub unexplained: f64,
}

/// The level whose occupied voxels are near what the map holds: 8 r_0.
const NEAR_LEVEL: usize = 3;

/// Step along a ray, in voxels.
const STEP: f64 = 0.5;
/// Steps of a ray, at most: what is farther away is looked at in longer steps.
const STEPS_MAX: f64 = 1024.0;
/// Length of a ray within occupied voxels, in voxels, from which on it passes through a surface: in a single voxel it is
/// for one at most, unless it crosses it askew, and past a corner too.
const THROUGH: f64 = 1.4;
/// Length of a ray in free space, in voxels, from which on it has come out.
const OPEN: f64 = 3.0;
/// Distance from a point, in voxels, within which a surface is its own.
const AROUND: f64 = 2.0;
/// Two viewpoints nearer to each other than this, in voxels, see the same.
const APART: f64 = 4.0;
/// Viewpoints among which the nearest are looked for, at most: the trajectory's last ones, at even distances.
const VIEWPOINTS_MAX: usize = 16 << 10;

impl Contradiction {
    /// Says against a scan at a pose what free space says; `points` are a sample of it, sensor frame, meters.
    ///
    /// Once `stop` is set, the result is meaningless.
    pub(super) fn of(
        map: &MultiResolutionMap,
        points: &[Point],
        map_from_sensor: &Pose,
        settings: &FreeSpaceSettings,
        stop: StopSignal<'_>,
    ) -> Self {
        let stride = points.len().div_ceil(settings.rays.max(1)).max(1);
        let points: Vec<Point> = points
            .iter()
            .step_by(stride)
            .map(|point| Point::from(map_from_sensor * point.to_f64()))
            .collect();
        if points.is_empty() || settings.rays == 0 || stop.is_stopped() {
            return Self::default();
        }
        let origin = Point::from(nalgebra::Point3::from(map_from_sensor.translation.vector));
        let viewpoints = viewpoints_near(map, origin, settings.viewpoints);
        let view = map.view();
        let space = Space {
            view: &view,
            lattice: map.lattice().from_map(),
            resolution_m: map.lattice().resolution_m(0),
            coarse: 1.min(map.lattice().levels() - 1),
        };
        let share = |count: usize| count as f64 / points.len() as f64;
        let blocked = points.iter().filter(|point| space.is_blocked(origin, **point)).count();
        let unexplained = space.alone(&points);
        // How far the earlier scans saw is not known: farther than this one, where this one looks at a wall.
        let range_m = 2.0 * points.iter().map(|point| distance(origin, *point)).fold(0.0, f64::max);
        let is_seen_through = |point: &&Point| {
            !stop.is_stopped()
                && viewpoints.iter().any(|viewpoint| space.sees_through(*viewpoint, **point, range_m))
        };
        let seen_through = unexplained.iter().filter(is_seen_through).count();
        Self { blocked: share(blocked), seen_through: share(seen_through), ..Self::default() }
    }

    /// With what the overlaps with the levels (finest first) say.
    pub(super) fn with_overlaps(self, level_overlaps: &[f64]) -> Self {
        let near = level_overlaps.get(NEAR_LEVEL).or(level_overlaps.last()).copied().unwrap_or(0.0);
        let on = level_overlaps.first().copied().unwrap_or(0.0);
        Self { unexplained: if near > 0.0 { 1.0 - on / near } else { 0.0 }, ..self }
    }

    /// Why the pose is not believed; none where it may be.
    pub(super) fn reason(&self, settings: &FreeSpaceSettings) -> Option<String> {
        let FreeSpaceSettings { explained_min, blocked_max, seen_through_max, .. } = *settings;
        let Self { blocked, seen_through, unexplained } = self;
        let explained = 1.0 - unexplained;
        if explained < explained_min {
            let words = "of the points near what the map holds are on it";
            return Some(format!(
                "{explained:.3} {words}, so far from the guess at least {explained_min} have to be"
            ));
        }
        if *blocked > blocked_max {
            let words = "of the rays pass through what the map holds";
            return Some(format!("{blocked:.3} {words}, at most {blocked_max} may"));
        }
        (*seen_through > seen_through_max).then(|| {
            let words = "of the points lie where earlier scans saw through";
            format!("{seen_through:.3} {words}, at most {seen_through_max} may")
        })
    }
}

/// The poses of the trajectory nearest to `origin`, map frame, that see different things.
fn viewpoints_near(map: &MultiResolutionMap, origin: Point, wish: usize) -> Vec<Point> {
    let apart_m = APART * map.lattice().resolution_m(0);
    let trajectory = map.trajectory();
    let stride = trajectory.len().div_ceil(VIEWPOINTS_MAX).max(1);
    let place = |pose: &Pose| Point::from(nalgebra::Point3::from(pose.translation.vector));
    let mut all: Vec<(f64, Point)> = trajectory
        .poses()
        .rev()
        .step_by(stride)
        .map(|scan| place(&scan.map_from_sensor))
        .map(|place| (distance(origin, place), place))
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<Point> = Vec::with_capacity(wish);
    for (_, place) in all {
        if chosen.len() >= wish {
            break;
        }
        if chosen.iter().all(|other| distance(*other, place) > apart_m) {
            chosen.push(place);
        }
    }
    chosen
}

/// A point and its neighbors along the axes.
const AROUND_POINT: [[f32; 3]; 7] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];

/// The finest voxels of a map, along rays.
struct Space<'a> {
    view: &'a MapView<'a>,
    lattice: LatticeFromPoints,
    resolution_m: f64,
    /// The level on which it is seen whether something is near.
    coarse: u32,
}

impl Space<'_> {
    /// Whether each of `points` (map frame) lies in an occupied voxel.
    fn occupied(&self, points: &[Point]) -> Vec<bool> {
        let mut words = vec![0u64; points.len().div_ceil(64)];
        self.view.query(points, &self.lattice, 0, Lookup::Exact, &mut words);
        (0..points.len()).map(|i| words[i / 64] >> (i % 64) & 1 == 1).collect()
    }

    /// Of each step from `from` to `to` (map frame), whether it is occupied; and the length of a step in voxels.
    fn along(&self, from: Point, to: Point) -> (Vec<bool>, f64) {
        let voxels = distance(from, to) / self.resolution_m;
        if !voxels.is_finite() {
            return (Vec::new(), STEP);
        }
        let steps = (voxels / STEP).ceil().clamp(1.0, STEPS_MAX);
        let [from, to] = [from, to].map(Point::to_f64);
        let at = |k: usize| Point::from(from + (to - from) * (k as f64 / steps));
        let points: Vec<Point> = (0..=steps as usize).map(at).collect();
        (self.occupied(&points), voxels / steps)
    }

    /// True where the ray from `origin` to `point` passes through occupied voxels and comes out behind them.
    ///
    /// Along a floor a ray is within occupied voxels for meters before it ends there: that blocks nothing.
    fn is_blocked(&self, origin: Point, point: Point) -> bool {
        let (occupied, step) = self.along(origin, point);
        let (steps, way) = (occupied.len().max(2) - 1, point.to_f64() - origin.to_f64());
        let (mut run, mut gap, mut is_inside) = (0.0, 0.0, false);
        for (k, occupied) in occupied.into_iter().enumerate() {
            (run, gap) = if occupied { (run + step, 0.0) } else { (0.0, gap + step) };
            is_inside |= run >= THROUGH;
            if is_inside && gap >= OPEN {
                let at = Point::from(origin.to_f64() + way * (k as f64 / steps as f64));
                if self.is_open(at) {
                    return true;
                }
            }
        }
        false
    }

    /// True where nothing is within a few voxels of `point`: a ray along rough ground goes in and out of it, and is not
    /// through.
    fn is_open(&self, point: Point) -> bool {
        let r = (2.0 * self.resolution_m) as f32;
        let [x, y, z] = point.xyz();
        let around: Vec<Point> =
            AROUND_POINT.iter().map(|[dx, dy, dz]| Point::new(x + dx * r, y + dy * r, z + dz * r)).collect();
        let mut words = [0u64; 1];
        self.view.query(&around, &self.lattice, self.coarse, Lookup::Exact, &mut words);
        words[0] == 0
    }

    /// Those of `points` that have no occupied voxel in or beside their own.
    fn alone(&self, points: &[Point]) -> Vec<Point> {
        let r = self.resolution_m as f32;
        let mut is_alone = vec![true; points.len()];
        for [dx, dy, dz] in AROUND_POINT {
            let beside = |point: &Point| {
                let [x, y, z] = point.xyz();
                Point::new(x + dx * r, y + dy * r, z + dz * r)
            };
            let occupied = self.occupied(&points.iter().map(beside).collect::<Vec<_>>());
            is_alone.iter_mut().zip(occupied).for_each(|(alone, occupied)| *alone &= !occupied);
        }
        points.iter().zip(is_alone).filter_map(|(point, alone)| alone.then_some(*point)).collect()
    }

    /// True where nothing is between `viewpoint` and `point`, and something behind it within `range_m` of the viewpoint.
    fn sees_through(&self, viewpoint: Point, point: Point, range_m: f64) -> bool {
        let way_m = distance(viewpoint, point);
        if !(way_m > 0.0 && way_m < range_m) {
            return false;
        }
        let [from, to] = [viewpoint, point].map(Point::to_f64);
        let end = Point::from(from + (to - from) * (range_m / way_m));
        let (occupied, step) = self.along(viewpoint, end);
        let at = way_m / self.resolution_m;
        let first = occupied.iter().position(|occupied| *occupied);
        first.is_some_and(|first| first as f64 * step > at + AROUND)
    }
}

fn distance(a: Point, b: Point) -> f64 {
    (a.to_f64() - b.to_f64()).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::{MapSettings, MappedScan, RobotName, ScanRecord};

    /// A square wall across the x axis, so far to each side of it.
    fn plane(x: f32, half: i32) -> Vec<Point> {
        let steps = || (-half * 20..half * 20).map(|i| i as f32 * 0.05 + 0.02);
        steps().flat_map(|y| steps().map(move |z| Point::new(x, y, z))).collect()
    }

    /// A map of walls across the x axis, seen from the origin.
    fn map_of(walls: &[f32]) -> MultiResolutionMap {
        let map = MultiResolutionMap::new(MapSettings::new(0.05, 4)).unwrap();
        let pose = MappedScan::new(RobotName::new("r").unwrap(), Pose::identity());
        let points: Vec<Point> = walls.iter().flat_map(|x| plane(*x, 3)).collect();
        map.committer().insert_scan(ScanRecord::of_points(pose, &points, map.lattice()));
        map
    }

    fn against(map: &MultiResolutionMap, x: f32, map_from_sensor: &Pose) -> Contradiction {
        let settings = FreeSpaceSettings::default();
        Contradiction::of(map, &plane(x, 1), map_from_sensor, &settings, StopSignal::NEVER)
    }

    #[test]
    fn what_is_where_it_was_is_not_contradicted() {
        assert_eq!(against(&map_of(&[4.02]), 4.02, &Pose::identity()), Contradiction::default());
        let nearer = against(&map_of(&[4.02]), 3.02, &Pose::translation(1.0, 0.0, 0.0));
        assert_eq!(nearer, Contradiction::default());
    }

    #[test]
    fn a_wall_that_earlier_scans_looked_through_is_contradicted() {
        let against = against(&map_of(&[4.02]), 2.02, &Pose::identity());
        assert!(against.seen_through > 0.9 && against.blocked == 0.0, "{against:?}");
        let reason = against.reason(&FreeSpaceSettings::default()).unwrap();
        assert!(reason.contains("where earlier scans saw through, at most 0.1 may"), "{reason}");
    }

    #[test]
    fn a_wall_in_new_space_is_not_contradicted() {
        // Behind what the map holds nobody has looked.
        let behind = against(&map_of(&[4.02]), 2.02, &Pose::translation(5.0, 0.0, 0.0));
        assert_eq!(behind, Contradiction::default());
        // Nothing is behind it: who knows whether anybody looked there.
        assert_eq!(against(&map_of(&[1.02]), 3.02, &Pose::translation(2.0, 0.0, 0.0)).seen_through, 0.0);
    }

    #[test]
    fn rays_through_what_the_map_holds_are_contradicted() {
        let against = against(&map_of(&[2.02, 2.07, 4.02]), 4.02, &Pose::identity());
        assert!(against.blocked > 0.9 && against.seen_through == 0.0, "{against:?}");
        let reason = against.reason(&FreeSpaceSettings::default()).unwrap();
        assert!(reason.contains("pass through what the map holds, at most 0.5 may"), "{reason}");
    }

    #[test]
    fn points_beside_what_the_map_holds_are_not_explained() {
        let against = |overlaps: &[f64]| Contradiction::default().with_overlaps(overlaps);
        assert!((against(&[0.6, 0.7, 0.8, 0.9, 1.0]).unexplained - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(against(&[0.3, 0.3, 0.3, 0.3, 1.0]).unexplained, 0.0, "new ground is no evidence");
        assert_eq!(against(&[0.5]).unexplained, 0.0);
        assert_eq!(against(&[0.0, 0.0]).unexplained, 0.0);
        let reason = against(&[0.6, 0.7, 0.8, 0.9, 1.0]).reason(&FreeSpaceSettings::default()).unwrap();
        assert!(reason.contains("0.667 of the points near what the map holds are on it"), "{reason}");
    }

    #[test]
    fn far_points_and_no_points_are_no_trouble() {
        let map = map_of(&[4.02]);
        let settings = FreeSpaceSettings::default();
        let of = |points: &[Point]| {
            Contradiction::of(&map, points, &Pose::identity(), &settings, StopSignal::NEVER)
        };
        assert_eq!(of(&[]), Contradiction::default());
        assert_eq!(of(&[Point::new(f32::MAX, f32::MAX, 0.0)]).seen_through, 0.0);
        assert_eq!(of(&[Point::new(1e9, 0.0, 0.0)]).seen_through, 0.0);
    }
}
