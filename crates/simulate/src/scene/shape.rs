//! Analytic shapes: boxes, cylinders, spheres.

use nalgebra::{Point3, Rotation3, Vector3};

use super::ray::{Bounds, Interval, Ray, ball, intersection, slab};

/// A solid in the map frame, or about the origin while furniture is built; meters.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shape {
    /// A box turned by `yaw` about its vertical axis.
    Box { center: Point3<f64>, half: Vector3<f64>, yaw: f64, cos_sin: (f64, f64) },
    /// An upright cylinder.
    Cylinder { center: Point3<f64>, radius: f64, half_height: f64 },
    /// A sphere.
    Sphere { center: Point3<f64>, radius: f64 },
}

impl Shape {
    /// The box of `size` whose bottom's center is `bottom`.
    pub(super) fn cuboid(bottom: [f64; 3], size: [f64; 3]) -> Self {
        let half = Vector3::from(size) / 2.0;
        Self::Box {
            center: Point3::from(bottom) + Vector3::z() * half.z,
            half,
            yaw: 0.0,
            cos_sin: (1.0, 0.0),
        }
    }

    /// The upright cylinder whose bottom's center is `bottom`.
    pub(super) fn cylinder(bottom: [f64; 3], radius: f64, height: f64) -> Self {
        let half_height = height / 2.0;
        Self::Cylinder { center: Point3::from(bottom) + Vector3::z() * half_height, radius, half_height }
    }

    /// The sphere about `center`.
    pub(super) fn sphere(center: [f64; 3], radius: f64) -> Self {
        Self::Sphere { center: center.into(), radius }
    }

    /// The shape turned by `turn` radians about the origin's vertical, then moved by (x, y).
    pub(super) fn placed(self, x: f64, y: f64, turn: f64) -> Self {
        let moved = |center: Point3<f64>| {
            Rotation3::from_axis_angle(&Vector3::z_axis(), turn) * center + Vector3::new(x, y, 0.0)
        };
        match self {
            Self::Box { center, half, yaw, .. } => {
                let yaw = yaw + turn;
                Self::Box { center: moved(center), half, yaw, cos_sin: (yaw.cos(), yaw.sin()) }
            }
            Self::Cylinder { center, radius, half_height } => {
                Self::Cylinder { center: moved(center), radius, half_height }
            }
            Self::Sphere { center, radius } => Self::Sphere { center: moved(center), radius },
        }
    }

    pub(super) fn bounds(&self) -> Bounds {
        match *self {
            Self::Box { center, half, cos_sin: (cos, sin), .. } => {
                let (cos, sin) = (cos.abs(), sin.abs());
                let turned = Vector3::new(cos * half.x + sin * half.y, sin * half.x + cos * half.y, half.z);
                Bounds::around(center, turned)
            }
            Self::Cylinder { center, radius, half_height } => {
                Bounds::around(center, Vector3::new(radius, radius, half_height))
            }
            Self::Sphere { center, radius } => Bounds::around(center, Vector3::repeat(radius)),
        }
    }

    /// Distance to the first point of the surface along `ray`.
    pub(super) fn hit(&self, ray: &Ray) -> Option<f64> {
        let (from, to) = self.interval(ray)?;
        [from, to].into_iter().find(|distance| *distance >= 0.0)
    }

