//! The ways to attack.

use std::time::Duration;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// A way to ask for much.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Attack {
    /// Checks of 4,000 motions of 3 m
    Motions,
    /// Checks of 56,000 poses
    Poses,
    /// 200,000 rays of 100 m
    Rays,
    /// Classifications of 500,000 points
    Classifications,
    /// Alignments of scans whose guesses are 0.8 m off
    Alignments,
    /// Searches without a guess
    Localizations,
    /// Scans of 40 robots into a map of their own
    Scans,
    /// Listings of voxels as JSON
    Listings,
    /// Counts of voxels in turned boxes of a large map
    Counts,
    /// Grids of a large map
    Grids,
    /// Tiny scans under 4,095 names
    TinyScans,
    /// Scans of random points
    Garbage,
    /// Connections on which nothing is asked, or half of something
    Connections,
    /// Watches of the honest callers' map
    Watches,
    /// Two scans a second, each, of robots that are elsewhere and want to be looked for
    LostRobots,
}

impl Attack {
    /// Scope of the key: true for `insert`, false for `read`.
    pub(super) fn inserts(self) -> bool {
        matches!(self, Self::Scans | Self::TinyScans | Self::Garbage | Self::LostRobots)
    }

    /// What it is called on the command line.
    pub(crate) fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// How many attack in this way at once.
    pub(super) fn at_once(self) -> usize {
        match self {
            Self::Motions | Self::Poses | Self::Rays | Self::Classifications | Self::Grids => 16,
            Self::Alignments | Self::Counts => 16,
            Self::Localizations | Self::Garbage | Self::TinyScans => 8,
            Self::Scans => 40,
            Self::Listings => 150,
            Self::Connections => 120,
            Self::Watches => 256,
            Self::LostRobots => 4,
        }
    }

    /// How long one that was answered waits before it asks again.
    pub(super) fn pause(self) -> Duration {
        match self {
            Self::LostRobots => Duration::from_millis(500),
            _ => Duration::ZERO,
        }
    }
}
