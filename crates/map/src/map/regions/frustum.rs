//! What a camera sees.

use std::f64::consts::PI;

use nalgebra::Point3;

use super::error::REGION_M_MAX;
use crate::geometry::Pose;

/// A camera's view: a pyramid cut off near and far, in the map frame. Borders belong to it.
///
/// In the camera frame z points forward, x to the right and y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frustum {
    map_from_camera: Pose,
    angles_rad: [f64; 2],
    /// How far its sides lie from the axis, right and down, for each meter in front of the camera.
    slopes: [f64; 2],
    near_m: f64,
    far_m: f64,
}

/// Why numbers are not a view.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FrustumError {
    /// An angle that no camera sees.
    #[error("horizontal_rad and vertical_rad must lie between 0 and pi, got {0} and {1}")]
    Angles(f64, f64),
    /// Distances that are not in order.
    #[error(
        "near_m must not be negative, and far_m lie beyond it and within {REGION_M_MAX:e} m, got {0} and {1}"
    )]
    Distances(f64, f64),
    /// A camera beyond [`REGION_M_MAX`].
    #[error("map_from_camera must lie within {REGION_M_MAX:e} m, got {0:?}: no map goes as far")]
    TooFar([f64; 3]),
}

impl Frustum {
    /// The view of a camera at `map_from_camera` with a horizontal and a vertical field of view (from edge to edge,
    /// radians), of what lies from `near_m` to `far_m` in front of it (along its z axis, meters).
    ///
    /// # Errors
    /// When an angle does not lie between 0 and pi, `near_m` is negative, `far_m` is not beyond it, or a number is not
    /// finite or beyond [`REGION_M_MAX`].
    pub fn new(
        map_from_camera: Pose,
        angles_rad: [f64; 2],
        [near_m, far_m]: [f64; 2],
    ) -> Result<Self, FrustumError> {
        let is_angle = |rad: f64| rad > 0.0 && rad < PI;
        if !angles_rad.into_iter().all(is_angle) {
            let [horizontal_rad, vertical_rad] = angles_rad;
            return Err(FrustumError::Angles(horizontal_rad, vertical_rad));
        }
        if !(near_m >= 0.0 && near_m < far_m && far_m <= REGION_M_MAX) {
            return Err(FrustumError::Distances(near_m, far_m));
        }
        let camera_m = map_from_camera.translation.vector;
        if !camera_m.iter().all(|c| c.abs() <= REGION_M_MAX) {
            return Err(FrustumError::TooFar(camera_m.into()));
        }
        let slopes = angles_rad.map(|rad| (rad / 2.0).tan());
        Ok(Self { map_from_camera, angles_rad, slopes, near_m, far_m })
    }

    /// Where the camera is.
    pub fn map_from_camera(&self) -> &Pose {
        &self.map_from_camera
    }

    /// The horizontal and vertical field of view, radians.
    pub fn angles_rad(&self) -> [f64; 2] {
        self.angles_rad
    }

    /// Where the view begins and ends, meters in front of the camera.
    pub fn distances_m(&self) -> [f64; 2] {
        [self.near_m, self.far_m]
    }

