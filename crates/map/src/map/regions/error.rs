//! Errors of regions, and how far they may reach.

/// How far from the origin a sphere or an oriented box may lie and reach, meters: ten thousand times as far as the
/// largest map goes.
pub const REGION_M_MAX: f64 = 1e12;

/// Why numbers are not a region.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RegionError {
    /// A corner with NaN, or corners in the wrong order.
    #[error("box.min_m must not exceed box.max_m in any axis, got {0:?} and {1:?}")]
    Box([f64; 3], [f64; 3]),
    /// A center or radius that is not finite, or a negative radius.
    #[error("sphere.center_m must be finite and sphere.radius_m not negative, got {0:?} and {1}")]
    Sphere([f64; 3], f64),
    /// A center or radius beyond [`REGION_M_MAX`].
    #[error(
        "sphere.center_m and sphere.radius_m must lie within {REGION_M_MAX:e} m, got {0:?} and {1}: no map goes as far"
    )]
    SphereTooFar([f64; 3], f64),
    /// A side that is negative or NaN.
    #[error("oriented_box.size_m must not be negative in any axis, got {0:?}")]
    OrientedBox([f64; 3]),
    /// A center or side beyond [`REGION_M_MAX`].
    #[error(
        "oriented_box.map_from_box and oriented_box.size_m must lie within {REGION_M_MAX:e} m, got the center {0:?} and the \
         sides {1:?}: no map goes as far"
    )]
    OrientedBoxTooFar([f64; 3], [f64; 3]),
}
