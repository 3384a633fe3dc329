//! A body of points, against the look-up of the same points in the filter.

use std::sync::Arc;

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::arms::meets;
use crate::measure::stopwatch::Runs;
use crate::workload::bodies::place::{Surface, append, in_ball};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{Lookup, MultiResolutionMap};
use mrol_map::planning::{Body, Link, Planner, PlanningError};

/// What a body of points costs.
#[derive(Debug, Clone, PartialEq)]
pub struct PointBody {
    /// Poses that were asked about, at none of which the body meets a voxel.
    pub poses: usize,
    /// Points of the body.
    pub points: usize,
    /// Nanoseconds a pose.
    pub body: Runs,
    /// The look-up of the same points by the filter alone, pose by pose; nanoseconds a pose.
    pub bloom: Runs,
}

const POINTS: usize = 500;
/// The body is a ball's surface of this radius, meters.
const RADIUS_M: f64 = 0.3;

/// Asks about a body of 500 points at `poses` poses within a meter of the map's surfaces at which it meets nothing;
/// `passes` times.
///
/// # Errors
/// When the map's voxels are too small for the body.
pub fn point_body(
    map: &Arc<MultiResolutionMap>,
    poses: usize,
    passes: usize,
    seed: u64,
) -> Result<PointBody, PlanningError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let points = points(&mut random);
    let body = Body::new(vec![Link { points: points.clone(), ..Link::default() }])?;
    let planner = Planner::new(Arc::clone(map));
    let free = free_poses(&planner, &body, poses, &mut random)?;
    let mut numbers = Vec::new();
    free.iter().for_each(|pose| append(&mut numbers, pose));
    let mut measured =
        PointBody { poses: free.len(), points: POINTS, body: Runs::default(), bloom: Runs::default() };
    for _ in 0..passes {
        measured.body.time(free.len(), || meets(&planner, &body, &numbers))?;
        measured.bloom.time(free.len(), || look_up(map, &points, &free));
    }
    Ok(measured)
}

/// Points on the surface of a ball.
fn points(random: &mut ChaCha8Rng) -> Vec<Point> {
    let point = |_| {
        let direction = Vector3::from(in_ball(1.0, random)).normalize() * RADIUS_M;
        Point::new(direction.x as f32, direction.y as f32, direction.z as f32)
    };
    (0..POINTS).map(point).collect()
}

/// Poses at which the body meets nothing.
fn free_poses(
    planner: &Planner,
    body: &Body,
    count: usize,
    random: &mut ChaCha8Rng,
) -> Result<Vec<Pose>, PlanningError> {
    let surface = Surface::of(planner.map(), random);
    let mut free = Vec::with_capacity(count);
    // Most places are free; where few are, there are fewer poses.
    for _ in 0..20 {
        let tried: Vec<Pose> = (0..count).map(|_| pose(surface.near(random), random)).collect();
        let mut numbers = Vec::new();
        tried.iter().for_each(|pose| append(&mut numbers, pose));
        let bits = meets(planner, body, &numbers)?;
        free.extend((0..tried.len()).filter(|n| bits[n / 64] >> (n % 64) & 1 == 0).map(|n| tried[n]));
        if free.len() >= count {
            break;
        }
    }
    free.truncate(count);
    Ok(free)
}

fn pose(place: [f64; 3], random: &mut ChaCha8Rng) -> Pose {
    let angles = [0; 3].map(|_| random.random_range(-3.0..3.0));
    let rotation = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
    Pose::from_parts(Translation3::from(Vector3::from(place)), rotation)
}

/// Looks the points up by the filter at each pose; the number of points that it lets through.
fn look_up(map: &MultiResolutionMap, points: &[Point], poses: &[Pose]) -> usize {
    let (view, mut occupied) = (map.view(), vec![0; points.len().div_ceil(64)]);
    let mut let_through = 0;
    for pose in poses {
        view.query(points, &map.lattice().from_points(pose), 0, Lookup::Bloom, &mut occupied);
        let_through += occupied.iter().map(|word| word.count_ones() as usize).sum::<usize>();
    }
    let_through
}
