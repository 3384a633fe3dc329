//! The rays of a scan by where they ran.

use crate::visibility::directions::{CubeMap, FACES, Projection};
use crate::visibility::directions::{across, dot, norm};
use crate::visibility::thresholds::Thresholds;

/// Columns, and rows, of parts of a pixel, of each of which one ray is kept: more would tell little, and a scan may
/// send all it has in one direction.
const PARTS: usize = 8;
/// Where rays are looked for around a place, for a near ray that is 1 away.
const AROUND: [[f32; 2]; 16] = [
    [-0.5, 0.0],
    [0.5, 0.0],
    [0.0, -0.5],
    [0.0, 0.5],
    [-0.35, -0.35],
    [0.35, -0.35],
    [-0.35, 0.35],
    [0.35, 0.35],
    [-1.0, 0.0],
    [1.0, 0.0],
    [0.0, -1.0],
    [0.0, 1.0],
    [-0.7, -0.7],
    [0.7, -0.7],
    [-0.7, 0.7],
    [0.7, 0.7],
];

/// The rays of a scan, by the pixel of a cube map in which they ran.
#[derive(Debug, Clone)]
pub(super) struct RayIndex {
    map: CubeMap,
    /// For each pixel, face by face and row by row, where its rays begin; and where the last one's end.
    begins: Vec<u32>,
    /// Where rays ended, pixel by pixel: offsets from the sensor, meters.
    ends: Vec<[f32; 3]>,
}

/// What rays may have run past: offset of its middle from the sensor, and radius, meters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) offset: [f32; 3],
    pub(super) radius_m: f32,
}

/// A rectangle around a place, across its direction from the sensor, through which rays may have run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayWindow {
    /// The place, from the sensor, in its frame, meters.
    pub offset: [f32; 3],
    /// Rays count that ended so far beyond it, meters.
    pub radius_m: f32,
    /// Axes of the rectangle, at right angles to the direction and to each other, of length 1.
    pub across: [[f32; 3]; 2],
    /// Half of its sides along them, meters.
    pub half_m: [f32; 2],
}

impl RayIndex {
    /// The index of rays that ended at `offsets` from the sensor.
    pub(super) fn of(map: CubeMap, offsets: &[[f32; 3]]) -> Self {
        let parts = CubeMap::new(map.tiles() * PARTS);
        // The pixel of a ray, and which of its parts it ran in.
        let place = |offset: [f32; 3]| {
            let Projection { face, pixel, depth_m } = parts.project(offset)?;
            let part = pixel[1] % PARTS * PARTS + pixel[0] % PARTS;
            let pixel = pixel_number(map, Projection { face, pixel: pixel.map(|i| i / PARTS), depth_m });
            Some((pixel, 1u64 << part))
        };
        let mut taken = vec![0u64; FACES * map.pixels() * map.pixels()];
        offsets.iter().filter_map(|&offset| place(offset)).for_each(|(pixel, part)| taken[pixel] |= part);
        let mut begins = vec![0u32];
        begins.extend(taken.iter().scan(0, |end, parts| {
            *end += parts.count_ones();
            Some(*end)
        }));
        let mut ends = vec![[0.0; 3]; begins[begins.len() - 1] as usize];
        for &offset in offsets {
            let Some((pixel, part)) = place(offset).filter(|&(pixel, part)| taken[pixel] & part != 0) else {
                continue;
            };
            // Those that are left say where the next one goes.
            taken[pixel] ^= part;
            ends[(begins[pixel] + taken[pixel].count_ones()) as usize] = offset;
        }
        Self { map, begins, ends }
    }

