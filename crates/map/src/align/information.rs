//! How certain an alignment is of a pose, direction by direction.

use nalgebra::{Matrix6, Unit, Vector3, Vector6};

use crate::geometry::{Point, symmetric_eigen};

/// The information matrix (inverse covariance) of a pose.
///
/// Rows and columns are x y z (meters, along the map's axes) and rx ry rz (radians, about the map's axes through the
/// sensor): what a pose graph takes as the weight of this measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseInformation {
    matrix: Matrix6<f64>,
    lever_m: f64,
}

/// A direction in which the scan does not fix the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// A unit vector: x y z along the map's axes, then rotations about them through the sensor, each times the scan's
    /// root mean square range, so that both are lengths.
    pub direction: [f64; 6],
    /// Standard deviation of the pose along `direction`, meters; infinite where nothing fixes it.
    pub std_m: f64,
}

impl PoseInformation {
    /// The information `matrix` of a pose that was found with `points` (sensor frame). The root mean square range of
    /// the points converts rotations to lengths.
    pub(super) fn new(matrix: Matrix6<f64>, points: &[Point]) -> Self {
        Self { matrix, lever_m: root_mean_square_range_m(points).max(f64::MIN_POSITIVE) }
    }

    /// The information of a pose that nothing is known of: zero.
    pub(super) fn none(points: &[Point]) -> Self {
        Self::new(Matrix6::zeros(), points)
    }

    /// The same, but for the shift along `direction` (along the map's axes), of which nothing is known.
    pub(super) fn without(self, direction: &Unit<Vector3<f64>>) -> Self {
        let along = Vector6::from_fn(|i, _| if i < 3 { direction[i] } else { 0.0 });
        let across = Matrix6::identity() - along * along.transpose();
        Self { matrix: across * self.matrix * across, ..self }
    }

    /// Rows of the information matrix; entries are in 1 / m^2, 1 / (m rad) and 1 / rad^2.
    pub fn rows(&self) -> [[f64; 6]; 6] {
        std::array::from_fn(|row| std::array::from_fn(|column| self.matrix[(row, column)]))
    }

    /// All six principal directions of the pose, the least certain first. A matrix without finite eigenvalues gives the
    /// axes, all open.
    pub fn directions(&self) -> Vec<Direction> {
        let scale = Vector6::from_fn(|i, _| if i < 3 { 1.0 } else { 1.0 / self.lever_m });
        let scaled = Matrix6::from_diagonal(&scale) * self.matrix * Matrix6::from_diagonal(&scale);
        let Some(eigen) = symmetric_eigen(scaled) else {
            let axis = |i: usize| std::array::from_fn(|place| if place == i { 1.0 } else { 0.0 });
            return (0..6).map(|i| Direction { direction: axis(i), std_m: f64::INFINITY }).collect();
        };
        let mut directions: Vec<_> = (0..6)
            .map(|i| Direction {
                direction: eigen.eigenvectors.column(i).into_owned().into(),
                std_m: 1.0 / eigen.eigenvalues[i].max(0.0).sqrt(),
            })
            .collect();
        directions.sort_by(|a, b| b.std_m.total_cmp(&a.std_m));
        directions
    }

    /// The principal directions whose standard deviation is `std_m` (meters) or more.
    pub fn undetermined(&self, std_m: f64) -> Vec<Direction> {
        self.directions().into_iter().filter(|direction| direction.std_m > std_m).collect()
    }
}

/// Formats as `x 0.97 z -0.24 (std 0.031 m)`.
impl std::fmt::Display for Direction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let parts = ["x", "y", "z", "turn x", "turn y", "turn z"].into_iter().zip(self.direction);
        for (name, part) in parts.filter(|(_, part)| part.abs() >= 0.1) {
            write!(f, "{name} {part:.2} ")?;
        }
        write!(f, "(std {:.3} m)", self.std_m)
    }
}

/// The root mean square range of `points` from the sensor, meters; 0 without points.
pub(super) fn root_mean_square_range_m(points: &[Point]) -> f64 {
    let squares: f64 = points.iter().map(|point| point.to_f64().coords.norm_squared()).sum();
    (squares / points.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_leaves_two_shifts_and_a_turn_open() {
        let points = [Point::new(2.0, 0.0, 0.0), Point::new(-2.0, 0.0, 0.0)];
        let held = Matrix6::from_diagonal(&Vector6::new(1e4, 0.0, 0.0, 0.0, 4e4, 4e4));
        let information = PoseInformation::new(held, &points);
        let open = information.undetermined(0.05);
        assert_eq!(open.len(), 3);
        assert!(open.iter().all(|open| open.std_m.is_infinite() && open.direction[0].abs() < 1e-12));
        let held = information.directions()[5];
        assert!((held.std_m - 0.01).abs() < 1e-12, "{held:?}");
    }

    #[test]
    fn a_shift_of_which_nothing_is_known_is_open_and_what_lies_across_it_is_as_it_was() {
        let points = [Point::new(2.0, 0.0, 0.0), Point::new(-2.0, 0.0, 0.0)];
        let held = PoseInformation::new(Matrix6::identity() * 1e4, &points);
        let along = Unit::new_normalize(Vector3::new(0.6, 0.8, 0.0));
        let open = held.without(&along).undetermined(0.1);
        assert_eq!(open.len(), 1);
        let [x, y, ..] = open[0].direction;
        assert!((x * 0.6 + y * 0.8).abs() > 0.999 && open[0].std_m > 1e3, "{open:?}");
    }

    #[test]
    fn numbers_that_are_none_leave_every_direction_open() {
        for value in [f64::NAN, f64::INFINITY, f64::MAX] {
            let information =
                PoseInformation::new(Matrix6::from_element(value), &[Point::new(1e30, 0.0, 0.0)]);
            let directions = information.directions();
            assert_eq!(directions.len(), 6);
            assert!(directions.iter().all(|held| held.std_m.is_infinite() || value.is_finite()));
            assert!(directions.iter().all(|held| held.direction.iter().all(|c| c.is_finite())));
        }
    }
}
