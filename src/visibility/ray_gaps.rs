//! Gaps between the rays of a scan: how wide they are where.

use super::cube_map::{CubeMap, FACES, Pixel, Projection};

/// How far from each other rays ran on either side of the pixels in which none did.
pub(super) struct RayGaps {
    map: CubeMap,
    /// Of each pixel, face by face and row by row, as the side of a square at depth 1; 0 where a ray ran, infinite where none ran on a
    /// side.
    gaps: Vec<f32>,
}

/// The pixels beside one.
const BESIDE: [[isize; 2]; 4] = [[-1, 0], [1, 0], [0, -1], [0, 1]];

/// Where the rays in a pixel ran on its face: the smallest and the largest coordinate, to the right and up.
type Bounds = [[f32; 2]; 2];

impl RayGaps {
    /// Those of rays that ended at `offsets` from the sensor, as the pixels of `map` tell them: gaps of two of them and more.
    pub(super) fn of(map: CubeMap, offsets: &[[f32; 3]]) -> Self {
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
        let mut gaps: Vec<f32> = numbers.iter().map(|&n| if n > 0 { 0.0 } else { f32::INFINITY }).collect();
        for face in (0..FACES).map(|face| face * side * side) {
            for i in 0..side {
                narrow(
                    &mut gaps,
                    side,
                    |column| face + i * side + column,
                    |at| bounds_at(at).map(|it| it[0]),
                );
                narrow(&mut gaps, side, |row| face + row * side + i, |at| bounds_at(at).map(|it| it[1]));
            }
        }
        Self { map, gaps }
    }

    /// The pixels in which no ray ran, each as the direction of its middle and the gap in which it lies.
    ///
    /// A ray that was lost leaves a gap twice as high as others in its column alone: gaps are as wide as the narrowest beside them.
    pub(super) fn iter(&self) -> impl Iterator<Item = ([f32; 3], f32)> {
        let pixels = self.map.all_pixels().zip(&self.gaps).filter(|(_, gap)| **gap > 0.0);
        pixels.map(|((face, pixel), &gap): (Pixel, &f32)| {
            let beside = BESIDE.into_iter().filter_map(|steps| self.map.beside((face, pixel), steps));
            let gaps = beside.map(|pixel| self.gap(pixel)).filter(|gap| *gap > 0.0);
            (self.map.direction(face, pixel), gaps.fold(gap, f32::min))
        })
    }

    fn gap(&self, (face, [column, row]): Pixel) -> f32 {
        let side = self.map.pixels();
        self.gaps[(face * side + row) * side + column]
    }
}

/// Takes the gaps along one line of a face for those of its pixels, where they are narrower than what is known.
fn narrow(
    gaps: &mut [f32],
    side: usize,
    place: impl Fn(usize) -> usize,
    bounds: impl Fn(usize) -> Option<[f32; 2]>,
) {
    // A gap at the edge of a face goes on behind it: as far, for all that is known here.
    let (mut from, mut last, mut twice) = (0, -1.0, 2.0);
    let mut close = |pixels: std::ops::Range<usize>, gap: f32| {
        for at in pixels.map(&place) {
            gaps[at] = gaps[at].min(gap);
        }
    };
    for i in 0..side {
        let Some([first, end]) = bounds(place(i)) else { continue };
        close(from..i, twice * (first - last));
        (from, last, twice) = (i + 1, end, 1.0);
    }
    // None of a line without any ray.
    if twice == 1.0 {
        close(from..side, 2.0 * (1.0 - last));
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
        let gaps = RayGaps::of(CubeMap::new(32), rays);
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
