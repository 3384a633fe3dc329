//! The rays of a scan by where they ran.

use super::cube_map::{CubeMap, FACES, Projection};
use super::vectors::{across, dot, norm};

/// Largest share of a ball's disc that no ray ran near to: rays are lost here and there.
const GAPS_MAX: f32 = 0.1;
/// Columns, and rows, of parts of a pixel, of each of which one ray is kept: more would tell little, and a scan may send all it has in one
/// direction.
const PARTS: usize = 8;
/// Places of a ball's disc at which is looked, along its radius.
const PLACES: i32 = 4;

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

impl RayIndex {
    /// The index of rays that ended at `offsets` from the sensor.
    pub(super) fn of(map: CubeMap, offsets: &[[f32; 3]]) -> Self {
        let parts = CubeMap::new(map.tiles() * PARTS);
        // The pixel of a ray, and which of its parts it ran in.
        let place = |offset: [f32; 3]| {
            let Projection { face, pixel, depth_m } = parts.project(offset)?;
            let part = pixel[1] % PARTS * PARTS + pixel[0] % PARTS;
            let pixel = place(map.pixels(), Projection { face, pixel: pixel.map(|i| i / PARTS), depth_m });
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

    /// True where rays ran past a ball everywhere, as it is seen from the sensor, and ended beyond it: no place of its disc, but for one
    /// in ten, lies farther than `near_m` from such a ray. So what is wider than twice that, and in the ball, was met by one.
    pub(super) fn pass(&self, ball: Ball, near_m: f32) -> bool {
        let Ball { radius_m, .. } = ball;
        let rays = self.rays_past(ball, radius_m + near_m, near_m);
        let is_near = |[a, b]: [f32; 2]| {
            rays.iter().any(|ray| (ray[0] - a).powi(2) + (ray[1] - b).powi(2) <= near_m * near_m)
        };
        let along = || -PLACES..=PLACES;
        let disc = along().flat_map(|i| along().map(move |j| [i, j]));
        let places = disc.filter(|[i, j]| i * i + j * j <= PLACES * PLACES);
        let (mut looks, mut gaps) = (0, 0);
        for place in places {
            looks += 1;
            gaps += usize::from(!is_near(place.map(|i| i as f32 / PLACES as f32 * radius_m)));
        }
        gaps as f32 <= GAPS_MAX * looks as f32
    }

    /// Where rays crossed the plane through a ball's middle, at right angles to the way there, and ended beyond the ball: those in pixels
    /// within `window_m` of the middle.
    fn rays_past(&self, Ball { offset, radius_m }: Ball, window_m: f32, near_m: f32) -> Vec<[f32; 2]> {
        let distance_m = norm(offset);
        let [right, up] = across(offset);
        // A quarter of a pixel, in the middle of a face, is less than one at its corners. Where pixels are small some of them will do.
        let step_m = (0.25 * distance_m * self.map.pitch()).max(near_m / 4.0);
        let steps = (window_m / step_m).ceil() as i32;
        let mut pixels = Vec::new();
        for (i, j) in (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |j| (i, j))) {
            let [a, b] = [i, j].map(|i| i as f32 * step_m);
            let around = std::array::from_fn(|axis| offset[axis] + right[axis] * a + up[axis] * b);
            pixels.extend(self.map.project(around).map(|seen| place(self.map.pixels(), seen)));
        }
        pixels.sort_unstable();
        pixels.dedup();
        let crossing = |end: &[f32; 3]| {
            let along = dot(*end, offset) / distance_m;
            let is_past = along > 0.0 && norm(*end) > distance_m + radius_m;
            let scale = distance_m / along;
            is_past.then(|| [dot(*end, right) * scale, dot(*end, up) * scale])
        };
        let ends = pixels
            .into_iter()
            .flat_map(|pixel| &self.ends[self.begins[pixel] as usize..self.begins[pixel + 1] as usize]);
        ends.filter_map(crossing).collect()
    }
}

fn place(side: usize, Projection { face, pixel: [column, row], .. }: Projection) -> usize {
    (face * side + row) * side + column
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
        assert!(index.pass(at(5.0, 0.2), 0.036) && !index.pass(at(5.0, 0.2), 0.02));
        assert!(!index.pass(at(5.0, 1.5), 0.036), "beside all rays");
        assert!(!index.pass(at(9.98, 0.2), 0.1), "they end in it");
        let holed: Vec<_> =
            wall(0.1).into_iter().filter(|end| end[1].abs() > 0.2 || end[2].abs() > 0.2).collect();
        let index = RayIndex::of(map, &holed);
        assert!(index.pass(at(5.0, 0.3), 0.04) && !index.pass(at(5.0, 0.0), 0.04));
    }

    #[test]
    fn of_many_rays_in_one_direction_one_is_kept_and_of_a_dense_scan_some_everywhere() {
        let crowd = (0..100_000).map(|i| [10.0, 0.3 + i as f32 * 1e-7, 0.3]);
        let rays: Vec<_> = wall(0.1).into_iter().chain(crowd).collect();
        let index = RayIndex::of(CubeMap::new(20), &rays);
        assert!(index.ends.len() <= wall(0.1).len() + 2 * PARTS);
        assert!(index.pass(Ball { offset: [5.0, 0.5, 0.03], radius_m: 0.05 }, 0.036));
        let fine = RayIndex::of(CubeMap::new(8), &wall(0.01));
        assert!(fine.ends.len() < wall(0.01).len() / 2);
        assert!(fine.pass(Ball { offset: [5.0, 0.5, 0.03], radius_m: 0.05 }, 0.036), "some are enough");
    }
}
