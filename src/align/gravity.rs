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
            let length = Vector3::from(vector).norm();
            let usable = length.is_finite() && length > 0.0;
            let unit = usable.then(|| UnitVector3::new_normalize(Vector3::from(vector)));
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
