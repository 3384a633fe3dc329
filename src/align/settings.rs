//! The constants of the method, by name.

use crate::map::Lookup;

/// Settings of the alignment; the defaults are the original implementation's where it had them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlignmentSettings {
    /// Points of the volumetric sample, about. 1000 (paper III-A).
    pub sample_points: usize,
    /// Of the choice of sample points. 0.
    pub seed: u64,
    /// Translation step of a level, as a fraction of its resolution. 1.
    pub translation_step: f64,
    /// Rotation step of level 0, degrees; twice as much at each coarser level. 0.5.
    pub rotation_step_deg: f64,
    /// Steps at each level, at most. 20.
    pub iterations_per_level_max: u32,
    /// First translation step of the sub-voxel stage, as a fraction of r_0. 0.5. The original takes 0.25; from
    /// there, scans that the finest level left half a degree off stay there (README, "Alignment").
    pub sub_voxel_translation_step: f64,
    /// First rotation step of the sub-voxel stage, degrees. 0.25; the original takes 0.125.
    pub sub_voxel_rotation_step_deg: f64,
    /// Steps at each step size of the sub-voxel stage, at most. 100.
    pub sub_voxel_iterations_max: u32,
    /// How often the sub-voxel stage is repeated at half its step. 4, down to r_0 / 32; the original stops at the
    /// first and is left with half its step as the error.
    pub sub_voxel_halvings: u32,
    /// Fraction of a scan's points that must fall in occupied voxels for it to be accepted. 0.2: even a step
    /// that shows mostly new ground shares more than that with the map, a scan from elsewhere less.
    pub overlap_min: f64,
    /// What answers the ascent's look-ups. The filter (paper II-A: "for some operations like scan matching this
    /// subsequent value retrieval is unnecessary and can be skipped for speed").
    pub lookup: Lookup,
}

impl Default for AlignmentSettings {
    fn default() -> Self {
        Self {
            sample_points: 1000,
            seed: 0,
            translation_step: 1.0,
            rotation_step_deg: 0.5,
            iterations_per_level_max: 20,
            sub_voxel_translation_step: 0.5,
            sub_voxel_rotation_step_deg: 0.25,
            sub_voxel_iterations_max: 100,
            sub_voxel_halvings: 4,
            overlap_min: 0.2,
            lookup: Lookup::Bloom,
        }
    }
}

/// Why numbers cannot steer an alignment.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AlignmentSettingsError {
    /// The sample would be empty.
    #[error("sample_points must be at least 1, got 0")]
    SamplePoints,
    /// A step that does not step.
    #[error("{0} must be positive and finite, got {1}")]
    Step(&'static str, f64),
    /// Not a fraction.
    #[error("overlap_min must lie in 0..=1, got {0}")]
    OverlapMin(f64),
}

impl AlignmentSettings {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the setting out of range and the range.
    pub fn checked(self) -> Result<Self, AlignmentSettingsError> {
        if self.sample_points == 0 {
            return Err(AlignmentSettingsError::SamplePoints);
        }
        let steps = [
            ("translation_step", self.translation_step),
            ("rotation_step_deg", self.rotation_step_deg),
            ("sub_voxel_translation_step", self.sub_voxel_translation_step),
            ("sub_voxel_rotation_step_deg", self.sub_voxel_rotation_step_deg),
        ];
        if let Some(&(name, step)) = steps.iter().find(|(_, step)| !(step.is_finite() && *step > 0.0)) {
            return Err(AlignmentSettingsError::Step(name, step));
        }
        if !(0.0..=1.0).contains(&self.overlap_min) {
            return Err(AlignmentSettingsError::OverlapMin(self.overlap_min));
        }
        Ok(self)
    }
}
