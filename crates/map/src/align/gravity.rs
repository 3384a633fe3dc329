//! The direction of gravity, as an accelerometer tells it: which way up a sensor is.

use nalgebra::{UnitVector3, Vector3};

/// Direction of gravity in the sensor frame and in the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gravity {
    pub(super) in_sensor: UnitVector3<f64>,
    pub(super) in_map: UnitVector3<f64>,
}

/// Down in the frame of a map whose z axis points up.
pub const MAP_DOWN: [f64; 3] = [0.0, 0.0, -1.0];

/// A direction that is zero or not finite: the field, and its value.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{0} must be a finite direction other than zero, got {1:?}")]
pub struct GravityError(pub &'static str, pub [f64; 3]);

impl Gravity {
    /// Gravity as the direction in which things fall, of any length, in the sensor frame and in the map frame. An
    /// accelerometer at rest reads the opposite direction.
    ///
    /// # Errors
    /// When one is not finite, or zero.
    pub fn new(in_sensor: [f64; 3], in_map: [f64; 3]) -> Result<Self, GravityError> {
        let direction = |name, vector: [f64; 3]| {
            let vector_of_any_length = Vector3::from(vector);
            // The square of its length may be no number of this kind.
            let largest = vector_of_any_length.amax();
            let usable = vector_of_any_length.iter().all(|c| c.is_finite()) && largest > 0.0;
            let unit = usable.then(|| UnitVector3::new_normalize(vector_of_any_length / largest));
            unit.ok_or(GravityError(name, vector))
        };
        Ok(Self {
            in_sensor: direction("gravity.in_sensor", in_sensor)?,
            in_map: direction("gravity.in_map", in_map)?,
        })
    }

    /// Direction of gravity in the sensor frame, a unit vector.
    pub fn in_sensor(&self) -> [f64; 3] {
        self.in_sensor.into_inner().into()
    }

    /// Direction of gravity in the map frame, a unit vector.
    pub fn in_map(&self) -> [f64; 3] {
        self.in_map.into_inner().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_may_have_any_length_but_none() {
        let gravity = Gravity::new([0.0, 3.0, 4.0], MAP_DOWN).unwrap();
        assert_eq!(gravity.in_sensor(), [0.0, 0.6, 0.8]);
        for length in [1e-320, 1e-162, 1e155, f64::MAX] {
            let [x, y, z] = Gravity::new([0.0, 0.0, -length], MAP_DOWN).unwrap().in_sensor();
            assert_eq!([x, y, z], [0.0, 0.0, -1.0]);
        }
        let diagonal = Gravity::new([f64::MAX, 0.0, -f64::MAX], MAP_DOWN).unwrap().in_sensor();
        assert!((diagonal[0] - 0.5f64.sqrt()).abs() < 1e-12, "{diagonal:?}");
        for bad in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
            let error = Gravity::new(bad, MAP_DOWN).unwrap_err().to_string();
            assert!(error.contains("gravity.in_sensor"), "{error}");
            assert!(Gravity::new(MAP_DOWN, bad).unwrap_err().to_string().contains("gravity.in_map"));
        }
    }
}
