//! Refinement of a pose, and how well points lie on the map's surfaces.

use super::equations::{MatchedPoints, NormalEquations};
use super::gaussian::Softness;
use super::gaussians::VoxelGaussians;
use super::known_moments::KnownMoments;
use crate::align::information::PoseInformation;
use crate::align::settings::RefinementSettings;
use crate::geometry::{Point, Pose};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;

/// Steps shorter than this fraction of r_0, and than [`SETTLED_RAD`], end a stage.
const SETTLED: f64 = 1e-4;
const SETTLED_RAD: f64 = 1e-6;

/// [`Softness::spread`] while the pose is refined. The rim of a partly seen surface still says roughly where it is, so
/// it may pull.
const SPREAD_TO_REFINE: f64 = 1.0 / 24.0;
/// [`Softness::spread`] for the verdict, which trusts bends and edges alone: a rim moves when more of the surface is
/// seen.
const SPREAD_TO_JUDGE: f64 = 1.0 / 150.0;

/// A refined pose, and how the points lie on the map's surfaces there.
#[derive(Debug, Clone)]
pub(in crate::align) struct Refinement {
    pub(in crate::align) map_from_sensor: Pose,
    pub(in crate::align) iterations: u32,
}

/// How well points lie on the surfaces of a map.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::align) struct SurfaceFit {
    /// Information that the surfaces give about the pose.
    pub(in crate::align) information: PoseInformation,
    /// Fraction of the points that lie on a surface.
    pub(in crate::align) inliers: f64,
    /// Mean closeness of all points to their surfaces, 0 to 1.
    pub(in crate::align) fitness: f64,
}

/// Moves the sensor to where `points` (sensor frame, finite) lie on the surfaces of the map, from a guess a few r_0
/// off.
///
/// Surfaces are soft at first and harden from stage to stage, so that points find theirs from afar.
pub(in crate::align) fn refine(
    map: &MultiResolutionMap,
    gaussians: &mut VoxelGaussians,
    points: &[Point],
    guess: &Pose,
    settings: &RefinementSettings,
    stop: StopSignal<'_>,
) -> Refinement {
    let resolution_m = map.lattice().resolution_m(0);
    let mut refined = Refinement { map_from_sensor: *guess, iterations: 0 };
    let softness = |stage: u32| {
        let std_m = settings.std_m(resolution_m) * 2f64.powi(stage as i32);
        Softness { std_m, spread: SPREAD_TO_REFINE }
    };
    for stage in (0..settings.stages).rev() {
        gaussians.soften(softness(stage));
        for _ in 0..settings.iterations_per_stage_max {
            stop.give_way();
            if stop.is_stopped() {
                return refined;
            }
            let pose = &refined.map_from_sensor;
            let equations = NormalEquations::of(
                points,
                pose,
                gaussians,
                &KnownMoments::of(map),
                settings.robust_scale,
                stop,
            );
            let Some(step) = equations.solve().filter(|_| !stop.is_stopped()) else {
                return refined;
            };
            refined.map_from_sensor = step.applied_to(pose);
            refined.iterations += 1;
            if step.is_below(SETTLED * resolution_m, SETTLED_RAD) {
                break;
            }
        }
    }
    refined
}

/// Measures how `points` (sensor frame) lie on the map's surfaces with the sensor at `map_from_sensor`. Once stopped,
/// the result is meaningless.
pub(in crate::align) fn surface_fit(
    map: &MultiResolutionMap,
    gaussians: &mut VoxelGaussians,
    points: &[Point],
    map_from_sensor: &Pose,
    settings: &RefinementSettings,
    stop: StopSignal<'_>,
) -> SurfaceFit {
    let std_m = settings.std_m(map.lattice().resolution_m(0));
    gaussians.soften(Softness { std_m, spread: SPREAD_TO_JUDGE });
    let (moments, scale) = (KnownMoments::of(map), settings.robust_scale);
    let matched = MatchedPoints::of(points, map_from_sensor, gaussians, &moments, scale, stop);
    let count = points.len().max(1) as f64;
    SurfaceFit {
        information: PoseInformation::new(matched.information, points),
        inliers: matched.inliers as f64 / count,
        fitness: matched.weight / count,
    }
}
