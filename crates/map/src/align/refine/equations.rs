//! The normal equations of points against Gaussians: one step of Gauss and Newton.

use nalgebra::{Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

use super::gaussian::Gaussian;
use super::gaussians::VoxelGaussians;
use super::known_moments::KnownMoments;
use crate::geometry::{Point, Pose};
use crate::util::StopSignal;

/// Points that are matched between two checks of the stop signal: a millisecond, where none of their voxels was read
/// before.
pub(super) const POINTS_PER_STOP_CHECK: usize = 256;

/// Normal equations of a Gauss-Newton step: the sum of what all matched points say of how the pose should change.
///
/// A change is (translation, rotation): meters along the map's axes, radians about them through the sensor.
#[derive(Debug, Clone)]
pub(super) struct NormalEquations {
    /// Sum of J^T W J.
    hessian: Matrix6<f64>,
    /// Sum of J^T W e.
    gradient: Vector6<f64>,
    /// Number of points that have a Gaussian.
    matched: usize,
}

impl NormalEquations {
    /// The normal equations of `points` (sensor frame) at `pose`, each against its Gaussian. Weights are those of Geman
    /// and McClure at `robust_scale` (a Mahalanobis distance), so that points on what the map does not show have no
    /// influence. Once stopped, the result is meaningless.
    pub(super) fn of(
        points: &[Point],
        pose: &Pose,
        gaussians: &mut VoxelGaussians,
        moments: &KnownMoments<'_>,
        robust_scale: f64,
        stop: StopSignal<'_>,
    ) -> Self {
        let mut equations = Self { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), matched: 0 };
        for_each_match(points, pose, gaussians, moments, (robust_scale, stop), |_, gaussian, matched| {
            let weight = matched.fit * matched.fit;
            equations.matched += 1;
            equations.hessian += hessian(&matched.from_sensor, &(gaussian.information() * weight));
            let pull = gaussian.information() * matched.error * weight;
            equations.pull(&matched.from_sensor, &pull);
        });
        equations
    }

    fn pull(&mut self, from_sensor: &Vector3<f64>, pull: &Vector3<f64>) {
        let mut translation = self.gradient.fixed_rows_mut::<3>(0);
        translation += pull;
        let mut rotation = self.gradient.fixed_rows_mut::<3>(3);
        rotation += from_sensor.cross(pull);
    }

    /// The step that solves the equations; none where they are singular.
    pub(super) fn solve(&self) -> Option<Step> {
        // Damping far below what one point on a surface adds: it keeps an undetermined direction from moving.
        let damped = self.hessian + Matrix6::identity() * 1e-9;
        (self.matched > 0).then_some(())?;
        Some(Step(-damped.cholesky()?.solve(&self.gradient)))
    }
}

/// What points say of a pose by the surfaces that they lie on.
#[derive(Debug, Clone)]
pub(super) struct MatchedPoints {
    /// The information matrix (inverse covariance) of the pose.
    ///
    /// The points of one voxel average their noise, but share what is wrong with its Gaussian: together they are one
    /// measurement with the variance of the Gaussian's floor and an n-th of its thickness.
    pub(super) information: Matrix6<f64>,
    /// Number of points within the robust scale of their Gaussian.
    pub(super) inliers: usize,
    /// Sum of the points' weights: a point on its surface adds 1, one without a Gaussian 0.
    pub(super) weight: f64,
}

