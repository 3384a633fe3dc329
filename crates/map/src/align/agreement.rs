//! Agreement of rays: whether a scan at a pose and the scans before it saw the same surfaces.
//!
//! A point of the scan is looked for in the images of earlier viewpoints, and what these met in the image of the scan.
//! It *agrees* where something was met there, it is *contradicted* where all that was met lies behind it, and what
//! nobody saw says nothing. So neither the density of a map nor the spacing of rays against its voxels plays a part,
//! and new ground is no argument.

use std::sync::Arc;

use super::sampled_scan::SampledScan;
use crate::geometry::{Point, Pose};
use crate::map::MultiResolutionMap;
use crate::visibility::{ScanImage, Sight, Viewpoint, ViewpointSet};

/// Points of the scan that are looked for in the images of viewpoints.
const POINTS: usize = 800;
/// Depths that differ by so many r_0 are the same.
const TOLERANCE: f64 = 2.0;
/// What rays of one side say of a pose: a number of points that were asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RayCounts {
    /// Points that were looked for.
    pub asked: usize,
    /// Those where the other side met something, too.
    pub agree: usize,
    /// Those through which the other side saw.
    pub contradicted: usize,
}

/// How the rays of a scan at a pose and those of earlier viewpoints agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RayAgreement {
    /// The scan's points, in the images of the viewpoints.
    pub of_scan: RayCounts,
    /// What the viewpoints met and the scan looks at, in the image of the scan.
    pub of_map: RayCounts,
}

/// A pose that a scan may have been taken at as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rival {
    /// Where: map_from_sensor.
    pub map_from_sensor: Pose,
    /// How rays agree there.
    pub agreement: RayAgreement,
}

/// What is asked of the rays of a scan, made once for all poses.
#[derive(Debug)]
pub(super) struct Rays {
    pub(super) image: ScanImage,
    pub(super) points: Vec<Point>,
    pub(super) viewpoints: Arc<ViewpointSet>,
    pub(super) tolerance_m: f32,
}

impl RayCounts {
    pub(super) fn of(sights: impl IntoIterator<Item = Sight>) -> Self {
        sights.into_iter().fold(Self::default(), |counts, sight| Self {
            asked: counts.asked + 1,
            agree: counts.agree + usize::from(sight == Sight::Agrees),
            contradicted: counts.contradicted + usize::from(sight == Sight::Contradicts),
        })
    }

    /// The share of points that agree, of those of which anything is known; 0 where nothing is.
    pub fn share(&self) -> f64 {
        self.agree as f64 / (self.agree + self.contradicted).max(1) as f64
    }

    /// The share of points that are contradicted, of those of which anything is known; 0 where nothing is.
    pub fn contradicted_share(&self) -> f64 {
        self.contradicted as f64 / (self.agree + self.contradicted).max(1) as f64
    }

    /// The share of all points that agree.
    pub fn evidence(&self) -> f64 {
        self.agree as f64 / self.asked.max(1) as f64
    }
}

impl RayAgreement {
    /// True where rays were asked at all: not once the work was stopped.
    pub(super) fn is_asked(&self) -> bool {
        self.of_scan.asked > 0
    }

    /// The smaller share of both sides.
    pub fn worse(&self) -> f64 {
        self.of_scan.share().min(self.of_map.share())
    }

    /// The larger share of both sides: people and what was moved contradict one side only.
    pub fn better(&self) -> f64 {
        self.of_scan.share().max(self.of_map.share())
    }

    /// The smaller evidence of both sides.
    pub fn evidence(&self) -> f64 {
        self.of_scan.evidence().min(self.of_map.evidence())
    }
}

impl Rays {
    /// The rays of a scan.
    pub(super) fn of(map: &MultiResolutionMap, scan: &SampledScan<'_>) -> Self {
        let points = spread(&scan.surface_sample, POINTS);
        let tolerance_m = (TOLERANCE * map.lattice().resolution_m(0)) as f32;
        Self { image: ScanImage::of(scan.points), points, viewpoints: map.viewpoints(), tolerance_m }
    }

    /// What a viewpoint says of a point of the scan at a pose.
    pub(super) fn sight_of(&self, viewpoint: &Viewpoint, pose: &Pose, point: Point) -> Sight {
        let place = pose * point.to_f64();
        viewpoint.image().sight(viewpoint.offset(place.into()), self.tolerance_m)
    }
}

/// Some of a sample's points, or of other things, from all over it.
pub(super) fn spread<T: Copy>(all: &[T], wish: usize) -> Vec<T> {
    all.iter().step_by(all.len().div_ceil(wish).max(1)).copied().collect()
}
