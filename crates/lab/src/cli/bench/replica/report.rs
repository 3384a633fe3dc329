//! Results of `mrol-lab bench replica`.

use std::fmt::{self, Display};

use serde::Serialize;

use mrol::console::map_report::{bytes, count};
use mrol_map::map::Lookup;
use mrol_map::util::Keyword;

/// What a copy took.
#[derive(Serialize)]
pub(super) struct Copied {
    pub(super) voxels: usize,
    /// From the first call until the copy answers.
    pub(super) seconds: f64,
    /// That the server sent, HTTP/2 included.
    pub(super) bytes_sent: u64,
    /// Of the copy's sets and filters.
    pub(super) map_bytes: usize,
    /// By which the process grew, from memory that it had for making the map at the server.
    pub(super) resident_bytes: u64,
}

impl Display for Copied {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let a_voxel = |bytes: f64| bytes / self.voxels.max(1) as f64;
        write!(
            f,
            "a copy of {} voxels: complete after {:.3} s; sent {}, {:.2} bytes a voxel; in memory {}, {:.1} bytes a voxel; \
             the process grew by {}",
            count(self.voxels),
            self.seconds,
            bytes(self.bytes_sent as usize),
            a_voxel(self.bytes_sent as f64),
            bytes(self.map_bytes),
            a_voxel(self.map_bytes as f64),
            bytes(self.resident_bytes as usize),
        )
    }
}

/// Queries through one of those that answer.
#[derive(Serialize)]
pub(super) struct Line {
    through: &'static str,
    lookup: &'static str,
    points: usize,
    ns_per_point: f64,
    of_map: f64,
}

impl Line {
    pub(super) const HEAD: &str = "through   lookup  points a query  ns a point  of the map's";

    pub(super) fn of(
        through: &'static str,
        lookup: Lookup,
        points: usize,
        ns_per_point: f64,
        of_map: f64,
    ) -> Self {
        Self { through, lookup: lookup.as_str(), points, ns_per_point, of_map }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { through, lookup, points, ns_per_point, of_map } = self;
        write!(f, "{through:<9} {lookup:<6} {:>15} {ns_per_point:>11.2} {of_map:>13.3}", count(*points))
    }
}
