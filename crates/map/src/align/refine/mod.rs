//! Refinement of a pose on the surfaces of the map, below the size of a voxel.
//!
//! Takes the place of step 5 of the paper's III-B. Overlap is flat within a voxel; the Gaussian of the points in it is
//! not. Points are matched with the Gaussian of their voxel and the pose moves to where they lie on its surface: the
//! normal distributions transform (Biber and Strasser 2003; Magnusson 2009) in the form of voxelised GICP (Koide et al.
//! 2021), on moments that the map keeps and with voxels as coarse as the points around demand.

mod equations;
mod gaussian;
mod gaussians;
mod known_moments;

use super::information::PoseInformation;
use super::settings::RefinementSettings;
use crate::geometry::{Point, Pose};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;
use equations::{NormalEquations, information};
use gaussian::Softness;
use gaussians::VoxelGaussians;
use known_moments::KnownMoments;

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
pub(super) struct Refinement {
    pub(super) map_from_sensor: Pose,
    pub(super) iterations: u32,
}

/// How well points lie on the surfaces of a map.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SurfaceFit {
    /// Information that the surfaces give about the pose.
    pub(super) information: PoseInformation,
    /// Fraction of the points that lie on a surface.
    pub(super) inliers: f64,
    /// Mean closeness of all points to their surfaces, 0 to 1.
    pub(super) fitness: f64,
}

/// Moves the sensor to where `points` (sensor frame, finite) lie on the surfaces of the map, from a guess a few r_0 off.
///
/// Surfaces are soft at first and harden from stage to stage, so that points find theirs from afar.
pub(super) fn refine(
    map: &MultiResolutionMap,
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
    let mut gaussians = VoxelGaussians::new(map, softness(settings.stages));
    for stage in (0..settings.stages).rev() {
        gaussians.soften(softness(stage));
        for _ in 0..settings.iterations_per_stage_max {
            if stop.is_stopped() {
                return refined;
            }
            let pose = &refined.map_from_sensor;
            let equations = NormalEquations::of(
                points,
                pose,
                &mut gaussians,
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
pub(super) fn surface_fit(
    map: &MultiResolutionMap,
    points: &[Point],
    map_from_sensor: &Pose,
    settings: &RefinementSettings,
    stop: StopSignal<'_>,
) -> SurfaceFit {
    let std_m = settings.std_m(map.lattice().resolution_m(0));
    let mut gaussians = VoxelGaussians::new(map, Softness { std_m, spread: SPREAD_TO_JUDGE });
    let scale = settings.robust_scale;
    let equations =
        NormalEquations::of(points, map_from_sensor, &mut gaussians, &KnownMoments::of(map), scale, stop);
    let information =
        information(points, map_from_sensor, &mut gaussians, &KnownMoments::of(map), scale, stop);
    SurfaceFit {
        information: PoseInformation::new(information, points),
        inliers: equations.inliers as f64 / points.len().max(1) as f64,
        fitness: equations.fitness(),
    }
}
