//! One link at one pose.

use super::field_lookup::FieldLookup;
use super::found_spheres::OpenSpheres;
use super::points;
use crate::planning::body::{CellsFromLink, LinkInCells, LinkPose};
use crate::planning::clearance::{LANES, lane_of};
use crate::voxel::VoxelKey;

/// Distance, in cells, beyond which the field of the level itself says nothing.
const FIELD_CELLS: f64 = 7.0;

/// The first sphere of a link that meets a voxel, and the nearest voxel to its center. While a part of the field is
/// waited for, which `unmade` then says, none.
pub(super) fn first_sphere(
    lookup: &mut FieldLookup<'_>,
    link: &LinkInCells,
    cells_from_link: &CellsFromLink,
    unmade: &mut u8,
) -> Option<(usize, VoxelKey)> {
    for (eight, group) in link.groups.iter().enumerate() {
        let centers = group.centers(cells_from_link);
        let bounds = lookup.classify_spheres(group, &centers);
        *unmade |= bounds.unmade;
        let near = bounds.meets | bounds.is_open;
        for lane in (0..LANES).filter(|lane| near >> lane & 1 == 1) {
            if lookup.waits_for(*unmade) {
                break;
            }
            if let Some(nearest) = lookup.nearest(lane_of(&centers, lane), group.radius[lane]) {
                return Some((eight * LANES + lane, nearest.voxel));
            }
        }
    }
    None
}

/// An upper bound of the distance from the link to the nearest voxel, cells.
pub(super) fn upper_bound(
    lookup: &mut FieldLookup<'_>,
    link: &LinkInCells,
    cells_from_link: &CellsFromLink,
    unmade: &mut u8,
) -> f64 {
    let mut upper = f64::INFINITY;
    for group in link.groups.iter().chain(&link.point_groups) {
        let bounds = lookup.classify_spheres(group, &group.centers(cells_from_link));
        *unmade |= bounds.unmade;
        upper = bounds.upper.iter().fold(upper, |upper, high| upper.min(f64::from(*high)));
    }
    upper
}

/// The distance from the link to the nearest voxel, cells, 0 where they meet; none where it is more than `most`.
pub(super) fn nearest(
    lookup: &mut FieldLookup<'_>,
    link: &LinkInCells,
    cells_from_link: &CellsFromLink,
    most: f64,
) -> Option<f64> {
    let (mut most, mut nearest) = (most, None);
    for group in link.groups.iter().chain(&link.point_groups) {
        let centers = group.centers(cells_from_link);
        let bounds = lookup.classify_spheres(group, &centers);
        for lane in 0..LANES {
            if f64::from(bounds.lower[lane]) > most {
                continue;
            }
            if let Some(distance) = distance(lookup, lane_of(&centers, lane), group.radius[lane], most) {
                (most, nearest) = (distance, Some(distance));
            }
        }
    }
    nearest
}

/// The distance from a sphere to the nearest voxel, cells, 0 where they meet; none where it is more than `most`.
fn distance(lookup: &mut FieldLookup<'_>, center: [f64; 3], radius: f64, most: f64) -> Option<f64> {
    if radius + most > FIELD_CELLS && lookup.far_lower_bound(center, radius + most) > radius + most {
        return None;
    }
    let nearest = lookup.nearest(center, radius + most)?;
    Some((nearest.squared.sqrt() - radius).max(0.0)).filter(|distance| *distance <= most)
}

/// A lower bound of the distance from the link to the nearest voxel, cells.
pub(super) fn lower_bound(
    lookup: &mut FieldLookup<'_>,
    link: &LinkInCells,
    cells_from_link: &CellsFromLink,
) -> f64 {
    let ball = lookup.classify_spheres(&link.ball_group, &link.ball_group.centers(cells_from_link));
    let mut lower = f32::INFINITY;
    for group in link.groups.iter().chain(&link.point_groups) {
        lower = lowest(lower, &lookup.classify_spheres(group, &group.centers(cells_from_link)).lower);
    }
    lower.max(ball.lower[0]).max(0.0).into()
}

/// What is known of a link at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LinkState {
    /// It meets a voxel.
    Meets,
    /// It meets none, and none is nearer than so many cells.
    IsClear(f64),
    /// A part of the field is waited for.
    Waits,
}

/// What is known of the link at a pose: by the ball around it, unless that is not to be asked (`is_near`), and by its
/// spheres where that is not clear. `open` is a place for spheres.
#[inline(always)]
pub(super) fn state(
    lookup: &mut FieldLookup<'_>,
    link: &LinkInCells,
    (pose, cells_from_link): (&LinkPose, &CellsFromLink),
    is_near: bool,
    open: &mut OpenSpheres,
) -> LinkState {
    if !is_near {
        let ball = lookup.classify_spheres(&link.ball_group, &link.ball_group.centers(cells_from_link));
        if ball.lower[0] > 0.0 {
            return LinkState::IsClear(ball.lower[0].into());
        }
    }
    let (mut unmade, mut lower) = (0, f32::INFINITY);
    open.clear();
    for group in &link.groups {
        let centers = group.centers(cells_from_link);
        let bounds = lookup.classify_spheres(group, &centers);
        if bounds.meets != 0 {
            return LinkState::Meets;
        }
        unmade |= bounds.unmade;
        open.note(&bounds, group, &centers);
        lower = lowest(lower, &bounds.lower);
    }
    for group in &link.point_groups {
        let bounds = lookup.classify_spheres(group, &group.centers(cells_from_link));
        unmade |= bounds.unmade;
        lower = lowest(lower, &bounds.lower);
    }
    if lookup.waits_for(unmade) {
        return LinkState::Waits;
    }
    if open.meet(lookup) || points::meet(lookup, link, pose, cells_from_link) {
        return LinkState::Meets;
    }
    LinkState::IsClear(lower.max(0.0).into())
}

#[inline(always)]
fn lowest(lower: f32, lanes: &[f32; LANES]) -> f32 {
    lanes.iter().fold(lower, |lowest, lane| lowest.min(*lane))
}
