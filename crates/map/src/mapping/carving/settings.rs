//! Which voxels a scan carves.

use crate::visibility::Thresholds;

/// Widest margin, voxels.
pub const CARVING_MARGIN_MAX: u32 = 8;

/// Largest range, meters.
pub const CARVING_RANGE_MAX_M: f64 = 200.0;

/// Smallest grazing angle, degrees.
pub const CARVING_GRAZING_MIN_DEG: f64 = 1.0;

/// Largest grazing angle, degrees.
pub const CARVING_GRAZING_MAX_DEG: f64 = 80.0;

/// Which voxels a scan carves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarvingSettings {
    /// Voxels around those of the scan's surface that are never carved: what the pose, and noise, may be off by. 1.
    pub margin_voxels: u32,
    /// A surface that is seen at a smaller angle than this is not told from a rim, degrees. 8.
    pub grazing_deg: f64,
    /// Voxels farther from the sensor than this are not carved, meters: a pose that is a tenth of a degree off moves
    /// what is 20 m away by 3.5 cm. 20.
    pub range_max_m: f64,
    /// What was found by trial: no setting of a robot.
    pub thresholds: Thresholds,
}

impl Default for CarvingSettings {
    fn default() -> Self {
        Self { margin_voxels: 1, grazing_deg: 8.0, range_max_m: 20.0, thresholds: Thresholds::DEFAULT }
    }
}

/// Why settings of carving are not valid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CarvingSettingsError {
    /// The margin is out of range: without one, noise and the poses' errors take walls away.
    #[error("carve_margin_voxels must be 1 to {CARVING_MARGIN_MAX}, got {0}")]
    Margin(u32),
    /// The grazing angle is out of range.
    #[error(
        "carve_grazing_deg must lie in {CARVING_GRAZING_MIN_DEG} to {CARVING_GRAZING_MAX_DEG} degrees, got {0}"
    )]
    Grazing(f64),
    /// The range is out of range.
    #[error("carve_range_max_m must be more than 0 and at most {CARVING_RANGE_MAX_M} m, got {0}")]
    Range(f64),
}

impl CarvingSettings {
    /// Checks the numbers, and returns the settings.
    ///
    /// # Errors
    /// Names what is out of range.
    pub fn checked(self) -> Result<Self, CarvingSettingsError> {
        let Self { margin_voxels, grazing_deg, range_max_m, .. } = self;
        if !(1..=CARVING_MARGIN_MAX).contains(&margin_voxels) {
            return Err(CarvingSettingsError::Margin(margin_voxels));
        }
        if !(CARVING_GRAZING_MIN_DEG..=CARVING_GRAZING_MAX_DEG).contains(&grazing_deg) {
            return Err(CarvingSettingsError::Grazing(grazing_deg));
        }
        if !(range_max_m > 0.0 && range_max_m <= CARVING_RANGE_MAX_M) {
            return Err(CarvingSettingsError::Range(range_max_m));
        }
        Ok(self)
    }
}
