//! [`Scene`]: the objects that a simulated sensor looks at.

use nalgebra::{Point3, Vector3};

use super::object::Object;
use super::ray::Ray;
use super::{building, equal_rooms, furnish, hall, places};

/// A simulated scene: four rooms and a corridor of 14 x 9 x 2.7 m, with furniture. The map frame's origin is a corner
/// of the floor; z points up.
#[derive(Debug, Clone)]
pub struct Scene {
    pub(super) objects: Vec<Object>,
}

impl Scene {
    /// The building with furniture drawn from `seed`; the same seed gives the same scene.
    ///
    /// Seeds differ in the furniture's sizes and places; none of it ever stands in the robots' way.
    pub fn furnished(seed: u64) -> Self {
        Self { objects: [building::building(), furnish::furniture(seed)].concat() }
    }

    /// A hall of 20 x 14 x 2.7 m with six pillars and furniture along its walls drawn from `seed`, and nothing else
    /// within 4.5 m of its center (10, 7): room to drive circles in.
    pub fn hall(seed: u64) -> Self {
        Self { objects: hall::hall(seed) }
    }

    /// Two rooms of 7 x 5 x 2.7 m without doors, the first with a corner at the origin, the second `apart_m` from it
    /// along x, with the same cupboards drawn from `seed`: a scan of one is a scan of the other.
    pub fn equal_rooms(seed: u64, apart_m: f64) -> Self {
        Self { objects: equal_rooms::equal_rooms(seed, apart_m) }
    }

    /// A room of `size_m` (length and width) and 2.7 m of height about the origin, with as many pieces of furniture
    /// drawn from `seed`: turned around, its walls look the same.
    pub fn rectangular_room(seed: u64, size_m: [f64; 2], pieces: usize) -> Self {
        Self { objects: places::rectangular_room(seed, size_m, pieces, 0) }
    }

    /// The same room after the first `moved` of its pieces were carried to other places.
    pub fn rearranged_room(seed: u64, size_m: [f64; 2], pieces: usize, moved: usize) -> Self {
        Self { objects: places::rectangular_room(seed, size_m, pieces, moved) }
    }

    /// An aisle along x between shelves, 3 m wide and `length_m` long from x = 0, with an upright every `period_m`.
    pub fn aisle(period_m: f64, length_m: f64) -> Self {
        Self { objects: places::aisle(period_m, length_m) }
    }

    /// A yard under the open sky: level ground of 120 x 120 m about the origin, and four containers on it, 15 to 25 m
    /// from its middle, drawn from `seed`.
    pub fn yard(seed: u64) -> Self {
        Self { objects: places::yard(seed) }
    }

    /// This scene, with people drawn from `seed` about a place.
    pub fn with_people(&self, seed: u64, people: usize, about: [f64; 2]) -> Self {
        let mut objects = self.objects.clone();
        objects.extend(places::crowd(seed, people, about));
        Self { objects }
    }

    /// Distance from `origin` (map frame, meters) to the first surface along `direction`, none beyond
    /// `range_max`.
    ///
    /// Distances are in lengths of `direction`: meters for a unit vector, meters of depth for one whose
    /// component along the optical axis is one.
    pub fn cast(&self, origin: Point3<f64>, direction: Vector3<f64>, range_max: f64) -> Option<f64> {
        let ray = Ray::new(origin, direction);
        let mut nearest = None;
        for object in &self.objects {
            if object.bounds.is_met(&ray, nearest.unwrap_or(range_max)) {
                nearest = object.nearer_hit(&ray, nearest, range_max);
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shape::Shape;

    fn cast(scene: &Scene, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        scene.cast(origin.into(), direction.into(), 30.0)
    }

    #[test]
    fn rays_in_the_empty_building_meet_its_walls_at_known_distances() {
        let empty = Scene { objects: building::building() };
        for (origin, direction, expected) in [
            ([1.0, 7.0, 1.0], [0.0, 0.0, -1.0], 1.0),
            ([1.0, 7.0, 1.0], [0.0, 0.0, 1.0], 1.7),
            ([1.0, 7.0, 1.0], [-1.0, 0.0, 0.0], 1.0),
            ([1.0, 8.0, 1.0], [1.0, 0.0, 0.0], 5.94),
            // Through the door between the northern rooms, and above it.
            ([1.0, 6.9, 1.0], [1.0, 0.0, 0.0], 13.0),
            ([1.0, 6.9, 2.4], [1.0, 0.0, 0.0], 5.94),
            // Through two doors, across the corridor.
            ([2.5, 8.0, 1.0], [0.0, -1.0, 0.0], 8.0),
        ] {
            let distance = cast(&empty, origin, direction).unwrap();
            assert!((distance - expected).abs() < 1e-9, "{distance} from {origin:?}, not {expected}");
        }
    }

    #[test]
    fn the_nearest_of_several_shapes_counts_and_only_within_range() {
        let sphere = |x: f64| Object::new(vec![Shape::sphere([x, 0.0, 0.0], 1.0)]);
        let scene = Scene { objects: vec![sphere(9.0), sphere(5.0), sphere(-3.0)] };
        let (origin, direction) = (Point3::origin(), Vector3::x());
        assert_eq!(scene.cast(origin, direction, 30.0), Some(4.0));
        assert_eq!(scene.cast(origin, direction, 4.0), Some(4.0));
        assert_eq!(scene.cast(origin, direction, 3.9), None);
        assert_eq!(scene.cast(origin, Vector3::y(), 30.0), None);
    }

    #[test]
    fn bounds_change_no_distance() {
        let scene = Scene::furnished(3);
        let parts: Vec<Shape> = scene.objects.iter().flat_map(|object| object.parts.clone()).collect();
        for i in 0..20_000 {
            let (a, b) = (f64::from(i) * 0.377, f64::from(i) * 0.0113);
            let direction = Vector3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
            let origin = Point3::new(4.6 + 0.5 * a.sin(), 6.9, 1.0);
            let ray = Ray::new(origin, direction);
            let expected = parts.iter().filter_map(|part| part.hit(&ray)).reduce(f64::min);
            assert_eq!(scene.cast(origin, direction, 30.0), expected);
        }
    }

    #[test]
    fn a_seed_gives_one_scene_and_another_seed_another() {
        let look = |seed: u64| {
            let scene = Scene::furnished(seed);
            let ray = |i: u32| [f64::from(i).cos(), f64::from(i).sin(), 0.0];
            (0..100).map(|i| cast(&scene, [4.6, 6.9, 0.5], ray(i))).collect::<Vec<_>>()
        };
        assert_eq!(look(1), look(1));
        assert_ne!(look(1), look(2));
    }

    #[test]
    fn every_seed_finds_a_place_for_nearly_all_furniture() {
        for seed in 0..30 {
            let pieces = furnish::furniture(seed).len();
            assert!(pieces >= 45, "{pieces} pieces for seed {seed}");
        }
    }
}
