//! The Gaussian of the points in a voxel.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::symmetric_eigen;
use crate::voxel::Moments;

/// Least number of points that make a Gaussian: fewer say nothing of a surface.
const POINTS_MIN: i64 = 6;
/// A Gaussian is used where the second largest variance is at least this fraction of the voxel's side squared. A single
/// scan line in a voxel is a line, not a surface: to align to it would be to align to the sensor's pattern (paper
/// III-B: the voxels "have to be large enough to cover gaps in the point cloud due to scan line spacing").
const SPREAD_MIN: f64 = 0.005;
/// Points are a plane if their smallest variance is at most this fraction of the middle one.
const FLATNESS_MAX: f64 = 0.1;

/// How soft a Gaussian is: how far a point may lie from its surface before that counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Softness {
    /// By how much points are uncertain beyond the spread of the surface, meters.
    pub(super) std_m: f64,
    /// Directions in which the points spread by this fraction of the voxel's side squared hold nothing: there the
    /// surface goes on, and only what was seen of it ends. A surface that fills its voxel spreads by 1/12.
    pub(super) spread: f64,
}

/// Mean and principal axes of the points in a voxel, map frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gaussian {
    mean_m: Vector3<f64>,
    /// Variances along `axes`, square meters.
    variances: Vector3<f64>,
    axes: Matrix3<f64>,
    side_m: f64,
    /// As it was softened last.
    softness: Softness,
    /// Variance that [`Gaussian::soften`] added, square meters.
    noise: f64,
    /// Inverse covariance within the determined directions, 1 / m^2.
    information: Matrix3<f64>,
}

impl Gaussian {
    /// The Gaussian of the points in a voxel around `center_m`, whose moments are in units of `unit_m`; none where they
    /// do not make a surface.
    pub(super) fn of(moments: &Moments, center_m: Vector3<f64>, side_m: f64, unit_m: f64) -> Option<Self> {
        if moments.count() < POINTS_MIN {
            return None;
        }
        let (mean, [xx, xy, xz, yy, yz, zz]) = moments.gaussian()?;
        let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * (unit_m * unit_m);
        let eigen = symmetric_eigen(covariance)?;
        let mut ascending: [f64; 3] = eigen.eigenvalues.into();
        ascending.sort_unstable_by(f64::total_cmp);
        (ascending[1] >= SPREAD_MIN * side_m * side_m).then(|| Self {
            mean_m: center_m + Vector3::from(mean) * unit_m,
            variances: eigen.eigenvalues.map(|variance| variance.max(0.0)),
            axes: eigen.eigenvectors,
            side_m,
            softness: Softness { std_m: f64::INFINITY, spread: f64::INFINITY },
            noise: f64::INFINITY,
            information: Matrix3::zeros(),
        })
    }

    /// Adds an uncertainty of `softness.std_m` in every direction to the surface's own spread, in place of what was
    /// added before.
    #[inline]
    pub(super) fn soften(&mut self, softness: Softness) {
        if self.softness != softness {
            self.soften_anew(softness);
        }
    }

    fn soften_anew(&mut self, softness: Softness) {
        let noise = softness.std_m * softness.std_m;
        (self.softness, self.noise) = (softness, noise);
        let without = 1.0 / (softness.spread * self.side_m * self.side_m + noise);
        let information = self.variances.map(|variance| (1.0 / (variance + noise) - without).max(0.0));
        self.information = self.axes * Matrix3::from_diagonal(&information) * self.axes.transpose();
    }

    /// The information matrix of a point as last softened, 1 / m^2.
    pub(super) fn information(&self) -> &Matrix3<f64> {
        &self.information
    }

    /// How many times the information of one point `count` points together have: they average the thickness of the
    /// surface, but not the uncertainty that [`Gaussian::soften`] added.
    pub(super) fn averaging(&self, count: f64) -> f64 {
        let (thickness, noise) = (self.variances.min(), self.noise);
        (thickness + noise) / (thickness / count + noise)
    }

    /// The vector from the mean to a point of the map frame, meters.
    pub(super) fn to(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        point_m - self.mean_m
    }

    /// The height of a place of the map frame above the surface, meters; none where the points are no plane. Which side
    /// is above is arbitrary, and the same for all places.
    pub(super) fn height_m(&self, place_m: &Vector3<f64>) -> Option<f64> {
        let [thin, middle, _] = {
            let mut axes = [0, 1, 2];
            axes.sort_by(|&a, &b| self.variances[a].total_cmp(&self.variances[b]));
            axes
        };
        let is_flat = self.variances[thin] <= FLATNESS_MAX * self.variances[middle];
        is_flat.then(|| self.axes.column(thin).dot(&self.to(place_m)))
    }

    /// The squared Mahalanobis distance of a point of the map frame.
    pub(super) fn distance_squared(&self, point_m: &Vector3<f64>) -> f64 {
        let error = self.to(point_m);
        error.dot(&(self.information * error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Gaussian of points `step` units apart on a grid of `n` x `m` in the plane z = 10 units.
    fn grid(n: i64, m: i64, step: i64) -> Option<Gaussian> {
        let mut moments = Moments::default();
        for (x, y) in (0..n).flat_map(|x| (0..m).map(move |y| (x, y))) {
            moments += Moments::of_offset([(x - n / 2) * step, (y - m / 2) * step, 10]);
        }
        let mut gaussian =
            Gaussian::of(&moments, Vector3::new(1.0, 2.0, 3.0), 1.0, 1.0 / Moments::UNITS as f64)?;
        gaussian.soften(Softness { std_m: 0.01, spread: 1.0 / 24.0 });
        Some(gaussian)
    }

    #[test]
    fn a_surface_determines_its_normal_and_nothing_else() {
        let surface = grid(20, 20, 200).unwrap();
        let on_surface = Vector3::new(1.0, 2.0, 3.0 + 10.0 / Moments::UNITS as f64);
        let far_along = surface.distance_squared(&(on_surface + Vector3::new(0.4, -0.3, 0.0)));
        let off = surface.distance_squared(&(on_surface + Vector3::new(0.4, -0.3, 0.02)));
        assert!(far_along < 1e-6, "{far_along}");
        assert!((3.0..4.1).contains(&off), "{off}");
    }

    #[test]
    fn a_scan_line_and_a_handful_of_points_are_no_surface() {
        assert!(grid(100, 1, 40).is_none());
        assert!(grid(2, 2, 1000).is_none());
    }
}
