//! A scan of an E57 file.

use mrol_map::geometry::Pose;

/// A scan of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct E57Scan {
    /// Its name, or its number from 0 where it has none.
    pub name: String,
    /// Points that the file names, those without a return among them.
    pub points: u64,
    /// Where it was taken, in the coordinates of the survey; none where the file does not say.
    pub survey_from_scan: Option<Pose>,
}
