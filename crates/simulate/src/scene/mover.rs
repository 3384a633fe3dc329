//! Things that do not stay: a box that is taken away, a person who walks.

use super::object::Object;
use super::shape::Shape;
use super::simulated_scene::Scene;

/// A thing in a scene that is not there for ever, or not always at the same place.
#[derive(Debug, Clone)]
pub enum Mover {
    /// A box that stands until it is taken away.
    Crate {
        /// Center of its bottom, map frame, meters.
        bottom_m: [f64; 3],
        /// Its sides, meters.
        size_m: [f64; 3],
        /// The first step at which it is not there.
        gone_at: usize,
    },
    /// A person who walks along a line, over and over: there and back.
    Walker {
        /// Where the walk begins and turns back, on the floor, map frame, meters.
        from_m: [f64; 2],
        /// Where it turns first.
        to_m: [f64; 2],
        /// Way from one step to the next, meters.
        step_m: f64,
    },
}

/// Radius of a walker's body at its widest, meters.
const BODY_M: f64 = 0.22;
/// Height of a walker, meters.
const HEIGHT_M: f64 = 1.78;

impl Mover {
    /// Where it is at `step`: the corners of a box around it, map frame, meters; none where it is not there.
    pub fn bounds_m(&self, step: usize) -> Option<[[f64; 3]; 2]> {
        let around = |[x, y, z]: [f64; 3], [length, width, height]: [f64; 3]| {
            [[x - length / 2.0, y - width / 2.0, z], [x + length / 2.0, y + width / 2.0, z + height]]
        };
        match *self {
            Self::Crate { bottom_m, size_m, gone_at } => (step < gone_at).then(|| around(bottom_m, size_m)),
            Self::Walker { .. } => {
                let [x, y] = self.place(step)?;
                Some(around([x, y, 0.0], [2.0 * BODY_M, 2.0 * BODY_M, HEIGHT_M]))
            }
        }
    }

    /// Where a walker is at `step`.
    fn place(&self, step: usize) -> Option<[f64; 2]> {
        let Self::Walker { from_m, to_m, step_m } = *self else { return None };
        let length_m = (to_m[0] - from_m[0]).hypot(to_m[1] - from_m[1]);
        let way_m = (step as f64 * step_m).rem_euclid(2.0 * length_m);
        let share = way_m.min(2.0 * length_m - way_m) / length_m;
        Some([0, 1].map(|axis| from_m[axis] + share * (to_m[axis] - from_m[axis])))
    }

    fn object(&self, step: usize) -> Option<Object> {
        match *self {
            Self::Crate { bottom_m, size_m, gone_at } => {
                (step < gone_at).then(|| Object::new(vec![Shape::cuboid(bottom_m, size_m)]))
            }
            Self::Walker { .. } => {
                let [x, y] = self.place(step)?;
                Some(Object::new(vec![
                    Shape::cylinder([x - 0.11, y, 0.0], 0.08, 0.85),
                    Shape::cylinder([x + 0.11, y, 0.0], 0.08, 0.85),
                    Shape::cylinder([x, y, 0.85], BODY_M, 0.65),
                    Shape::sphere([x, y, HEIGHT_M - 0.13], 0.13),
                ]))
            }
        }
    }
}

impl Scene {
    /// The scene as it is at `step`, with what stands and moves in it.
    #[must_use]
    pub fn with_movers(&self, movers: &[Mover], step: usize) -> Self {
        let moving = movers.iter().filter_map(|mover| mover.object(step));
        Self { objects: self.objects.iter().cloned().chain(moving).collect() }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    fn ahead(scene: &Scene, x: f64) -> Option<f64> {
        scene.cast(Point3::new(x, 3.0, 1.2), -Vector3::y(), 30.0)
    }

    #[test]
    fn a_box_stands_until_it_is_taken_away() {
        let box_of = Mover::Crate { bottom_m: [10.0, 2.0, 0.0], size_m: [1.0, 1.0, 1.5], gone_at: 3 };
        let hall = Scene::hall(1);
        let empty = ahead(&hall, 10.0);
        for step in 0..6 {
            let seen = ahead(&hall.with_movers(std::slice::from_ref(&box_of), step), 10.0).unwrap();
            let expected = if step < 3 { 0.5 } else { empty.unwrap() };
            assert!((seen - expected).abs() < 1e-9, "{seen} at step {step}");
            assert_eq!(box_of.bounds_m(step).is_some(), step < 3);
        }
    }

    #[test]
    fn a_walker_goes_there_and_back_and_is_seen_within_its_bounds() {
        let walker = Mover::Walker { from_m: [8.0, 2.0], to_m: [9.0, 2.0], step_m: 0.25 };
        let x = |step| {
            let [min_m, max_m] = walker.bounds_m(step).unwrap();
            (min_m[0] + max_m[0]) / 2.0
        };
        let places: Vec<f64> = (0..9).map(x).collect();
        assert_eq!(places, [8.0, 8.25, 8.5, 8.75, 9.0, 8.75, 8.5, 8.25, 8.0]);
        let hall = Scene::hall(1);
        let seen = ahead(&hall.with_movers(std::slice::from_ref(&walker), 2), 8.5).unwrap();
        assert!((seen - (1.0 - BODY_M)).abs() < 1e-9, "{seen}");
        assert_eq!(ahead(&hall.with_movers(&[walker], 2), 9.5), ahead(&hall, 9.5));
    }
}
