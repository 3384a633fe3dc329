//! Gaps between the rays of a scan: how wide they are where.

use super::cube_map::{CubeMap, FACES, Pixel, Projection};

/// Holes of a few lost rays are up to so many spacings of the rays wide, and long.
const LOST_WIDTH: f32 = 2.2;
const LOST_LENGTH: f32 = 5.0;
/// How much of their width counts: a ray lost from a square grid leaves a hole two spacings wide, and one in a hundred is.
const LOST_SHARE: f32 = 0.6;

/// How far from each other rays ran on either side of the pixels in which none did.
pub(super) struct RayGaps {
    map: CubeMap,
    /// How far from each other rays run as a rule, as the side of a square at depth 1.
    spacing: f32,
    /// Of each pixel, face by face and row by row, to the side and up, as the side of a square at depth 1; 0 where a ray ran, infinite
    /// where none ran on a side.
    gaps: Vec<[f32; 2]>,
}

/// Where the rays in a pixel ran on its face: the smallest and the largest coordinate, to the right and up.
type Bounds = [[f32; 2]; 2];

impl RayGaps {
    /// Those of rays that ended at `offsets` from the sensor, `spacing` from each other as a rule, as the pixels of `map` tell them: gaps
    /// of two of them and more.
    pub(super) fn of(map: CubeMap, spacing: f32, offsets: &[[f32; 3]]) -> Self {
        let side = map.pixels();
        let mut numbers = vec![0u32; FACES * side * side];
        let mut bounds: Vec<Bounds> = Vec::new();
        for &offset in offsets {
            let Some(Projection { face, pixel: [column, row], .. }) = map.project(offset) else { continue };
            let [u, v] = map.on_plane(face, offset);
            let number = &mut numbers[(face * side + row) * side + column];
            if *number == 0 {
                bounds.push([[u, u], [v, v]]);
                *number = bounds.len() as u32;
            }
            let [of_u, of_v] = &mut bounds[*number as usize - 1];
            *of_u = [of_u[0].min(u), of_u[1].max(u)];
            *of_v = [of_v[0].min(v), of_v[1].max(v)];
        }
        let bounds_at = |at: usize| (numbers[at] > 0).then(|| bounds[numbers[at] as usize - 1]);
        let gap = |&number: &u32| if number > 0 { [0.0; 2] } else { [f32::INFINITY; 2] };
        let mut gaps: Vec<[f32; 2]> = numbers.iter().map(gap).collect();
        for face in (0..FACES).map(|face| face * side * side) {
            for i in 0..side {
                measure(&mut gaps, 0, (0..side).map(|column| face + i * side + column), bounds_at);
                measure(&mut gaps, 1, (0..side).map(|row| face + row * side + i), bounds_at);
            }
        }
        Self { map, spacing, gaps }
    }

    /// The pixels between rays in which none ran, each as the direction of its middle and how wide the gap is in which it lies, radians.
    pub(super) fn iter(&self) -> impl Iterator<Item = ([f32; 3], f32)> {
        let pixels = self.map.all_pixels().zip(&self.gaps).filter(|(_, gap)| gap[0] > 0.0);
        pixels.filter_map(|((face, pixel), &[to_side, up])| {
            // Rows between those of the sensor's own rays have none: their neighbors tell.
            let narrowest = |gap: f32, axis: usize, steps: [[isize; 2]; 2]| {
                let beside = steps.into_iter().filter_map(|steps| self.map.beside((face, pixel), steps));
                beside.map(|pixel| self.gap(pixel)[axis]).filter(|gap| *gap > 0.0).fold(gap, f32::min)
            };
            let angle = |steps| self.map.angle_of_step(pixel, steps);
            let to_side = narrowest(to_side, 0, [[0, -1], [0, 1]]) * angle([1, 0]);
            let up = narrowest(up, 1, [[-1, 0], [1, 0]]) * angle([0, 1]);
            let (width, length) = (to_side.min(up), to_side.max(up));
            let is_of_lost_rays = width <= LOST_WIDTH * self.spacing && length <= LOST_LENGTH * self.spacing;
            let counts = if is_of_lost_rays { LOST_SHARE * width } else { width };
            // What has no rays on both sides is the edge of what was seen.
            width.is_finite().then(|| (self.map.direction(face, pixel), counts))
        })
    }

    fn gap(&self, (face, [column, row]): Pixel) -> [f32; 2] {
        let side = self.map.pixels();
        self.gaps[(face * side + row) * side + column]
    }
}

/// Measures the gaps along one line of a face, to the side or up, from ray to ray.
fn measure(
    gaps: &mut [[f32; 2]],
    axis: usize,
    line: impl Iterator<Item = usize>,
    bounds: impl Fn(usize) -> Option<Bounds>,
) {
    let (mut last, mut between) = (None, Vec::new());
    for at in line {
        let Some(bounds) = bounds(at) else {
            between.push(at);
            continue;
        };
        let [first, end] = bounds[axis];
        if let Some(last) = last.replace(end) {
            between.iter().for_each(|&at| gaps[at][axis] = first - last);
        }
        between.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays every tenth of a degree to each side, and as many tenths up as `rows` says; one degree has ten tenths.
    fn rays(rows: impl Iterator<Item = i32>, is_there: impl Fn(i32, i32) -> bool) -> Vec<[f32; 3]> {
        let ray = |(column, row): (i32, i32)| {
            let [u, v] = [column, row].map(|tenths| (tenths as f32 / 10.0).to_radians().tan());
            [5.0, 5.0 * u, 5.0 * v]
        };
        rows.flat_map(|row| (-200..=200).map(move |column| (column, row)))
            .filter(|&(column, row)| is_there(column, row))
            .map(ray)
            .collect()
    }

    fn widest_deg(rays: &[[f32; 3]], within_deg: f32) -> f32 {
        let within = within_deg.to_radians().tan();
        let gaps = RayGaps::of(CubeMap::new(32), 0.5f32.to_radians(), rays);
        let near = gaps.iter().filter(|([x, y, z], _)| *x > 0.0 && y.abs() < within && z.abs() < within);
        near.map(|(_, gap)| gap).fold(0.0, f32::max).to_degrees()
    }

    #[test]
    fn a_gap_is_as_wide_as_it_is_where_it_is_narrower() {
        let rings = |i: i32| i % 5 == 0;
        let all = rays((-100..=100).filter(|&i| rings(i)), |_, _| true);
        assert!(widest_deg(&all, 5.0) < 0.51, "rings of half a degree: {}", widest_deg(&all, 5.0));
        let dead = rays((-100..=100).filter(|&i| rings(i) && i != 0 && i != 5), |_, _| true);
        assert!((widest_deg(&dead, 5.0) - 1.5).abs() < 0.02, "two dead rings: {}", widest_deg(&dead, 5.0));
        let hole = rays(-100..=100, |column, row| !((-6..=6).contains(&column) && (-20..=20).contains(&row)));
        assert!(
            (widest_deg(&hole, 5.0) - 1.4).abs() < 0.02,
            "a hole 14 tenths wide: {}",
            widest_deg(&hole, 5.0)
        );
    }
}
