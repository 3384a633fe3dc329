//! Which points lie in keep-outs.

use super::keep_outs::{KeepOut, KeepOuts};
use crate::geometry::{Point, Pose};
use crate::util::StopSignal;

/// Points of one word of the answer.
const POINTS_PER_WORD: usize = 64;
/// Words between two looks at the stop signal: some 10 ms where all points lie among all corners that there may be.
const WORDS_PER_STOP_CHECK: usize = 4;

impl KeepOuts {
    /// Sets the bit of each point that lies in a keep-out, and leaves the others: point i is bit i % 64 of
    /// `occupied[i / 64]`. `map_from_points` places the points in the map. Once stopped, of some of them.
    pub fn mark(&self, points: &[Point], map_from_points: &Pose, occupied: &mut [u64], stop: StopSignal<'_>) {
        let bounded: Vec<Bounded<'_>> = self.iter().map(Bounded::of).collect();
        let words = points.chunks(POINTS_PER_WORD).zip(occupied);
        for (points, word) in stop.paced(words, WORDS_PER_STOP_CHECK) {
            let placed = |point: &Point| (map_from_points * point.to_f64()).into();
            let placed: Vec<[f64; 3]> = points.iter().map(placed).collect();
            // Points that come one after the other lie near each other: few keep-outs are looked at.
            let bounds = bounds_of(&placed);
            for keep_out in bounded.iter().filter(|keep_out| keep_out.meets(bounds)) {
                for (i, &point) in placed.iter().enumerate().filter(|(_, point)| keep_out.may_hold(point)) {
                    *word |= u64::from(keep_out.keep_out.shape.contains(point)) << i;
                }
            }
        }
    }

    /// How many sides of shapes a point is compared with at most: what [`KeepOuts::mark`] costs for each point.
    pub fn sides(&self) -> usize {
        self.iter().map(|keep_out| keep_out.shape.corners().max(1)).sum()
    }
}

/// A keep-out with its bounds, smallest and largest coordinates.
struct Bounded<'a> {
    keep_out: &'a KeepOut,
    min_m: [f64; 3],
    max_m: [f64; 3],
}

impl<'a> Bounded<'a> {
    fn of(keep_out: &'a KeepOut) -> Self {
        let (min_m, max_m) = keep_out.shape.bounds_m();
        Self { keep_out, min_m, max_m }
    }

    fn meets(&self, (low_m, high_m): ([f64; 3], [f64; 3])) -> bool {
        (0..3).all(|axis| low_m[axis] <= self.max_m[axis] && high_m[axis] >= self.min_m[axis])
    }

    fn may_hold(&self, point_m: &[f64; 3]) -> bool {
        self.meets((*point_m, *point_m))
    }
}

fn bounds_of(points_m: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let fold = |axis: usize, from: f64, pick: fn(f64, f64) -> f64| {
        points_m.iter().map(|point| point[axis]).fold(from, pick)
    };
    let low = std::array::from_fn(|axis| fold(axis, f64::INFINITY, f64::min));
    (low, std::array::from_fn(|axis| fold(axis, f64::NEG_INFINITY, f64::max)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::keep_out::prism::Prism;
    use crate::map::keep_out::shape::KeepOutShape;
    use crate::map::name::KeepOutName;
    use crate::map::regions::Region;
    use proptest::prelude::*;

    fn keep_outs() -> KeepOuts {
        let cube = KeepOutShape::of_region(Region::cuboid([0.0; 3], [1.0, 2.0, 1.0]).unwrap());
        let ball = KeepOutShape::of_region(Region::ball([3.0, 0.0, 0.0], 1.5).unwrap());
        let prism = Prism::new(&[[-3.0, -3.0], [0.0, -3.0], [0.0, 0.0], [-1.0, -2.0]], [-1.0, 1.0]).unwrap();
        let shapes = [cube.unwrap(), ball.unwrap(), KeepOutShape::Prism(prism)];
        let named = |(i, shape)| KeepOut {
            name: KeepOutName::new(&format!("k{i}")).unwrap(),
            shape,
            made_by: None,
            made_revision: 1,
            expires_at_ns: None,
        };
        shapes.into_iter().enumerate().map(named).collect()
    }

    proptest! {
        #[test]
        fn a_point_is_marked_where_its_place_in_the_map_lies_in_a_shape(
            points in prop::collection::vec(prop::array::uniform3(-5.0f32..5.0), 1..200),
            moved in prop::array::uniform3(-1.0..1.0f64),
            turned in prop::array::uniform3(-3.0..3.0f64),
            before: u64,
        ) {
            let points: Vec<Point> = points.into_iter().map(Point::from).collect();
            let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turned.into());
            let pose = Pose::from_parts(nalgebra::Translation3::from(nalgebra::Vector3::from(moved)), rotation);
            let (all, mut occupied) = (keep_outs(), vec![before; points.len().div_ceil(64)]);
            all.mark(&points, &pose, &mut occupied, StopSignal::NEVER);
            for (i, point) in points.iter().enumerate() {
                let expected = before >> (i % 64) & 1 == 1 || all.contains((pose * point.to_f64()).into());
                prop_assert_eq!(occupied[i / 64] >> (i % 64) & 1 == 1, expected, "{:?}", point);
            }
        }
    }

    #[test]
    fn a_point_of_no_number_lies_nowhere() {
        let (points, mut occupied) = ([Point::new(f32::NAN, 0.0, 0.0), Point::new(0.5, 0.5, 0.5)], [0]);
        keep_outs().mark(&points, &Pose::identity(), &mut occupied, StopSignal::NEVER);
        assert_eq!((occupied, keep_outs().sides()), ([0b10], 6));
    }
}
