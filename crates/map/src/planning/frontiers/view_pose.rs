//! From where a frontier can be seen.

use super::frontier::FrontierView;
use crate::geometry::Pose;
use crate::map::{MapView, ShapeRay};
use crate::planning::rays::clear_m;
use crate::planning::unknown::FreeSpace;

/// Directions that are tried for a frontier.
const DIRECTIONS: usize = 96;

/// Looks for places from which a line to a target runs through free voxels alone.
pub(super) struct Lookout<'a> {
    view: &'a MapView<'a>,
    level: u32,
    standoff_m: f64,
}

/// A place that would do.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    /// From the target to the place, a unit vector.
    direction: [f64; 3],
    distance_m: f64,
    /// How much the look goes toward what is unknown: the cosine.
    facing: f64,
}

impl<'a> Lookout<'a> {
    pub(super) fn new(view: &'a MapView<'a>, level: u32, standoff_m: f64) -> Self {
        Self { view, level, standoff_m }
    }

    /// The best place for a look at `target_m`, the center of a free voxel, beside which what is unknown lies
    /// `outward`.
    ///
    /// Of places as far away as is asked for, the one that looks most toward what is unknown; without one, the one that
    /// is furthest away.
    pub(super) fn find(&self, target_m: [f64; 3], outward: [f64; 3]) -> Option<FrontierView> {
        let length = norm(outward);
        let outward = outward.map(|c| if length > 0.0 { c / length } else { 0.0 });
        let candidates = self.candidates(target_m, outward);
        let better = |a: &Candidate, b: &Candidate| {
            a.distance_m.total_cmp(&b.distance_m).then(a.facing.total_cmp(&b.facing))
        };
        // Of several as good the first.
        let best = candidates.into_iter().rev().max_by(better)?;
        Some(best.view(target_m))
    }

    fn candidates(&self, target_m: [f64; 3], outward: [f64; 3]) -> Vec<Candidate> {
        let voxel_m = self.view.lattice().resolution_m(self.level);
        let mut free_space = FreeSpace::of(self.view);
        let candidate = |direction: [f64; 3]| {
            // Half of what is clear: no nearer to what ends the line than to the target.
            let line = ShapeRay { origin_m: target_m, direction };
            let clear_m = clear_m(self.view, self.level, &mut free_space, &line, 2.0 * self.standoff_m);
            let distance_m = (clear_m / 2.0).min(self.standoff_m);
            let facing = -(0..3).map(|axis| direction[axis] * outward[axis]).sum::<f64>();
            (clear_m > voxel_m).then_some(Candidate { direction, distance_m, facing })
        };
        directions().filter_map(candidate).collect()
    }
}

impl Candidate {
    fn view(&self, target_m: [f64; 3]) -> FrontierView {
        let place_m: [f64; 3] =
            std::array::from_fn(|axis| target_m[axis] + self.direction[axis] * self.distance_m);
        let [x, y, z] = self.direction.map(|c| -c);
        let (yaw_rad, elevation_rad) = (y.atan2(x), z.clamp(-1.0, 1.0).asin());
        let rotation = nalgebra::UnitQuaternion::from_euler_angles(0.0, -elevation_rad, yaw_rad);
        let map_from_view = Pose::from_parts(place_m.into(), rotation);
        FrontierView { map_from_view, target_m, yaw_rad, elevation_rad }
    }
}

fn norm(vector: [f64; 3]) -> f64 {
    vector.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Directions that are spread evenly: points on a sphere along a spiral, each turned by the golden angle from the one
/// before.
fn directions() -> impl Iterator<Item = [f64; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..DIRECTIONS).map(move |n| {
        let z = 1.0 - 2.0 * (n as f64 + 0.5) / DIRECTIONS as f64;
        let (sin, cos) = (golden * n as f64).sin_cos();
        let across = (1.0 - z * z).sqrt();
        [across * cos, across * sin, z]
    })
}
