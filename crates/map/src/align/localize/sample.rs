//! The sample of a scan's points that a search reads.

use nalgebra::Point3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::geometry::Point;
use crate::util::StopSignal;
use crate::voxel::volumetric_sample_until;

/// A few hundred points, even over the surfaces that a scan shows, in random order.
#[derive(Debug, Clone)]
pub(super) struct SearchSample {
    /// The points: sensor frame, meters, in random order.
    pub(super) points: Vec<Point3<f64>>,
    /// Range that three quarters of the points are within, meters; the size of rotation cells depends on it.
    pub(super) range_m: f64,
}

/// Points of the volumetric sample that one search point stands for. Thinned straight to a few hundred, a scan
/// would be mostly its stray far points, each alone in a voxel of meters.
const THINNING: usize = 20;
/// Share of the points within [`SearchSample::range_m`].
const RANGE_QUANTILE: f64 = 0.75;

/// Factor that extends [`SearchSample::range_m`] by the size of the search's voxels, a quarter of the range at most.
const SIGHT: f64 = 1.25;

impl SearchSample {
    /// Thins `points` (finite, at least one) to `wish` of them.
    pub(super) fn of(points: &[Point], wish: usize, seed: u64, stop: StopSignal<'_>) -> Self {
        let mut sample = volumetric_sample_until(points, wish.saturating_mul(THINNING), seed, stop).points;
        // In random order the first points predict the rest, so that hopeless cells are given up early.
        sample.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        sample.truncate(wish);
        let points: Vec<Point3<f64>> = sample.into_iter().map(Point::to_f64).collect();
        let mut ranges: Vec<f64> = points.iter().map(|point| point.coords.norm()).collect();
        ranges.sort_unstable_by(f64::total_cmp);
        let range_m = ranges[((ranges.len() - 1) as f64 * RANGE_QUANTILE) as usize];
        Self { points, range_m }
    }

    /// Distance, meters, within which the map has a voxel around every place where at least `share` of the points fall
    /// on the map: there, one of the nearest points does. Stray far returns have no influence, unless `share` is so
    /// small that strays alone could make it.
    pub(super) fn sight_m(&self, share: f64) -> f64 {
        match share > 1.0 - RANGE_QUANTILE {
            true => self.range_m * SIGHT,
            false => self.range_max_m(),
        }
    }

    /// The largest distance of a point from the sensor, meters.
    pub(super) fn range_max_m(&self) -> f64 {
        self.points.iter().map(|point| point.coords.norm()).fold(0.0, f64::max)
    }
}
