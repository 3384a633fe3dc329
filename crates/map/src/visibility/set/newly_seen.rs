//! How much of space is newly seen: by a viewpoint, or by the rays of a scan.

use super::viewpoint::Viewpoint;
use crate::geometry::Pose;
use crate::visibility::directions::norm;
use crate::visibility::directions::{CubeMap, FACES, Projection};

/// Where along a ray it is asked whether it was free before, and where the part of the ray ends that the answer stands
/// for.
const ALONG: [(f32, f32); 6] =
    [(0.15, 0.225), (0.3, 0.375), (0.45, 0.525), (0.6, 0.675), (0.75, 0.825), (0.9, 1.0)];
/// Space up to here counts by its volume, and less the farther away it is: what is before a robot is in its way,
/// meters.
const NEAR_M: f32 = 3.0;
/// Tiles along the side of a face: pixels of 1.9 degrees, of which one ray is looked along before an image is made.
const TILES: usize = 6;

/// Space that is newly seen, pixel by pixel of a cube around the sensor.
///
/// What counts are places that lie together: single pixels at the rims of things see farther now and then by chance.
struct NewlySeen {
    map: CubeMap,
    /// How far each pixel was seen, meters; 0 where it was not.
    seen_m: Vec<f32>,
    /// Bit i: the place `ALONG[i]` of the ray is newly seen.
    is_new: Vec<u8>,
}

/// The volume of space that `viewpoint` sees through and `is_known` says nobody saw through before, cubic meters. Space
/// farther than 3 m from it counts less, by the cube of the distance.
pub fn newly_seen_m3(viewpoint: &Viewpoint, is_known: impl FnMut([f64; 3]) -> bool) -> f64 {
    let image = viewpoint.image();
    let mut newly = NewlySeen::none(image.map());
    for (face, pixel) in image.kept_pixels() {
        if let Some(depth_m) = image.depth_m(face, pixel) {
            let at = newly.at(face, pixel);
            newly.seen_m[at] = depth_m * norm(image.map().direction(face, pixel));
        }
    }
    newly.look(viewpoint.map_from_sensor(), is_known, |place| viewpoint.is_free(place));
    newly.coherent_m3()
}

/// [`newly_seen_m3`] of what a scan would see whose rays ended at `ends` (sensor frame): found in less time than it
/// takes to make its image, and more or less so.
pub fn newly_seen_by_rays_m3(
    map_from_sensor: &Pose,
    ends: impl Iterator<Item = [f32; 3]>,
    is_known: impl FnMut([f64; 3]) -> bool,
) -> f64 {
    let mut newly = NewlySeen::none(CubeMap::new(TILES));
    for end in ends {
        if let Some(Projection { face, pixel, .. }) = newly.map.project(end) {
            let at = newly.at(face, pixel);
            let seen_m = &mut newly.seen_m[at];
            *seen_m = if *seen_m > 0.0 { seen_m.min(norm(end)) } else { norm(end) };
        }
    }
    newly.look(map_from_sensor, is_known, |_| true);
    newly.coherent_m3()
}

impl NewlySeen {
    fn none(map: CubeMap) -> Self {
        let pixels = FACES * map.pixels() * map.pixels();
        Self { map, seen_m: vec![0.0; pixels], is_new: vec![0; pixels] }
    }

    fn at(&self, face: usize, [column, row]: [usize; 2]) -> usize {
        (face * self.map.pixels() + row) * self.map.pixels() + column
    }

    /// Asks of each place whether it is known; those count that the scan itself `sees`.
    fn look(
        &mut self,
        map_from_sensor: &Pose,
        mut is_known: impl FnMut([f64; 3]) -> bool,
        sees: impl Fn([f64; 3]) -> bool,
    ) {
        for (face, pixel) in self.map.all_pixels() {
            let at = self.at(face, pixel);
            let end_m = self.seen_m[at];
            if end_m == 0.0 {
                continue;
            }
            let direction = self.map.direction(face, pixel);
            let scale = end_m / norm(direction);
            for (i, (share, _)) in ALONG.into_iter().enumerate() {
                let offset = nalgebra::Point3::from(direction.map(|c| f64::from(c * scale * share)));
                let place: [f64; 3] = (map_from_sensor * offset).into();
                if !is_known(place) && sees(place) {
                    self.is_new[at] |= 1 << i;
                }
            }
        }
    }

