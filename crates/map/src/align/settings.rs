//! Settings of the alignment.

use crate::map::Lookup;
use crate::util::Keyword;

/// Standard deviations from the guess beyond which what is known beforehand is known to be wrong, as where wheels
/// slipped or the robot was carried: it then tells no pose from another. One pose in a thousand lies farther by chance:
/// the square root of the 99.9 % quantile of chi squared with six degrees of freedom.
pub(super) const DEVIATIONS_MAX: f64 = 4.7;

/// How a scan is aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// The paper's sequential ascent, then [refinement](RefinementSettings) in place of its sub-voxel stage.
    #[default]
    Refined,
    /// The paper's method, III-B steps 1 to 5.
    Overlap,
}

impl Keyword for Method {
    const ALL: &'static [Self] = &[Self::Refined, Self::Overlap];

    fn as_str(self) -> &'static str {
        match self {
            Self::Refined => "refined",
            Self::Overlap => "overlap",
        }
    }
}

/// Settings of the alignment; the defaults are the original implementation's where it had them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlignmentSettings {
    /// The method of alignment. [`Method::Refined`]. In a map that keeps no moments it is always [`Method::Overlap`].
    pub method: Method,
    /// Approximate number of points of the volumetric sample. 1000 (paper III-A).
    pub sample_points: usize,
    /// Seed of the choice of sample points. 0.
    pub seed: u64,
    /// Translation step of a level, as a fraction of its resolution. 1.
    pub translation_step: f64,
    /// Rotation step of level 0, degrees; twice as much at each coarser level. 0.5.
    pub rotation_step_deg: f64,
    /// Steps at each level, at most. 20.
    pub iterations_per_level_max: u32,
    /// First translation step of the sub-voxel stage, as a fraction of r_0. 0.5. The original takes 0.25; from
    /// there, scans that the finest level left half a degree off stay there (docs/lab-notes.md, "Alignment").
    pub sub_voxel_translation_step: f64,
    /// First rotation step of the sub-voxel stage, degrees. 0.25; the original takes 0.125.
    pub sub_voxel_rotation_step_deg: f64,
    /// Steps at each step size of the sub-voxel stage, at most. 100.
    pub sub_voxel_iterations_max: u32,
    /// How often the sub-voxel stage is repeated at half its step. 4, down to r_0 / 32; the original stops at the
    /// first and is left with half its step as the error.
    pub sub_voxel_halvings: u32,
    /// What follows the ascent with [`Method::Refined`].
    pub refinement: RefinementSettings,
    /// What to try where the ascent from the guess ends badly.
    pub multi_start: MultiStartSettings,
    /// Fraction of a scan's points that must fall in occupied voxels for it to be accepted, beyond what rays say. 0:
    /// how much that is depends on how densely the map is filled.
    pub overlap_min: f64,
    /// A pose is undetermined where its standard deviation in some direction exceeds this fraction of r_0. 0.2: ten
    /// times that of a furnished room, a seventh of that along a blank wall.
    pub undetermined_std: f64,
    /// Where a map keeps no moments, a scan is shifted by this many r_0 in all directions to see what holds it. 5: more
    /// than walls are thick.
    pub slide: f64,
    /// A pose is undetermined where more than this fraction of the overlap is left after such a shift. 0.85: along a
    /// blank wall or a corridor 0.92 and more are left, in a furnished room at most 0.7.
    pub slide_overlap_max: f64,
    /// Largest angle between the direction of gravity that a scan tells and down in the map, degrees. 5: what an
    /// accelerometer says of a robot that brakes at 1 m/s2 is 6 off, at half of that 3.
    pub gravity_error_max_deg: f64,
    /// How many standard deviations of its covariance a pose may be from the guess. 4.7: of guesses as good as they
    /// say, one in a thousand is farther off (chi-squared with six degrees of freedom).
    pub covariance_deviations_max: f64,
    /// What answers the ascent's look-ups. The filter (paper II-A: "for some operations like scan matching this
    /// subsequent value retrieval is unnecessary and can be skipped for speed").
    pub lookup: Lookup,
}

/// Settings of the refinement on the Gaussians of voxels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefinementSettings {
    /// Approximate number of points of the volumetric sample. 5000: more points gain nothing.
    pub sample_points: usize,
    /// Standard deviation of a point beyond the spread of its surface, as a fraction of r_0, in the last stage. 0.1.
    pub std: f64,
    /// Number of stages, each with half the uncertainty of the one before. 4: the first begins at 0.8 r_0.
    pub stages: u32,
    /// Gauss-Newton steps of a stage, at most. 10.
    pub iterations_per_stage_max: u32,
    /// The Mahalanobis distance at which a point counts a quarter (Geman and McClure). 4.5.
    pub robust_scale: f64,
}

impl RefinementSettings {
    /// Standard deviation of a point in the last stage, meters; see [`RefinementSettings::std`].
    pub(super) fn std_m(&self, resolution_m: f64) -> f64 {
        self.std * resolution_m
    }
}

