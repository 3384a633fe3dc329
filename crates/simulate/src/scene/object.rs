//! Objects: groups of shapes that a scene is made of.

use super::ray::{Bounds, Ray};
use super::shape::Shape;

/// A group of shapes with a bounding box, which most rays miss.
#[derive(Debug, Clone)]
pub(super) struct Object {
    pub(super) parts: Vec<Shape>,
    pub(super) bounds: Bounds,
}

impl Object {
    pub(super) fn new(parts: Vec<Shape>) -> Self {
        let bounds = parts.iter().map(Shape::bounds).fold(Bounds::NONE, |all, part| all.union(&part));
        Self { parts, bounds }
    }

    /// The object turned by `yaw` radians about the origin's vertical, then moved by (x, y) meters.
    pub(super) fn placed(&self, x: f64, y: f64, yaw: f64) -> Self {
        Self::new(self.parts.iter().map(|part| part.placed(x, y, yaw)).collect())
    }

    /// The nearest of `nearest` and the distances to the parts, within `range_max`.
    pub(super) fn nearer_hit(&self, ray: &Ray, nearest: Option<f64>, range_max: f64) -> Option<f64> {
        let hits = self.parts.iter().filter_map(|part| part.hit(ray)).filter(|hit| *hit <= range_max);
        hits.chain(nearest).reduce(f64::min)
    }
}
