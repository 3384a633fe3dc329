//! The rays of a scan by where they ran.

use super::cube_map::{CubeMap, FACES, Projection};
use super::vectors::{across, dot, norm};

/// Largest share of a ball's disc that no ray ran near to: rays are lost here and there.
const GAPS_MAX: f32 = 0.1;
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
        let side = map.pixels();
        let place = |offset: [f32; 3]| map.project(offset).map(|seen| place(side, seen));
        let mut begins = vec![0u32; FACES * side * side + 1];
        offsets.iter().filter_map(|&offset| place(offset)).for_each(|pixel| begins[pixel + 1] += 1);
        (1..begins.len()).for_each(|i| begins[i] += begins[i - 1]);
        let mut ends = vec![[0.0; 3]; begins[begins.len() - 1] as usize];
        let mut next = begins.clone();
        for &offset in offsets {
            let Some(pixel) = place(offset) else { continue };
            ends[next[pixel] as usize] = offset;
            next[pixel] += 1;
        }
        Self { map, begins, ends }
    }

    /// True where rays ran past a ball everywhere, as it is seen from the sensor, and ended beyond it: no place of its disc, but for one
    /// in ten, lies farther than `reach_m` from such a ray. So what is wider than two reaches, and in the ball, was met by one.
    pub(super) fn pass(&self, ball: Ball, reach_m: f32) -> bool {
        let Ball { radius_m, .. } = ball;
        let rays = self.rays_past(ball, radius_m + reach_m, reach_m);
        let is_near = |[a, b]: [f32; 2]| {
            rays.iter().any(|ray| (ray[0] - a).powi(2) + (ray[1] - b).powi(2) <= reach_m * reach_m)
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
    fn rays_past(&self, Ball { offset, radius_m }: Ball, window_m: f32, reach_m: f32) -> Vec<[f32; 2]> {
        let distance_m = norm(offset);
        let [right, up] = across(offset);
        // A quarter of a pixel, in the middle of a face, is less than one at its corners. Where pixels are small some of them will do.
        let step_m = (0.25 * distance_m * self.map.pitch()).max(reach_m / 4.0);
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
