//! Where rays enter shapes.

use super::polygon;
use super::prism::Prism;
use super::shape::KeepOutShape;
use crate::map::regions::Region;

/// A ray from an origin, meters in the map frame, along a unit vector.
#[derive(Debug, Clone, Copy)]
pub struct ShapeRay {
    /// Where it begins.
    pub origin_m: [f64; 3],
    /// Where it leads: a unit vector.
    pub direction: [f64; 3],
}

/// What a ray has of something, from a distance to another, meters; empty where they descend.
type Span = (f64, f64);

/// All of a ray.
const WHOLE: Span = (0.0, f64::INFINITY);

impl KeepOutShape {
    /// How far along the ray it is in the shape first, or on its border; none where it never is.
    pub fn entered_m(&self, ray: &ShapeRay) -> Option<f64> {
        match self {
            Self::Region(Region::Box { min_m, max_m }) => in_box(ray, *min_m, *max_m),
            Self::Region(Region::Sphere { center_m, radius_m }) => in_ball(ray, *center_m, *radius_m),
            Self::Region(Region::OrientedBox(of)) => {
                let box_from_map = of.map_from_box().inverse();
                let origin = box_from_map.transform_point(&ray.origin_m.into());
                let direction = box_from_map.transform_vector(&ray.direction.into());
                let in_frame = ShapeRay { origin_m: origin.into(), direction: direction.into() };
                let half_m = of.size_m().map(|side| side / 2.0);
                in_box(&in_frame, half_m.map(|half| -half), half_m)
            }
            Self::Prism(prism) => in_prism(ray, prism),
        }
    }
}

/// What of a span lies between two bounds along an axis.
fn between(ray: &ShapeRay, axis: usize, (low, high): (f64, f64), (from, to): Span) -> Span {
    let (origin, direction) = (ray.origin_m[axis], ray.direction[axis]);
    if direction == 0.0 {
        return if (low..=high).contains(&origin) { (from, to) } else { (1.0, 0.0) };
    }
    let (one, other) = ((low - origin) / direction, (high - origin) / direction);
    (from.max(one.min(other)), to.min(one.max(other)))
}

fn in_box(ray: &ShapeRay, min_m: [f64; 3], max_m: [f64; 3]) -> Option<f64> {
    let (from, to) = (0..3).fold(WHOLE, |span, axis| between(ray, axis, (min_m[axis], max_m[axis]), span));
    (from <= to).then_some(from)
}

fn in_ball(ray: &ShapeRay, center_m: [f64; 3], radius_m: f64) -> Option<f64> {
    let away: [f64; 3] = std::array::from_fn(|axis| ray.origin_m[axis] - center_m[axis]);
    let dot = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|axis| a[axis] * b[axis]).sum::<f64>();
    let outside = dot(&away, &away) - radius_m * radius_m;
    if outside <= 0.0 {
        return Some(0.0);
    }
    let toward = -dot(&away, &ray.direction);
    // The place of the ray that is nearest to the center, from which the border is as far on both sides.
    let beside: [f64; 3] = std::array::from_fn(|axis| away[axis] + toward * ray.direction[axis]);
    let squared = radius_m * radius_m - dot(&beside, &beside);
    (toward > 0.0 && squared >= 0.0).then(|| (toward - squared.sqrt()).max(0.0))
}

fn in_prism(ray: &ShapeRay, prism: &Prism) -> Option<f64> {
    let [low, high] = prism.z_m();
    let (from, to) = between(ray, 2, (low, high), WHOLE);
    if from > to {
        return None;
    }
    let at = |axis: usize| ray.origin_m[axis] + from * ray.direction[axis];
    if polygon::contains(prism.corners_m(), [at(0), at(1)]) {
        return Some(from);
    }
    let (origin, direction) = ([ray.origin_m[0], ray.origin_m[1]], [ray.direction[0], ray.direction[1]]);
    let crossed = polygon::crossings(prism.corners_m(), origin, direction);
    crossed.filter(|at| (from..=to).contains(at)).reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::keep_out::test_shapes::shape;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_ray_enters_where_its_first_place_inside_is(
            shape in shape(), origin_m in prop::array::uniform3(-30.0..30.0f64), toward in prop::array::uniform3(-20.0..20.0f64),
            is_along in prop::option::of(0usize..3),
        ) {
            let mut way: [f64; 3] = std::array::from_fn(|axis| toward[axis] - origin_m[axis]);
            if let Some(axis) = is_along {
                way = std::array::from_fn(|other| if other == axis { way[axis] } else { 0.0 });
            }
            let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
            prop_assume!(length > 0.1);
            let ray = ShapeRay { origin_m, direction: way.map(|c| c / length) };
            let place = |at: f64| std::array::from_fn(|axis| origin_m[axis] + at * ray.direction[axis]);
            // Every 2 cm of 100 m.
            let sampled = (0..5000).map(|step| f64::from(step) * 0.02).find(|at| shape.contains(place(*at)));
            match shape.entered_m(&ray) {
                Some(at) => {
                    prop_assert!(shape.distance_m(place(at)) < 1e-9, "{} m away", shape.distance_m(place(at)));
                    prop_assert!(sampled.is_none_or(|sampled| sampled >= at - 1e-9), "inside at {sampled:?}, entered at {at}");
                }
                None => prop_assert_eq!(sampled, None),
            }
        }
    }

    #[test]
    fn a_ray_that_begins_on_a_border_is_inside_and_one_that_leads_away_never_is() {
        let cube = KeepOutShape::of_region(Region::cuboid([0.0; 3], [1.0; 3]).unwrap()).unwrap();
        let ray = |x: f64, direction: [f64; 3]| ShapeRay { origin_m: [x, 0.5, 0.5], direction };
        assert_eq!(cube.entered_m(&ray(1.0, [1.0, 0.0, 0.0])), Some(0.0));
        assert_eq!(cube.entered_m(&ray(1.5, [1.0, 0.0, 0.0])), None);
        assert_eq!(cube.entered_m(&ray(1.5, [-1.0, 0.0, 0.0])), Some(0.5));
        assert_eq!(cube.entered_m(&ray(1.5, [0.0, 0.0, 1.0])), None);
    }
}