impl MatchedPoints {
    /// What `points` (sensor frame) say of `pose`. Once stopped, the result is meaningless.
    pub(super) fn of(
        points: &[Point],
        pose: &Pose,
        gaussians: &mut VoxelGaussians,
        moments: &KnownMoments<'_>,
        robust_scale: f64,
        stop: StopSignal<'_>,
    ) -> Self {
        let mut surfaces: Vec<(f64, Matrix6<f64>)> = Vec::new();
        let (mut inliers, mut weight) = (0, 0.0);
        for_each_match(
            points,
            pose,
            gaussians,
            moments,
            (robust_scale, stop),
            |number, gaussian, matched| {
                inliers += usize::from(matched.is_inlier);
                weight += matched.fit;
                surfaces.resize(surfaces.len().max(number + 1), (0.0, Matrix6::zeros()));
                let (count, sum) = &mut surfaces[number];
                *count += 1.0;
                *sum +=
                    hessian(&matched.from_sensor, &(gaussian.information() * (matched.fit * matched.fit)));
            },
        );
        let held = surfaces.iter().enumerate().filter(|(_, (count, _))| *count > 0.0);
        let averaging = |number: usize, count: f64| gaussians.get(number as u32).averaging(count) / count;
        let information = held.map(|(number, (count, sum))| sum * averaging(number, *count)).sum();
        Self { information, inliers, weight }
    }
}

/// A point and the Gaussian that it belongs to.
struct Match {
    /// From the sensor to the point, along the map's axes, meters.
    from_sensor: Vector3<f64>,
    /// From the Gaussian's mean to the point, meters.
    error: Vector3<f64>,
    /// Weight of the match: 1 on the surface, 1/2 at the robust scale.
    fit: f64,
    /// True when the point is within the robust scale.
    is_inlier: bool,
}

fn for_each_match(
    points: &[Point],
    pose: &Pose,
    gaussians: &mut VoxelGaussians,
    moments: &KnownMoments<'_>,
    (robust_scale, stop): (f64, StopSignal<'_>),
    mut f: impl FnMut(usize, &Gaussian, Match),
) {
    let rotation = pose.rotation.to_rotation_matrix();
    let scale = robust_scale * robust_scale;
    for (place, point) in points.iter().enumerate() {
        if place.is_multiple_of(POINTS_PER_STOP_CHECK) && stop.is_stopped() {
            return;
        }
        let from_sensor = rotation * point.to_f64().coords;
        let in_map = from_sensor + pose.translation.vector;
        if let Some(number) = gaussians.nearest(moments, &in_map) {
            let gaussian = gaussians.get(number);
            let distance = gaussian.distance_squared(&in_map);
            let (error, fit) = (gaussian.to(&in_map), scale / (scale + distance));
            f(number as usize, gaussian, Match { from_sensor, error, fit, is_inlier: distance < scale });
        }
    }
}

/// J^T W J of a point whose error has the Jacobian J = (I, -\[p\]x), p from the sensor along the map's axes.
fn hessian(from_sensor: &Vector3<f64>, weight: &Matrix3<f64>) -> Matrix6<f64> {
    let cross = from_sensor.cross_matrix();
    let weight_cross = weight * -cross;
    let mut hessian = Matrix6::zeros();
    hessian.fixed_view_mut::<3, 3>(0, 0).copy_from(weight);
    hessian.fixed_view_mut::<3, 3>(0, 3).copy_from(&weight_cross);
    hessian.fixed_view_mut::<3, 3>(3, 0).copy_from(&weight_cross.transpose());
    hessian.fixed_view_mut::<3, 3>(3, 3).copy_from(&(cross * weight_cross));
    hessian
}

/// A change of pose: meters along the map's axes, radians about them through the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step(Vector6<f64>);

impl Step {
    pub(super) fn applied_to(&self, pose: &Pose) -> Pose {
        let [x, y, z, rx, ry, rz] = self.0.into();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz));
        Pose::from_parts(
            Translation3::new(x, y, z) * pose.translation,
            UnitQuaternion::new_normalize((turn * pose.rotation).into_inner()),
        )
    }

    /// True when it moves by less than this, meters and radians.
    pub(super) fn is_below(&self, translation_m: f64, rotation_rad: f64) -> bool {
        self.0.fixed_rows::<3>(0).norm() < translation_m && self.0.fixed_rows::<3>(3).norm() < rotation_rad
    }
}