    /// True where rays ran past a ball everywhere, as it is seen from the sensor, and ended beyond it: no place of its
    /// disc lies farther than `near_m` from such a ray, but for a few beside each other, since rays are lost here and
    /// there. So what is wider than twice that, and in the ball, was met by one.
    pub(super) fn pass(&self, ball: Ball, near_m: f32, thresholds: &Thresholds) -> bool {
        let view = View { ball, distance_m: norm(ball.offset), across: across(ball.offset), near_m };
        let step_m = thresholds.ray_place_step * near_m;
        let steps = (ball.radius_m / step_m).ceil() as i32;
        let along = || (-steps..=steps).map(|i| i as f32 * step_m);
        let disc = along().flat_map(|a| along().map(move |b| [a, b]));
        let places = disc.filter(|[a, b]| a * a + b * b <= ball.radius_m * ball.radius_m);
        // As soon as there is one too many nothing more is looked at.
        let missed_max = thresholds.ray_places_missed_max as usize;
        places.filter(|&place| !self.runs_near(place, &view)).nth(missed_max).is_none()
    }

    /// How far from each other rays ran at most along the first axis of a window, wherever along the second, meters; no
    /// more than twice the window is told. What is as long as the window and thicker than that was met by one.
    pub(super) fn widest_gap_m(&self, window: RayWindow) -> f32 {
        let RayWindow { offset, radius_m, across, half_m: [half_m, long_m] } = window;
        let view = View { ball: Ball { offset, radius_m }, distance_m: norm(offset), across, near_m: 0.0 };
        let (wide_m, step_m) = (2.0 * half_m, 0.5 * view.distance_m * self.map.pitch());
        let along = |most_m: f32| {
            let steps = (most_m / step_m).ceil() as i32;
            (-steps..=steps).map(move |i| i as f32 * step_m)
        };
        let places = along(wide_m).flat_map(|a| along(long_m).map(move |b| [a, b]));
        let mut pixels: Vec<usize> = places
            .filter_map(|place| Some(pixel_number(self.map, self.map.project(view.point(place))?)))
            .collect();
        pixels.sort_unstable();
        pixels.dedup();
        let ends = pixels
            .into_iter()
            .flat_map(|pixel| &self.ends[self.begins[pixel] as usize..self.begins[pixel + 1] as usize]);
        let ran = ends.filter_map(|&end| view.place_of(end));
        let mut ran: Vec<f32> =
            ran.filter(|[a, b]| a.abs() <= wide_m && b.abs() <= long_m).map(|[a, _]| a).collect();
        ran.push(wide_m);
        ran.sort_unstable_by(f32::total_cmp);
        let mut before_m = -wide_m;
        ran.into_iter().fold(0.0, |widest_m: f32, a| {
            let from_m = std::mem::replace(&mut before_m, a);
            if a <= -half_m || from_m >= half_m { widest_m } else { widest_m.max(a - from_m) }
        })
    }

    /// True where a ray that ended beyond the ball ran near to a place of its disc.
    fn runs_near(&self, place: [f32; 2], view: &View) -> bool {
        // The nearest rays are mostly in the pixel of the place, or else in those around it.
        let in_pixel_at = |around: [f32; 2]| {
            let [a, b] = [0, 1].map(|axis| place[axis] + around[axis] * view.near_m);
            let pixel = self.map.project(view.point([a, b])).map(|seen| pixel_number(self.map, seen));
            let rays = pixel.map_or(&[][..], |pixel| {
                &self.ends[self.begins[pixel] as usize..self.begins[pixel + 1] as usize]
            });
            rays.iter().any(|&end| view.runs_near(end, place))
        };
        in_pixel_at([0.0, 0.0]) || AROUND.iter().any(|&around| in_pixel_at(around))
    }
}

/// A ball as it is seen from the sensor.
struct View {
    ball: Ball,
    distance_m: f32,
    /// To the right and up from it.
    across: [[f32; 3]; 2],
    near_m: f32,
}

impl View {
    /// The place of the plane through the ball's middle that lies so far to the right and up.
    fn point(&self, [a, b]: [f32; 2]) -> [f32; 3] {
        let [right, up] = self.across;
        std::array::from_fn(|axis| self.ball.offset[axis] + right[axis] * a + up[axis] * b)
    }

