//! Casting rays: through occupied voxels or through all that is not free, up to the first keep-out.

use super::hits::RayHits;
use super::interleaved::InterleavedRays;
use super::rays_in_cells::Request;
use super::request::{RayError, Rays};
use super::space::Space;
use super::{in_sight, keep_outs};
use crate::map::{MapView, TierView};
use crate::planning::keep_outs::Shapes;
use crate::planning::unknown::FreeSpace;
use crate::util::StopSignal;
use crate::voxel::Cluster;

/// What each ray meets first of the occupied voxels of `level`.
///
/// Voxel i of an axis is the cube from i r_n to (i + 1) r_n, in exact meters. A ray meets the voxels in which it runs
/// for some way, and not those that it only touches: through an edge or a corner it goes from one voxel to the one
/// across. A border that it crosses belongs to the voxel that it moves into, and a border along which it runs to the
/// upper voxel, as points on it do. A voxel that it would enter just where it ends is not met.
///
/// Where the view has keep-outs ([`MapView::with_keep_outs`]), a ray meets the first one that it is inside, its border
/// included, before it meets a voxel; not one that it would enter just where it ends.
///
/// The view must cover the whole map. The walk leaps over empty space by the blocks and clusters of blocks that are not
/// there, and comes out where single steps would (both computed in f64, and compared bit for bit in tests). Takes 12
/// bytes a ray. Once stopped, rays are left that met nothing yet.
///
/// # Errors
/// When a ray is none; the error names which, and why.
pub fn cast_rays(
    view: &MapView<'_>,
    rays: &Rays<'_>,
    level: u32,
    stop: StopSignal<'_>,
) -> Result<RayHits, RayError> {
    let nothing = Cluster::default();
    cast(view, rays, level, stop, |tier, request, hits| match view.cell_bounds(level) {
        Some(bounds) => InterleavedRays::new(Space::new(tier, bounds, &nothing), request).walk(hits, stop),
        None => (0..rays.len()).try_for_each(|number| request.ray(number).map(|_| ())),
    })
}

/// What each ray meets first of the voxels of `level` that are not free: those that are occupied, and those that no
/// scan saw through, as far as the view has viewpoints ([`MapView::with_viewpoints`]).
///
/// As [`cast_rays`] otherwise. Rays go voxel by voxel, and end with the map's lattice.
///
/// # Errors
/// As for [`cast_rays`].
pub fn cast_rays_in_sight(
    view: &MapView<'_>,
    rays: &Rays<'_>,
    level: u32,
    stop: StopSignal<'_>,
) -> Result<RayHits, RayError> {
    let nothing = Cluster::default();
    cast(view, rays, level, stop, |tier, request, hits| {
        let space = Space::new(tier, view.lattice_bounds(level), &nothing);
        in_sight::walk(space, &request, (level, FreeSpace::of(view)), hits, stop)
    })
}

/// What rays meet first that `walk` through the voxels of `level`, and end where they enter a keep-out of the view.
fn cast<'a>(
    view: &'a MapView<'_>,
    rays: &'a Rays<'_>,
    level: u32,
    stop: StopSignal<'_>,
    walk: impl FnOnce(TierView<'a>, Request<'a>, &mut RayHits) -> Result<(), RayError>,
) -> Result<RayHits, RayError> {
    rays.checked()?;
    let mut hits = RayHits::none_of(rays.len());
    let tier = view.tier_view(level);
    let request = Request { rays, range_m: view.lattice().range_m(), cell_m: tier.cell_m() };
    walk(tier, request, &mut hits)?;
    if let Some(shapes) = Shapes::of(view) {
        keep_outs::end_at(&shapes, rays, &mut hits, stop)?;
    }
    Ok(hits)
}