    /// The volume of what is new in squares of two by two pixels, in all of these that were seen and in two of them at
    /// least.
    fn coherent_m3(&self) -> f64 {
        let side = self.map.pixels();
        let mut coherent = vec![0u8; self.is_new.len()];
        for face in 0..FACES {
            for (row, column) in (1..side).flat_map(|row| (1..side).map(move |column| (row, column))) {
                let square = [[column - 1, row - 1], [column, row - 1], [column - 1, row], [column, row]];
                let square = square.map(|pixel| self.at(face, pixel));
                let seen = || square.into_iter().filter(|&at| self.seen_m[at] > 0.0);
                if seen().count() >= 2 {
                    let all = seen().fold(u8::MAX, |all, at| all & self.is_new[at]);
                    seen().for_each(|at| coherent[at] |= all);
                }
            }
        }
        let new = self.map.all_pixels().map(|(face, pixel)| (face, pixel, self.at(face, pixel)));
        let new = new.filter(|&(.., at)| coherent[at] > 0);
        new.map(|(face, pixel, at)| {
            // How large a pixel is, as it is seen from the sensor, steradians.
            let solid = self.map.pitch().powi(2) / norm(self.map.direction(face, pixel)).powi(3);
            f64::from(solid * length_m3(self.seen_m[at], coherent[at]))
        })
        .sum()
    }
}

/// The volume a steradian of those parts of a ray that have their bit in `parts`.
fn length_m3(end_m: f32, parts: u8) -> f32 {
    let mut begin_m = 0.0;
    let mut sum = 0.0;
    for (i, (_, share)) in ALONG.into_iter().enumerate() {
        let part_end_m = share * end_m;
        if parts >> i & 1 == 1 {
            sum += up_to_m3(part_end_m) - up_to_m3(begin_m);
        }
        begin_m = part_end_m;
    }
    sum
}

/// The volume a steradian up to a distance, where what is farther than [`NEAR_M`] counts less by the cube of its
/// distance.
fn up_to_m3(range_m: f32) -> f32 {
    let near = NEAR_M.powi(3);
    if range_m <= NEAR_M { range_m.powi(3) / 3.0 } else { near / 3.0 + near * (range_m / NEAR_M).ln() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays of a degree to a wall across the x axis, 10 m away, where `keeps` says so of their angles.
    fn wall(keeps: impl Fn(i32, i32) -> bool) -> impl Iterator<Item = [f32; 3]> {
        let angles = (-40..=40).flat_map(|side| (-40..=40).map(move |up| (side, up)));
        angles.filter(move |&(side, up)| keeps(side, up)).map(|(side, up)| {
            let along = |degrees: i32| 10.0 * (degrees as f32).to_radians().tan();
            [10.0, along(side), along(up)]
        })
    }

    /// Nothing behind a disc is known that covers so many degrees, nor in it.
    fn is_known(half_deg: f64) -> impl Fn([f64; 3]) -> bool {
        move |[x, y, z]| x < 2.0 || y.hypot(z).atan2(x).to_degrees() > half_deg
    }

    #[test]
    fn what_was_hidden_counts_by_its_volume_near_the_sensor() {
        let seen = |half_deg| newly_seen_by_rays_m3(&Pose::identity(), wall(|_, _| true), is_known(half_deg));
        let solid = |half_deg: f64| std::f64::consts::TAU * (1.0 - half_deg.to_radians().cos());
        for half_deg in [6.0, 12.0, 24.0] {
            let per_steradian = f64::from(up_to_m3(10.2) - up_to_m3(2.0));
            let share = seen(half_deg) / solid(half_deg) / per_steradian;
            assert!((0.6..1.25).contains(&share), "{half_deg} degrees: {share}");
        }
        assert_eq!(seen(0.0), 0.0);
    }

    #[test]
    fn rows_of_single_pixels_do_not_count() {
        let known = |[x, y, _]: [f64; 3]| x < 2.0 || !(0.0..1.9).contains(&y.atan2(x).to_degrees());
        assert_eq!(newly_seen_by_rays_m3(&Pose::identity(), wall(|_, _| true), known), 0.0);
        let few = newly_seen_by_rays_m3(&Pose::identity(), wall(|_, up| up % 4 == 0), is_known(12.0));
        assert!(few > 0.0, "rings farther apart than pixels");
    }
}