    /// Where the ray with this end ran through that plane, if it ended beyond the ball.
    #[inline(always)]
    fn place_of(&self, end: [f32; 3]) -> Option<[f32; 2]> {
        let along = dot(end, self.ball.offset) / self.distance_m;
        let beyond_m = self.distance_m + self.ball.radius_m;
        let scale = self.distance_m / along;
        (along > 0.0 && dot(end, end) > beyond_m * beyond_m)
            .then(|| [0, 1].map(|axis| dot(end, self.across[axis]) * scale))
    }

    /// True where the ray with this end ran near to a place of that plane, and ended beyond the ball.
    fn runs_near(&self, end: [f32; 3], place: [f32; 2]) -> bool {
        self.place_of(end).is_some_and(|ran| {
            let [a, b] = [0, 1].map(|axis| ran[axis] - place[axis]);
            a * a + b * b <= self.near_m * self.near_m
        })
    }
}

fn pixel_number(map: CubeMap, Projection { face, pixel: [column, row], .. }: Projection) -> usize {
    (face * map.pixels() + row) * map.pixels() + column
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays to a wall 10 m away, `step_m` from each other there.
    fn wall(step_m: f32) -> Vec<[f32; 3]> {
        let steps = (2.0 / step_m) as i32;
        let places = (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |j| [i, j]));
        places.map(|place| [10.0, place[0] as f32 * step_m, place[1] as f32 * step_m]).collect()
    }

    #[test]
    fn rays_pass_a_ball_where_they_are_near_to_each_other_and_end_beyond_it() {
        let map = CubeMap::new(20);
        let index = RayIndex::of(map, &wall(0.1));
        let at = |x: f32, y: f32| Ball { offset: [x, y, 0.03], radius_m: 0.05 };
        // At 5 m they are 5 cm apart, and no place lies farther than 3.6 cm from one.
        assert!(
            index.pass(at(5.0, 0.2), 0.036, &Thresholds::DEFAULT)
                && !index.pass(at(5.0, 0.2), 0.02, &Thresholds::DEFAULT)
        );
        assert!(!index.pass(at(5.0, 1.5), 0.036, &Thresholds::DEFAULT), "beside all rays");
        assert!(!index.pass(at(9.98, 0.2), 0.1, &Thresholds::DEFAULT), "they end in it");
        let holed: Vec<_> =
            wall(0.1).into_iter().filter(|end| end[1].abs() > 0.2 || end[2].abs() > 0.2).collect();
        let index = RayIndex::of(map, &holed);
        assert!(
            index.pass(at(5.0, 0.3), 0.04, &Thresholds::DEFAULT)
                && !index.pass(at(5.0, 0.0), 0.04, &Thresholds::DEFAULT)
        );
    }

    #[test]
    fn of_many_rays_in_one_direction_one_is_kept_and_of_a_dense_scan_some_everywhere() {
        let crowd = (0..100_000).map(|i| [10.0, 0.3 + i as f32 * 1e-7, 0.3]);
        let rays: Vec<_> = wall(0.1).into_iter().chain(crowd).collect();
        let index = RayIndex::of(CubeMap::new(20), &rays);
        assert!(index.ends.len() <= wall(0.1).len() + 2 * PARTS);
        assert!(index.pass(Ball { offset: [5.0, 0.5, 0.03], radius_m: 0.05 }, 0.036, &Thresholds::DEFAULT));
        let fine = RayIndex::of(CubeMap::new(8), &wall(0.01));
        assert!(fine.ends.len() < wall(0.01).len() / 2);
        assert!(
            fine.pass(Ball { offset: [5.0, 0.5, 0.03], radius_m: 0.05 }, 0.036, &Thresholds::DEFAULT),
            "some are enough"
        );
    }
}
