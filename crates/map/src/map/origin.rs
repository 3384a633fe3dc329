//! Where a map's frame lies in the frame that its scans were surveyed in.

/// Where a map's frame lies in another, larger one: that of a survey, of which voxels and points of f32 cannot hold the
/// coordinates.
///
/// A place `p` of the map is at `p + position_m` there. The map itself never uses it: it is kept for those who read the
/// map, and for scans in the coordinates of the survey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapOrigin {
    /// The map's origin in the frame of the survey, meters.
    pub position_m: [f64; 3],
}

/// Why a position is no map's origin; the payload is the position.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("origin_m must be three finite numbers, got {0:?}")]
pub struct MapOriginError([f64; 3]);

impl MapOrigin {
    /// An origin at a position of the survey, meters.
    ///
    /// # Errors
    /// When a coordinate is not finite.
    pub fn new(position_m: [f64; 3]) -> Result<Self, MapOriginError> {
        match position_m.iter().all(|c| c.is_finite()) {
            true => Ok(Self { position_m }),
            false => Err(MapOriginError(position_m)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_origin_is_finite() {
        assert_eq!(MapOrigin::new([388_096.25, 3_948_996.0, -1.0]).unwrap().position_m[1], 3_948_996.0);
        assert!(MapOrigin::new([0.0, f64::NAN, 0.0]).unwrap_err().to_string().contains("origin_m"));
    }
}
