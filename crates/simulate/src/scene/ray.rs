//! Rays, and where they are inside slabs, balls and bounds.
//!
//! Every shape is convex, so a ray is inside it along one interval; its surface is at the interval's ends.

use nalgebra::{Point3, Vector3};

/// A half line; distances along it are in lengths of `direction`.
pub(super) struct Ray {
    pub(super) origin: Point3<f64>,
    pub(super) direction: Vector3<f64>,
    /// 1 / direction; infinite where the ray is parallel to a slab.
    pub(super) inverse: Vector3<f64>,
}

impl Ray {
    pub(super) fn new(origin: Point3<f64>, direction: Vector3<f64>) -> Self {
        Self { origin, direction, inverse: direction.map(f64::recip) }
    }
}

/// Interval of a line, from and to, in lengths of its direction.
pub(super) type Interval = (f64, f64);

pub(super) fn intersection(a: Interval, b: Interval) -> Option<Interval> {
    let (from, to) = (a.0.max(b.0), a.1.min(b.1));
    (from <= to).then_some((from, to))
}

/// Interval of t in which `origin + t * direction` is within -half..=half, given 1 / direction.
pub(super) fn slab(origin: f64, inverse: f64, half: f64) -> Interval {
    let (a, b) = ((-half - origin) * inverse, (half - origin) * inverse);
    // On the face of the slab a parallel ray gives 0 * inf = NaN, which min and max ignore.
    (a.min(b), a.max(b))
}

/// Interval of t in which `origin + t * direction` is within `radius` of zero, in the dimensions given.
pub(super) fn ball<const N: usize>(origin: [f64; N], direction: [f64; N], radius: f64) -> Option<Interval> {
    let dot = |a: [f64; N], b: [f64; N]| (0..N).map(|i| a[i] * b[i]).sum::<f64>();
    let (a, half_b, c) =
        (dot(direction, direction), dot(origin, direction), dot(origin, origin) - radius * radius);
    if a == 0.0 {
        return (c <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let discriminant = half_b * half_b - a * c;
    let root = (discriminant >= 0.0).then(|| discriminant.sqrt())?;
    Some(((-half_b - root) / a, (-half_b + root) / a))
}

/// An axis-aligned box in the map frame, meters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub(super) min: Point3<f64>,
    pub(super) max: Point3<f64>,
}

impl Bounds {
    /// Empty bounds: no ray meets them, and their union with others is the others.
    pub(super) const NONE: Self = Self {
        min: Point3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: Point3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    pub(super) fn around(center: Point3<f64>, half: Vector3<f64>) -> Self {
        Self { min: center - half, max: center + half }
    }

    pub(super) fn union(&self, other: &Self) -> Self {
        Self { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// True when `ray` is somewhere inside at a distance in 0..=`range_max`.
    pub(super) fn is_met(&self, ray: &Ray, range_max: f64) -> bool {
        let a = (self.min - ray.origin).component_mul(&ray.inverse);
        let b = (self.max - ray.origin).component_mul(&ray.inverse);
        let from = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z));
        let to = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z));
        from <= to && to >= 0.0 && from <= range_max
    }
}
