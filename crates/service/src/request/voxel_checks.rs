//! The errors of points that fall in no voxel, and of keys out of their level's range.

use crate::error::{Reason, ServiceError};
use mrol_map::geometry::Point;
use mrol_map::voxel::{INDEX_MAX, INDEX_MIN, Lattice, LatticeFromPoints, VoxelKey};

/// Names the first point that falls in no voxel.
pub(crate) fn point_without_voxel(
    points: &[Point],
    quantize: &LatticeFromPoints,
    lattice: &Lattice,
) -> ServiceError {
    let place = points.iter().position(|&point| quantize.index(point).is_none()).unwrap_or_default();
    without_voxel(&format!("points[{place}]"), points[place], lattice)
}

/// Says why the point of a field falls in no voxel.
pub(crate) fn without_voxel(field: &str, point: Point, lattice: &Lattice) -> ServiceError {
    let (min_m, end_m) = lattice.range_m();
    let (reason, what) = match point.is_finite() {
        true => (Reason::PointOutOfRange, format!("outside the map's range of {min_m} to {end_m} m")),
        false => (Reason::PointNotFinite, "not finite".to_owned()),
    };
    ServiceError::new(reason, format!("{field} is {what}: {point:?}"))
}

/// The key, which is one of a voxel of `level`.
pub(crate) fn key_in_range(field: &str, key: VoxelKey, level: u32) -> Result<VoxelKey, ServiceError> {
    let range = INDEX_MIN >> level..=INDEX_MAX >> level;
    if key.index().iter().all(|i| range.contains(i)) {
        return Ok(key);
    }
    let message = format!(
        "{field} has {key:?}, whose indices must lie in {}..={} at level {level}",
        range.start(),
        range.end()
    );
    Err(ServiceError::new(Reason::KeyOutOfRange, message))
}
