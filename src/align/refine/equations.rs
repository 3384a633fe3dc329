//! The normal equations of points against Gaussians: one step of Gauss and Newton.

use nalgebra::{Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

use super::gaussians::VoxelGaussians;
use crate::geometry::{Point, Pose};
use crate::map::MapView;

/// What all points say together of how the pose should change.
///
/// A change is (translation, rotation): metres along the map's axes, radians about them through the sensor.
#[derive(Debug, Clone)]
pub(super) struct NormalEquations {
    /// Sum of J^T W J.
    hessian: Matrix6<f64>,
    /// Sum of J^T W e.
    gradient: Vector6<f64>,
    points: usize,
    /// Points with a Gaussian.
    pub(super) matched: usize,
    /// Points nearer to theirs than the robust scale.
    pub(super) inliers: usize,
    /// Distinct Gaussians that have points.
    surfaces: usize,
    /// Sum of each matched point's weight, 1 for one that lies on its surface.
    fitness: f64,
}

impl NormalEquations {
    /// Of `points` (sensor frame) at `pose`, each against its Gaussian, with the weights of Geman and McClure at
    /// `robust_scale` (a Mahalanobis distance), so that points of what the map does not show have no say.
    pub(super) fn of(
        points: &[Point],
        pose: &Pose,
        gaussians: &mut VoxelGaussians,
        view: &MapView<'_>,
        robust_scale: f64,
    ) -> Self {
        let mut equations = Self {
            hessian: Matrix6::zeros(),
            gradient: Vector6::zeros(),
            points: points.len(),
            matched: 0,
            inliers: 0,
            surfaces: 0,
            fitness: 0.0,
        };
        let rotation = pose.rotation.to_rotation_matrix();
        let scale = robust_scale * robust_scale;
        let mut seen = vec![false; gaussians.len()];
        for point in points {
            let from_sensor = rotation * point.to_f64().coords;
            let in_map = from_sensor + pose.translation.vector;
            let Some(number) = gaussians.nearest(view, &in_map) else {
                continue;
            };
            seen.resize(seen.len().max(gaussians.len()), false);
            equations.surfaces += usize::from(!std::mem::replace(&mut seen[number as usize], true));
            let gaussian = gaussians.get(number);
            let error = gaussian.to(&in_map);
            let pull = gaussian.information() * error;
            let distance = error.dot(&pull);
            let fit = scale / (scale + distance);
            equations.matched += 1;
            equations.inliers += usize::from(distance < scale);
            equations.fitness += fit;
            equations.add(&from_sensor, gaussian.information() * (fit * fit), pull * (fit * fit));
        }
        equations
    }

    /// Adds a point whose error has the Jacobian (I, -\[p\]x), p from the sensor along the map's axes.
    fn add(&mut self, from_sensor: &Vector3<f64>, weight: Matrix3<f64>, pull: Vector3<f64>) {
        let cross = from_sensor.cross_matrix();
        let weight_cross = weight * -cross;
        let turning = cross * weight_cross;
        for row in 0..3 {
            for column in 0..3 {
                self.hessian[(row, column)] += weight[(row, column)];
                self.hessian[(row, column + 3)] += weight_cross[(row, column)];
                self.hessian[(row + 3, column)] += weight_cross[(column, row)];
                self.hessian[(row + 3, column + 3)] += turning[(row, column)];
            }
        }
        let torque = from_sensor.cross(&pull);
        let mut translation = self.gradient.fixed_rows_mut::<3>(0);
        translation += pull;
        let mut rotation = self.gradient.fixed_rows_mut::<3>(3);
        rotation += torque;
    }

    /// The change of pose that they ask for; none where they say nothing.
    pub(super) fn solve(&self) -> Option<Step> {
        // Far below what one point on a surface adds: keeps a direction that nothing determines from moving.
        let damped = self.hessian + Matrix6::identity() * 1e-9;
        (self.matched > 0).then_some(())?;
        Some(Step(-damped.cholesky()?.solve(&self.gradient)))
    }

    /// The inverse covariance of the pose: the points of one voxel share what is wrong with its Gaussian, and so count
    /// as one measurement together.
    pub(super) fn information(&self) -> Matrix6<f64> {
        self.hessian * (self.surfaces as f64 / self.matched.max(1) as f64)
    }

    /// How well all points lie on surfaces: 1 where each does, a point without one adds nothing.
    pub(super) fn fitness(&self) -> f64 {
        self.fitness / self.points.max(1) as f64
    }
}

/// A change of pose: metres along the map's axes, radians about them through the sensor.
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

    /// True when it moves by less than this, metres and radians.
    pub(super) fn is_below(&self, translation_m: f64, rotation_rad: f64) -> bool {
        self.0.fixed_rows::<3>(0).norm() < translation_m && self.0.fixed_rows::<3>(3).norm() < rotation_rad
    }
}