    fn interval(&self, ray: &Ray) -> Option<Interval> {
        match *self {
            Self::Box { center, half, cos_sin: (cos, sin), .. } => {
                let (o, d) = (ray.origin - center, ray.direction);
                let turned = |v: Vector3<f64>| (cos * v.x + sin * v.y, cos * v.y - sin * v.x);
                let ((ox, oy), (dx, dy)) = (turned(o), turned(d));
                let xy = intersection(slab(ox, dx.recip(), half.x), slab(oy, dy.recip(), half.y))?;
                intersection(xy, slab(o.z, ray.inverse.z, half.z))
            }
            Self::Cylinder { center, radius, half_height } => {
                let (o, d) = (ray.origin - center, ray.direction);
                intersection(ball([o.x, o.y], [d.x, d.y], radius)?, slab(o.z, ray.inverse.z, half_height))
            }
            Self::Sphere { center, radius } => {
                ball((ray.origin - center).into(), ray.direction.into(), radius)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(shape: Shape, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        shape.hit(&Ray::new(origin.into(), direction.into()))
    }

    fn assert_near(distance: Option<f64>, expected: f64) {
        assert!(distance.is_some_and(|d| (d - expected).abs() < 1e-12), "{distance:?}, not {expected}");
    }

    #[test]
    fn a_ray_meets_a_box_at_its_face_turned_or_not() {
        let cube = Shape::cuboid([0.0; 3], [2.0; 3]);
        assert_near(hit(cube, [-5.0, 0.5, 1.0], [1.0, 0.0, 0.0]), 4.0);
        assert_near(hit(cube, [0.0, 0.0, 5.0], [0.0, 0.0, -1.0]), 3.0);
        assert_eq!(hit(cube, [-5.0, 1.5, 1.0], [1.0, 0.0, 0.0]), None);
        assert_eq!(hit(cube, [-5.0, 0.0, 1.0], [-1.0, 0.0, 0.0]), None);
        let diamond = cube.placed(10.0, 0.0, std::f64::consts::FRAC_PI_4);
        assert_near(hit(diamond, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), 10.0 - 2f64.sqrt());
    }

    #[test]
    fn a_ray_meets_a_cylinder_at_its_side_and_at_its_caps() {
        let cylinder = Shape::cylinder([0.0; 3], 0.5, 2.0);
        assert_near(hit(cylinder, [-3.0, 0.0, 1.0], [1.0, 0.0, 0.0]), 2.5);
        assert_near(hit(cylinder, [0.2, 0.2, 5.0], [0.0, 0.0, -1.0]), 3.0);
        assert_eq!(hit(cylinder, [-3.0, 0.0, 2.1], [1.0, 0.0, 0.0]), None);
        assert_eq!(hit(cylinder, [0.6, 0.0, 5.0], [0.0, 0.0, -1.0]), None);
    }

    #[test]
    fn a_ray_meets_a_sphere_and_from_inside_its_far_side() {
        let sphere = Shape::sphere([1.0, 2.0, 3.0], 0.5);
        assert_near(hit(sphere, [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]), 2.5);
        assert_near(hit(sphere, [1.0, 2.0, 3.0], [0.0, 1.0, 0.0]), 0.5);
        assert_eq!(hit(sphere, [1.0, 2.6, 0.0], [0.0, 0.0, 1.0]), None);
    }

    #[test]
    fn distances_are_in_lengths_of_the_direction() {
        let cube = Shape::cuboid([0.0; 3], [2.0; 3]);
        assert_near(hit(cube, [-5.0, 0.0, 1.0], [2.0, 0.0, 0.0]), 2.0);
    }

    #[test]
    fn a_hit_lies_on_the_edge_of_the_bounds_or_inside() {
        let shapes =
            [Shape::cuboid([0.1, 0.2, 0.0], [1.0, 0.4, 0.7]), Shape::cylinder([0.5, 0.0, 0.1], 0.2, 1.0)];
        for shape in shapes.map(|shape| shape.placed(2.0, -1.0, 0.7)) {
            let bounds = shape.bounds();
            for i in 0..2000 {
                let angle = f64::from(i) * 0.01;
                let origin = Point3::new(2.0, -1.0, 0.4) + Vector3::new(angle.cos(), angle.sin(), 0.0) * 4.0;
                let target = Point3::new(2.0 + 0.3 * (angle * 7.0).sin(), -1.0, 0.5);
                let ray = Ray::new(origin, target - origin);
                let Some(distance) = shape.hit(&ray) else { continue };
                let p = origin + ray.direction * distance;
                assert!(bounds.is_met(&ray, distance));
                assert!((0..3).all(|a| p[a] >= bounds.min[a] - 1e-9 && p[a] <= bounds.max[a] + 1e-9));
            }
        }
    }
}
