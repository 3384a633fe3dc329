//! What a copy of a region knows of a map, and whether that is enough for an answer.

use crate::error::{Reason, ServiceError};
use mrol_map::map::Region;
use mrol_map::voxel::Lattice;

/// The part of a map that is known at a level.
///
/// A voxel of the level is known where the centers of all finest voxels in it lie in the region, and the region is
/// convex. So a ball is known whose distance from the region's border is a voxel's diagonal: it meets no voxel that is
/// not.
#[derive(Debug, Clone, Copy)]
pub struct KnownPart {
    region: Region,
    margin_m: f64,
    /// No voxel is further from the origin along an axis.
    far_m: f64,
}

impl KnownPart {
    /// What is known of a map with this lattice by its voxels whose centers lie in `region`.
    pub fn of(region: Region, lattice: &Lattice, level: u32) -> Self {
        let (low_m, high_m) = lattice.range_m();
        Self { region, margin_m: lattice.resolution_m(level) * 3f64.sqrt(), far_m: high_m.max(-low_m) * 2.0 }
    }

    /// Side of a voxel of the level, meters.
    pub(super) fn voxel_m(&self) -> f64 {
        self.margin_m / 3f64.sqrt()
    }

    /// Refuses a ball of which a part is not known.
    ///
    /// # Errors
    /// `InvalidArgument`, naming `what` the ball is of, its place and radius, and how far the region reaches around it.
    pub(super) fn check_ball(
        &self,
        what: impl FnOnce() -> String,
        center_m: [f64; 3],
        radius_m: f64,
    ) -> Result<(), ServiceError> {
        let (known_m, needed_m) = (self.region.depth_m(center_m), radius_m + self.margin_m);
        if known_m >= needed_m {
            return Ok(());
        }
        let message = format!(
            "{} needs what is within {needed_m:.3} m of {center_m:?}, the region that the replica copies reaches {:.3} m \
             around it: copy a larger region, or ask the server",
            what(),
            known_m.max(0.0)
        );
        Err(ServiceError::new(Reason::PointOutOfRange, message))
    }

    /// A coordinate, or how far voxels reach where it is further.
    pub(super) fn within(&self, coordinate_m: f64) -> f64 {
        coordinate_m.clamp(-self.far_m, self.far_m)
    }
}
