//! The points of a link: the field clears most of them, the rest are looked up voxel by voxel.

use super::field_lookup::FieldLookup;
use crate::planning::body::{CellsFromLink, LinkInCells, LinkPose, POINTS_PER_CLUMP};
use crate::planning::clearance::{LANES, lanes_below_zero};
use crate::util::bits::for_each_bit;
use crate::voxel::{LatticeFromPoints, VoxelKey};

/// What the look-up's f32 arithmetic may move a point, as a share of the coordinates that enter it and in voxels.
const ROUNDING: (f64, f64) = (2e-6, 2e-3);
/// Eights of points in a clump.
const EIGHTS: usize = POINTS_PER_CLUMP / LANES;

/// What a link's points meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PointHit {
    /// The point's number among the link's.
    pub(super) point: usize,
    pub(super) voxel: VoxelKey,
}

/// The first point of the link that falls in a voxel that counts, where one does.
pub(super) fn first_hit(
    lookup: &mut FieldLookup<'_>,
    link: &LinkInCells,
    pose: &LinkPose,
    cells_from_link: &CellsFromLink,
) -> Option<PointHit> {
    let mut first: Option<PointHit> = None;
    find(lookup, link, pose, cells_from_link, |hit| {
        if first.is_none_or(|first| hit.point < first.point) {
            first = Some(hit);
        }
        false
    });
    first
}

/// True where a point of the link falls in a voxel that counts.
pub(super) fn meet(
    lookup: &mut FieldLookup<'_>,
    link: &LinkInCells,
    pose: &LinkPose,
    cells_from_link: &CellsFromLink,
) -> bool {
    !link.points.is_empty() && find(lookup, link, pose, cells_from_link, |_| true)
}

/// Gives `is_enough` the points that fall in voxels that count until that is true; true where it was.
#[inline(always)]
fn find(
    lookup: &mut FieldLookup<'_>,
    link: &LinkInCells,
    pose: &LinkPose,
    cells_from_link: &CellsFromLink,
    mut is_enough: impl FnMut(PointHit) -> bool,
) -> bool {
    let slack = rounding_cells(link, pose, lookup.level, lookup.view.map().lattice().resolution_m(0));
    // Most links have no point near a voxel.
    let mut lattice_from_points = None;
    for (number, balls) in link.clumps.iter().enumerate() {
        let near =
            lanes_within(&lookup.classify_spheres(balls, &balls.centers(cells_from_link)).lower, slack);
        for lane in (0..LANES).filter(|lane| near >> lane & 1 == 1) {
            let first = (number * LANES + lane) * EIGHTS;
            let eights = first..link.point_groups.len().min(first + EIGHTS);
            for eight in eights {
                let points = &link.point_groups[eight];
                let near = lanes_within(
                    &lookup.classify_spheres(points, &points.centers(cells_from_link)).lower,
                    slack,
                );
                let mut is_done = false;
                for_each_bit(near.into(), |lane| {
                    let lattice_from_points = *lattice_from_points
                        .get_or_insert_with(|| pose.lattice_from_points(lookup.view.map().lattice()));
                    let hit = hit(lookup, link, eight * LANES + lane as usize, &lattice_from_points);
                    is_done = is_done || hit.is_some_and(&mut is_enough);
                });
                if is_done {
                    return true;
                }
            }
        }
    }
    false
}

/// The lanes in which something may be less than `distance` cells away.
#[inline(always)]
fn lanes_within(lower: &[f32; LANES], distance: f32) -> u8 {
    let mut left = [0f32; LANES];
    for lane in 0..LANES {
        left[lane] = lower[lane] - distance;
    }
    lanes_below_zero(&left)
}

/// What a point meets, by its place among the clumps' points.
fn hit(
    lookup: &FieldLookup<'_>,
    link: &LinkInCells,
    place: usize,
    lattice_from_points: &LatticeFromPoints,
) -> Option<PointHit> {
    let voxel = lattice_from_points.key(link.points[place])?.ancestor(lookup.level);
    lookup.counts(voxel).then(|| PointHit { point: link.numbers[place], voxel })
}

/// How far from where it is a point may be looked up, in voxels of `level`, rounded up.
fn rounding_cells(link: &LinkInCells, pose: &LinkPose, level: u32, resolution_m: f64) -> f32 {
    let coordinates_m = pose.translation_m.iter().map(|c| c.abs()).sum::<f64>() + 2.0 * link.center_extent_m;
    let finest = coordinates_m / resolution_m * ROUNDING.0 + ROUNDING.1;
    (finest / f64::from(1u32 << level)) as f32
}
