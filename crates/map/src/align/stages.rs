//! Steps 2 to 5 of an alignment (paper III-B): ascents from level to level, and the sub-voxel stage.

use super::ascent::{Ascent, Steps};
use super::fit::Fit;
use super::information::root_mean_square_range_m;
use super::overlap::{OccupiedVoxels, Overlap};
use super::refine::refine;
use super::sampled_scan::SampledScan;
use super::settings::{AlignmentSettings, Method};
use crate::geometry::{Pose, pose_difference};
use crate::map::MultiResolutionMap;

/// 2) - 4) Align iteratively at each level, coarse to fine, each from where the coarser one ended.
pub(super) fn climb(
    voxels: &dyn OccupiedVoxels,
    scan: &SampledScan<'_>,
    guess: Pose,
    coarsest: u32,
    settings: &AlignmentSettings,
) -> Ascent {
    let mut ascent = Ascent::from(guess);
    for level in (0..=coarsest).rev() {
        let overlap = Overlap::new(voxels, &scan.sample, level, settings.lookup);
        let steps = Steps::of_level(level, voxels.lattice(), settings);
        ascent.climb(&overlap, steps, settings.iterations_per_level_max, scan.stop);
    }
    ascent
}

/// 5) Sub-voxel alignment: with all points and small steps.
pub(super) fn climb_sub_voxel(
    voxels: &dyn OccupiedVoxels,
    scan: &SampledScan<'_>,
    ascent: &mut Ascent,
    settings: &AlignmentSettings,
) {
    let overlap = Overlap::new(voxels, scan.points, 0, settings.lookup);
    for halvings in 0..=settings.sub_voxel_halvings {
        let steps = Steps::sub_voxel(voxels.lattice(), settings).halved(halvings);
        ascent.climb(&overlap, steps, settings.sub_voxel_iterations_max, scan.stop);
    }
}

/// 5) as in the paper, or by [`refine`] in its place where the map keeps moments; and how the scan fits there.
pub(super) fn finish(
    map: &MultiResolutionMap,
    scan: &SampledScan<'_>,
    mut ascent: Ascent,
    settings: &AlignmentSettings,
) -> Fit {
    let climbed = ascent.pose;
    match settings.method {
        Method::Refined if map.settings().moments => {
            let surfaces = &mut scan.surfaces.borrow_mut();
            let refined =
                refine(map, surfaces, &scan.surface_sample, &climbed, &settings.refinement, scan.stop);
            ascent.pose = refined.map_from_sensor;
            ascent.iterations += refined.iterations;
        }
        Method::Refined | Method::Overlap => climb_sub_voxel(map, scan, &mut ascent, settings),
    }
    let (meters, degrees) = pose_difference(&climbed, &ascent.pose);
    let refined_by_m = meters + degrees.to_radians() * root_mean_square_range_m(&scan.surface_sample);
    Fit::of(map, scan, ascent, refined_by_m, settings)
}
