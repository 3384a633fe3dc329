//! Step 1 of an alignment (paper III-B): the samples of a scan.

use std::cell::RefCell;

use super::extent::within_extent;
use super::refine::VoxelGaussians;
use super::settings::AlignmentSettings;
use crate::geometry::Point;
use crate::util::StopSignal;
use crate::voxel::{Lattice, volumetric_sample_until};

/// A scan and the samples that its alignment reads.
#[derive(Debug)]
pub(super) struct SampledScan<'a> {
    /// All points of the scan: sensor frame, meters, finite.
    pub(super) points: &'a [Point],
    /// Volumetric sample of about 1000 points, for the ascent (paper III-A).
    pub(super) sample: Vec<Point>,
    /// Volumetric sample of about 5000 points, for the refinement and the verdict.
    pub(super) surface_sample: Vec<Point>,
    /// The surfaces of the map near the scan, as far as they were asked for: all ends of the alignment lie on the same
    /// ones.
    pub(super) surfaces: RefCell<VoxelGaussians>,
    /// Ends the alignment early; every climb checks it.
    pub(super) stop: StopSignal<'a>,
}

impl<'a> SampledScan<'a> {
    /// 1) Take a volumetric sample of points: of those that can be on the map.
    pub(super) fn new(
        points: &'a [Point],
        lattice: &Lattice,
        settings: &AlignmentSettings,
        stop: StopSignal<'a>,
    ) -> Self {
        let near = within_extent(points, lattice.extent_m(), stop);
        let wish = settings.refinement.sample_points.max(settings.sample_points);
        let fine = volumetric_sample_until(&near, wish, settings.seed, stop);
        let sample =
            volumetric_sample_until(&fine.points, settings.sample_points, settings.seed, stop).points;
        let surfaces = RefCell::new(VoxelGaussians::new(lattice.resolution_m(0)));
        Self { points, sample, surface_sample: fine.points, surfaces, stop }
    }

    /// The same scan, of which `surface_sample` alone is refined with.
    pub(super) fn with_surface_sample(&self, surface_sample: Vec<Point>, lattice: &Lattice) -> Self {
        let surfaces = RefCell::new(VoxelGaussians::new(lattice.resolution_m(0)));
        Self { sample: self.sample.clone(), surface_sample, surfaces, ..*self }
    }
}
