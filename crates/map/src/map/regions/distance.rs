//! How far a point lies from a region.

use super::oriented_box::OrientedBox;
use super::region::Region;

impl Region {
    /// How far the point lies from the region, meters; 0 inside and on the border.
    pub fn distance_m(&self, point_m: [f64; 3]) -> f64 {
        match self {
            Self::Box { min_m, max_m } => {
                norm(|axis| (min_m[axis] - point_m[axis]).max(point_m[axis] - max_m[axis]))
            }
            Self::Sphere { center_m, radius_m } => {
                (norm(|axis| (point_m[axis] - center_m[axis]).abs()) - radius_m).max(0.0)
            }
            Self::OrientedBox(of) => of.distance_m(point_m),
        }
    }
}

impl Region {
    /// How far the border is from a point inside, meters; 0 or less on the border and outside.
    pub fn depth_m(&self, point_m: [f64; 3]) -> f64 {
        match self {
            Self::Box { min_m, max_m } => {
                least(|axis| (point_m[axis] - min_m[axis]).min(max_m[axis] - point_m[axis]))
            }
            Self::Sphere { center_m, radius_m } => {
                let [x, y, z] = [0, 1, 2].map(|axis: usize| point_m[axis] - center_m[axis]);
                radius_m - x.hypot(y).hypot(z)
            }
            Self::OrientedBox(of) => {
                let in_box = of.map_from_box().inverse_transform_point(&point_m.into());
                least(|axis| of.size_m()[axis] / 2.0 - in_box[axis].abs())
            }
        }
    }
}

fn least(coordinate: impl Fn(usize) -> f64) -> f64 {
    (0..3).map(coordinate).fold(f64::INFINITY, f64::min)
}

impl OrientedBox {
    fn distance_m(&self, point_m: [f64; 3]) -> f64 {
        let in_box = self.map_from_box().inverse_transform_point(&point_m.into());
        norm(|axis| in_box[axis].abs() - self.size_m()[axis] / 2.0)
    }
}

/// The length of a vector, whose negative coordinates count as 0.
fn norm(coordinate: impl Fn(usize) -> f64) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|axis| coordinate(axis).max(0.0));
    x.hypot(y).hypot(z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn region() -> impl Strategy<Value = Region> {
        let place = || prop::array::uniform3(-3.0..3.0f64);
        let size = || prop::array::uniform3(0.1..4.0f64);
        prop_oneof![
            (place(), size()).prop_map(|(min, size)| {
                let max = std::array::from_fn(|axis| min[axis] + size[axis]);
                Region::cuboid(min, max).unwrap()
            }),
            (place(), 0.1..3.0f64).prop_map(|(center, radius)| Region::ball(center, radius).unwrap()),
            (place(), place(), size()).prop_map(|(center, turned, size)| {
                let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(turned));
                let placed = Pose::from_parts(Translation3::from(Vector3::from(center)), rotation);
                Region::oriented_box(placed, size).unwrap()
            }),
        ]
    }

    proptest! {
        #[test]
        fn all_points_nearer_than_the_border_lie_inside(
            region in region(), point in prop::array::uniform3(-6.0..6.0f64), away in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let depth = region.depth_m(point);
            prop_assert_eq!(depth >= 0.0, region.contains(point) || depth.abs() < 1e-9);
            let length = away.iter().map(|c| c * c).sum::<f64>().sqrt();
            let at = |far: f64| std::array::from_fn(|axis| point[axis] + far * away[axis] / length);
            prop_assert!(depth <= 0.0 || region.contains(at(depth * (1.0 - 1e-9))));
        }
    }

    /// The distance of the nearest of points that fill the region's bounds and lie in it.
    fn sampled_distance(region: &Region, point: [f64; 3], steps: usize) -> f64 {
        let (min, max) = region.bounds_m();
        let at = |axis: usize, i: usize| min[axis] + (max[axis] - min[axis]) * i as f64 / steps as f64;
        let all =
            (0..=steps).flat_map(|x| (0..=steps).flat_map(move |y| (0..=steps).map(move |z| [x, y, z])));
        let places = all.map(|[x, y, z]| [at(0, x), at(1, y), at(2, z)]);
        let away = |place: [f64; 3]| norm(|axis| (place[axis] - point[axis]).abs());
        places.filter(|&place| region.contains(place)).map(away).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_distance_is_that_of_the_nearest_point_inside(region in region(), point in prop::array::uniform3(-8.0..8.0f64)) {
            let distance = region.distance_m(point);
            prop_assert_eq!(distance == 0.0, region.contains(point));
            let (min, max) = region.bounds_m();
            let (steps, diagonal) = (40, norm(|axis| max[axis] - min[axis]));
            let sampled = sampled_distance(&region, point, steps);
            prop_assert!(distance <= sampled + 1e-9, "{} of samples, {}", sampled, distance);
            // A sample of the region lies within some cells of its nearest point, corners of a turned box included.
            prop_assert!(sampled <= distance + 4.0 * diagonal / steps as f64, "{} of samples, {}", sampled, distance);
        }
    }

    #[test]
    fn a_box_without_an_end_is_as_far_as_its_nearest_side() {
        let below = Region::cuboid([f64::NEG_INFINITY; 3], [f64::INFINITY, f64::INFINITY, 1.0]).unwrap();
        assert_eq!(below.distance_m([7.0, -9.0, 3.5]), 2.5);
        assert_eq!(below.distance_m([1e9; 3].map(|c: f64| -c)), 0.0);
    }
}
