//! The ways in which a lost robot is found again.

use crate::util::Keyword;

/// How a robot was found again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recovered {
    /// From its last good pose.
    LastPose,
    /// From where constant velocity leads.
    ConstantVelocity,
    /// From where its refused scans lead, aligned one to the other.
    ChainedScans,
    /// By a search with no guess, which two scans confirm.
    Localization,
}

impl Keyword for Recovered {
    const ALL: &'static [Self] =
        &[Self::LastPose, Self::ConstantVelocity, Self::ChainedScans, Self::Localization];

    fn as_str(self) -> &'static str {
        match self {
            Self::LastPose => "last_pose",
            Self::ConstantVelocity => "constant_velocity",
            Self::ChainedScans => "chained_scans",
            Self::Localization => "localization",
        }
    }
}