    /// True when the point (map frame, meters) lies inside or on the border.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        let [x, y, z] = self.in_camera(point_m);
        let [right, down] = self.slopes;
        (self.near_m..=self.far_m).contains(&z) && x.abs() <= z * right && y.abs() <= z * down
    }

    /// False only when no point of the ball about `center_m` lies in the view.
    pub(super) fn may_meet(&self, center_m: [f64; 3], radius_m: f64) -> bool {
        let [x, y, z] = self.in_camera(center_m);
        let is_near_side =
            |across: f64, slope: f64| across.abs() - z * slope <= radius_m * (1.0 + slope * slope).sqrt();
        let [right, down] = self.slopes;
        z + radius_m >= self.near_m
            && z - radius_m <= self.far_m
            && is_near_side(x, right)
            && is_near_side(y, down)
    }

    /// The smallest box around it: (smallest, largest) coordinates, map frame, meters.
    pub(super) fn bounds_m(&self) -> ([f64; 3], [f64; 3]) {
        let [right, down] = self.slopes;
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let z = if i >> 2 == 0 { self.near_m } else { self.far_m };
            let in_map = self.map_from_camera * Point3::new(sign(0) * z * right, sign(1) * z * down, z);
            <[f64; 3]>::from(in_map.coords)
        };
        let corners: [[f64; 3]; 8] = std::array::from_fn(corner);
        let along = |axis: usize, pick: fn(f64, f64) -> f64| {
            corners.iter().map(|corner| corner[axis]).fold(corners[0][axis], pick)
        };
        (std::array::from_fn(|axis| along(axis, f64::min)), std::array::from_fn(|axis| along(axis, f64::max)))
    }

    fn in_camera(&self, point_m: [f64; 3]) -> [f64; 3] {
        self.map_from_camera.inverse_transform_point(&Point3::from(point_m)).coords.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    /// A camera at the origin that looks along the map's x axis, upright.
    fn along_x() -> Pose {
        crate::geometry::pose([0.0; 3], [-0.5, 0.5, -0.5, 0.5]).unwrap()
    }

    #[test]
    fn z_is_forward_x_right_and_y_down() {
        let view = Frustum::new(along_x(), [1.0, 0.5], [1.0, 10.0]).unwrap();
        let (right, down) = ((0.5f64).tan(), (0.25f64).tan());
        for (point, is_seen) in [
            ([5.0, 0.0, 0.0], true),
            ([-5.0, 0.0, 0.0], false),
            ([0.9, 0.0, 0.0], false),
            ([10.1, 0.0, 0.0], false),
            ([5.0, 4.99 * right, 0.0], true),
            ([5.0, -4.99 * right, 4.99 * down], true),
            ([5.0, 5.01 * right, 0.0], false),
            ([5.0, 0.0, 5.01 * down], false),
            ([5.0, 0.0, -5.01 * down], false),
        ] {
            assert_eq!(view.contains(point), is_seen, "{point:?}");
        }
        let below = along_x() * Point3::new(0.0, 1.0, 5.0);
        assert!((below.coords - Vector3::new(5.0, 0.0, -1.0)).norm() < 1e-12);
    }

    #[test]
    fn numbers_that_no_camera_has_are_refused() {
        let view = |angles, distances| Frustum::new(along_x(), angles, distances);
        assert!(view([1e-9, PI - 1e-9], [0.0, 1e12]).is_ok());
        for bad in [0.0, -1.0, PI, 4.0, f64::NAN, f64::INFINITY] {
            for angles in [[bad, 1.0], [1.0, bad]] {
                let error = view(angles, [0.0, 1.0]).unwrap_err().to_string();
                assert!(error.contains("between 0 and pi"), "{error}");
            }
        }
        for bad in [[-0.1, 1.0], [1.0, 1.0], [2.0, 1.0], [f64::NAN, 1.0], [0.0, f64::NAN], [0.0, 1.1e12]] {
            let error = view([1.0, 1.0], bad).unwrap_err().to_string();
            assert!(error.contains("far_m"), "{error}");
        }
        let far = Frustum::new(Pose::translation(0.0, 2e12, 0.0), [1.0, 1.0], [0.0, 1.0]).unwrap_err();
        assert!(far.to_string().contains("1e12 m"), "{far}");
    }

    proptest! {
        #[test]
        fn what_is_seen_lies_within_the_bounds_and_in_no_ball_that_is_left_out(
            at in prop::array::uniform3(-5.0f64..5.0),
            turn in prop::array::uniform3(-3.0f64..3.0),
            angles in prop::array::uniform2(0.05f64..3.0),
            distances in (0.0f64..3.0, 0.1f64..8.0),
            point in prop::array::uniform3(-12.0f64..12.0),
            center in prop::array::uniform3(-12.0f64..12.0),
        ) {
            let pose = Pose::new(Vector3::from(at), Vector3::from(turn));
            let view = Frustum::new(pose, angles, [distances.0, distances.0 + distances.1]).unwrap();
            let radius_m = (0..3).map(|axis| (point[axis] - center[axis]).powi(2)).sum::<f64>().sqrt() + 1e-9;
            if view.contains(point) {
                let (min_m, max_m) = view.bounds_m();
                prop_assert!((0..3).all(|i| min_m[i] - 1e-9 <= point[i] && point[i] <= max_m[i] + 1e-9));
                prop_assert!(view.may_meet(center, radius_m));
            }
            let behind = view.map_from_camera * Point3::new(0.0, 0.0, -1.01);
            prop_assert!(!view.may_meet(behind.coords.into(), 1.0));
        }
    }
}
