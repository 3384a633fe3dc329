//! The rays of a scan, by what they tell where they end.

use crate::geometry::Point;

/// Where the rays of a scan ended (sensor frame, finite).
#[derive(Debug, Clone, Copy, Default)]
pub struct ScanRays<'a> {
    /// Something was met there, the robot itself too.
    pub met: &'a [Point],
    /// The ray met something farther away: up to there nothing was in its way.
    pub beyond: &'a [Point],
    /// Nothing returned: where the rays beside it agree, nothing was in its way up to there. Things that swallow the
    /// light of a ray are not there because of it.
    pub no_returns: &'a [Point],
}

impl<'a> ScanRays<'a> {
    /// Rays of which each met something.
    pub fn met(points: &'a [Point]) -> Self {
        Self { met: points, ..Self::default() }
    }

    /// All ends.
    pub(in crate::visibility) fn all(self) -> impl Iterator<Item = &'a Point> {
        self.met.iter().chain(self.beyond).chain(self.no_returns)
    }
}