/// Settings of the multiple starts: more guesses around the first one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MultiStartSettings {
    /// Starts again from more guesses where the fitness of the first result is below this. 0.85; 0 never does. A scan
    /// of what the map shows has 0.9 or more; one that shows much new ground has less, and takes a few times as long.
    pub fitness_below: f64,
    /// Starts again from more guesses where the refinement moved the end of an ascent by more than this many r_0: where
    /// anything holds it, it ends within a few. 8.
    pub correction_above: f64,
    /// Starts again from more guesses where a pose is held to no better than this fraction of r_0 in some direction.
    /// 0.1.
    pub std_above: f64,
    /// Starts again from more guesses where a pose is farther from its guess than this many r_0. 12.
    pub motion_above: f64,
    /// Starts again from more guesses where a pose is turned by more than this against its guess, degrees. 30.
    pub motion_above_deg: f64,
    /// Ascents of the guesses that look best, at most. 8; 0 believes every end.
    pub ascents: usize,
}

impl Default for AlignmentSettings {
    fn default() -> Self {
        Self {
            method: Method::Refined,
            sample_points: 1000,
            seed: 0,
            translation_step: 1.0,
            rotation_step_deg: 0.5,
            iterations_per_level_max: 20,
            sub_voxel_translation_step: 0.5,
            sub_voxel_rotation_step_deg: 0.25,
            sub_voxel_iterations_max: 100,
            sub_voxel_halvings: 4,
            refinement: RefinementSettings::default(),
            multi_start: MultiStartSettings::default(),
            overlap_min: 0.0,
            undetermined_std: 0.2,
            slide: 5.0,
            slide_overlap_max: 0.85,
            gravity_error_max_deg: 5.0,
            covariance_deviations_max: DEVIATIONS_MAX,
            lookup: Lookup::Bloom,
        }
    }
}

impl Default for RefinementSettings {
    fn default() -> Self {
        Self { sample_points: 5000, std: 0.1, stages: 4, iterations_per_stage_max: 10, robust_scale: 4.5 }
    }
}

impl Default for MultiStartSettings {
    fn default() -> Self {
        Self {
            fitness_below: 0.85,
            correction_above: 8.0,
            std_above: 0.1,
            motion_above: 12.0,
            motion_above_deg: 30.0,
            ascents: 8,
        }
    }
}

/// Why alignment settings are not valid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum AlignmentSettingsError {
    /// A number that must not be 0 is 0; the payload names the setting.
    #[error("{0} must be at least 1, got 0")]
    Zero(&'static str),
    /// A step that is not positive; the payload is the setting and its value.
    #[error("{0} must be positive and finite, got {1}")]
    NotPositive(&'static str, f64),
    /// A value outside 0 to 1; the payload is the setting and its value.
    #[error("{0} must lie in 0..=1, got {1}")]
    NotAFraction(&'static str, f64),
}

impl AlignmentSettings {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the setting out of range and the range.
    pub fn checked(self) -> Result<Self, AlignmentSettingsError> {
        let counts = [
            ("sample_points", self.sample_points),
            ("refinement.sample_points", self.refinement.sample_points),
            ("refinement.stages", self.refinement.stages as usize),
        ];
        if let Some(&(name, _)) = counts.iter().find(|(_, count)| *count == 0) {
            return Err(AlignmentSettingsError::Zero(name));
        }
        let positive = [
            ("translation_step", self.translation_step),
            ("rotation_step_deg", self.rotation_step_deg),
            ("sub_voxel_translation_step", self.sub_voxel_translation_step),
            ("sub_voxel_rotation_step_deg", self.sub_voxel_rotation_step_deg),
            ("refinement.std", self.refinement.std),
            ("refinement.robust_scale", self.refinement.robust_scale),
            ("undetermined_std", self.undetermined_std),
            ("slide", self.slide),
            ("slide_overlap_max", self.slide_overlap_max),
            ("gravity_error_max_deg", self.gravity_error_max_deg),
            ("covariance_deviations_max", self.covariance_deviations_max),
            ("multi_start.correction_above", self.multi_start.correction_above),
            ("multi_start.std_above", self.multi_start.std_above),
            ("multi_start.motion_above", self.multi_start.motion_above),
            ("multi_start.motion_above_deg", self.multi_start.motion_above_deg),
        ];
        if let Some(&(name, value)) = positive.iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
        {
            return Err(AlignmentSettingsError::NotPositive(name, value));
        }
        let fractions = [
            ("overlap_min", self.overlap_min),
            ("multi_start.fitness_below", self.multi_start.fitness_below),
        ];
        match fractions.iter().find(|(_, value)| !(0.0..=1.0).contains(value)) {
            Some(&(name, value)) => Err(AlignmentSettingsError::NotAFraction(name, value)),
            None => Ok(self),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_out_of_range_are_named() {
        let defaults = AlignmentSettings::default();
        assert!(defaults.checked().is_ok());
        let message = |settings: AlignmentSettings| settings.checked().unwrap_err().to_string();
        assert!(message(AlignmentSettings { sample_points: 0, ..defaults }).contains("sample_points"));
        assert!(message(AlignmentSettings { overlap_min: 1.5, ..defaults }).contains("overlap_min"));
        let refinement = RefinementSettings { std: f64::NAN, ..defaults.refinement };
        assert!(message(AlignmentSettings { refinement, ..defaults }).contains("refinement.std"));
    }
}
