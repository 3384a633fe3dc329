//! The place of a shape that is nearest to a point.

use super::polygon;
use super::prism::Prism;
use super::shape::KeepOutShape;
use crate::map::regions::Region;

impl KeepOutShape {
    /// The place of the shape that is nearest to the point, which is the point where it lies inside; meters.
    pub fn nearest_place_m(&self, point_m: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Region(Region::Box { min_m, max_m }) => clamped(point_m, *min_m, *max_m),
            Self::Region(Region::Sphere { center_m, radius_m }) => {
                let away: [f64; 3] = std::array::from_fn(|axis| point_m[axis] - center_m[axis]);
                let distance = away[0].hypot(away[1]).hypot(away[2]);
                if distance <= *radius_m {
                    return point_m;
                }
                std::array::from_fn(|axis| center_m[axis] + away[axis] / distance * radius_m)
            }
            Self::Region(Region::OrientedBox(of)) => {
                let in_box = of.map_from_box().inverse_transform_point(&point_m.into()).into();
                let half_m = of.size_m().map(|side| side / 2.0);
                let place = clamped(in_box, half_m.map(|half| -half), half_m);
                of.map_from_box().transform_point(&place.into()).into()
            }
            Self::Prism(prism) => nearest_of_prism(prism, point_m),
        }
    }
}

fn clamped(point_m: [f64; 3], min_m: [f64; 3], max_m: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| point_m[axis].clamp(min_m[axis], max_m[axis]))
}

fn nearest_of_prism(prism: &Prism, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let [low, high] = prism.z_m();
    let [x, y] = polygon::nearest_place(prism.corners_m(), [x, y]);
    [x, y, z.clamp(low, high)]
}

#[cfg(test)]
mod tests {
    use crate::map::keep_out::test_shapes::shape;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_nearest_place_is_of_the_shape_and_as_far_as_the_shape(shape in shape(), point in prop::array::uniform3(-30.0..30.0f64)) {
            let place = shape.nearest_place_m(point);
            prop_assert!(shape.distance_m(place) < 1e-9);
            let away = (0..3).map(|axis| (place[axis] - point[axis]).powi(2)).sum::<f64>().sqrt();
            prop_assert!((away - shape.distance_m(point)).abs() < 1e-9);
        }
    }
}
