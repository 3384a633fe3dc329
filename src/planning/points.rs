//! The points of a link: the field clears most of them, the look-up says of the rest which voxels they fall in.

use super::eight::LANES;
use super::in_cells::{LinkInCells, POINTS_PER_CLUMP};
use super::look::Look;
use super::placement::{CellsFromLink, LinkPose};
use crate::voxel::VoxelKey;

/// What the look-up's f32 arithmetic may move a point, as a share of the coordinates that enter it and in voxels.
const ROUNDING: (f64, f64) = (2e-6, 2e-3);

/// What a link's points meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PointHit {
    /// The point's number among the link's.
    pub(super) point: usize,
    pub(super) voxel: VoxelKey,
}

/// The first point of the link that falls in a voxel that counts, where one does.
pub(super) fn first_hit(
    look: &mut Look<'_>,
    link: &LinkInCells,
    pose: &LinkPose,
    cells_from_link: &CellsFromLink,
) -> Option<PointHit> {
    let lattice = *look.view.map().lattice();
    let lattice_from_points = pose.lattice_from_points(&lattice);
    let slack = rounding_cells(link, pose, look.level, lattice.resolution_m(0));
    let mut first = None;
    for (eight, balls) in link.clumps.iter().enumerate() {
        let judged = look.judge(balls, &balls.centers(cells_from_link));
        for lane in (0..LANES).filter(|&lane| judged.lower[lane] <= slack) {
            let clump = (eight * LANES + lane) * POINTS_PER_CLUMP;
            let points = &link.points[clump..link.points.len().min(clump + POINTS_PER_CLUMP)];
            let mut occupied = [0];
            look.level_view().occupied_exactly(points, &lattice_from_points, &mut occupied);
            for place in (0..points.len()).filter(|place| occupied[0] >> place & 1 == 1) {
                let point = link.numbers[clump + place];
                let voxel = lattice_from_points.key(points[place]).map(|voxel| voxel.ancestor(look.level));
                let counts = |voxel: &VoxelKey| !look.surroundings.ignores(&lattice, *voxel, look.level);
                if let Some(voxel) = voxel.filter(counts)
                    && first.is_none_or(|first: PointHit| point < first.point)
                {
                    first = Some(PointHit { point, voxel });
                }
            }
        }
    }
    first
}

/// How far from where it is a point may be looked up, in voxels of `level`, rounded up.
fn rounding_cells(link: &LinkInCells, pose: &LinkPose, level: u32, resolution_m: f64) -> f32 {
    let coordinates_m = pose.translation_m.iter().map(|c| c.abs()).sum::<f64>() + 2.0 * link.center_extent_m;
    let finest = coordinates_m / resolution_m * ROUNDING.0 + ROUNDING.1;
    (finest / f64::from(1u32 << level)) as f32
}

/// True where a point of the link falls in a voxel that counts.
pub(super) fn meet(
    look: &mut Look<'_>,
    link: &LinkInCells,
    pose: &LinkPose,
    cells_from_link: &CellsFromLink,
) -> bool {
    !link.points.is_empty() && first_hit(look, link, pose, cells_from_link).is_some()
}
