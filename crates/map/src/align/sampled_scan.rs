//! Step 1 of an alignment (paper III-B): the samples of a scan.

use super::extent::within_extent;
use super::settings::AlignmentSettings;
use crate::geometry::Point;
use crate::util::StopSignal;
use crate::voxel::volumetric_sample_until;

/// A scan and the samples that its alignment reads.
#[derive(Debug)]
pub(super) struct SampledScan<'a> {
    /// All points of the scan: sensor frame, meters, finite.
    pub(super) points: &'a [Point],
    /// Volumetric sample of about 1000 points, for the ascent (paper III-A).
    pub(super) sample: Vec<Point>,
    /// Volumetric sample of about 5000 points, for the refinement and the verdict.
    pub(super) surface_sample: Vec<Point>,
    /// Ends the alignment early; every climb checks it.
    pub(super) stop: StopSignal<'a>,
}

impl<'a> SampledScan<'a> {
    /// 1) Take a volumetric sample of points: of those that can be on a map that reaches as far as `extent_m`.
    pub(super) fn new(
        points: &'a [Point],
        extent_m: f64,
        settings: &AlignmentSettings,
        stop: StopSignal<'a>,
    ) -> Self {
        let near = within_extent(points, extent_m, stop);
        let wish = settings.refinement.sample_points.max(settings.sample_points);
        let fine = volumetric_sample_until(&near, wish, settings.seed, stop);
        let sample =
            volumetric_sample_until(&fine.points, settings.sample_points, settings.seed, stop).points;
        Self { points, sample, surface_sample: fine.points, stop }
    }
}
