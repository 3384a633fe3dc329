//! Density: how far from each other the points of a scan lie, as they are seen from the sensor.

use crate::visibility::directions::{CubeMap, FACES, TILE_SIDE};
use crate::visibility::thresholds::Thresholds;

/// Tiles along the side of a face, finest first: pixels of 0.28 to 5.6 degrees.
const TILES: [usize; 11] = [40, 32, 25, 20, 16, 13, 10, 8, 6, 4, 2];
/// Tiles along the side of a face with which it is found out how fine pixels can be.
const TILES_AT_FIRST: usize = 10;
const _: () = assert!(TILE_SIDE * TILES[0] < 1 << 12, "all pixels have a number");

/// How densely the points of a scan lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::visibility) struct PointDensity {
    /// The finest pixels that leave few gaps of two or more of them between the points: finer ones would be a sieve.
    pub(in crate::visibility) map: CubeMap,
    /// How far from each other the points lie as a rule, in the direction in which that is farther, as the side of a
    /// square at depth 1: one pixel to two.
    pub(in crate::visibility) spacing: f32,
}

impl PointDensity {
    /// The density of points at `offsets` from the sensor; none where none has a direction.
    pub(in crate::visibility) fn of(offsets: &[[f32; 3]], thresholds: &Thresholds) -> Option<Self> {
        Self::no_finer_than(TILES[0], offsets, thresholds)
    }

    /// The same, where pixels are of no use that are finer than those of so many tiles along a face.
    pub(in crate::visibility) fn no_finer_than(
        finest: usize,
        offsets: &[[f32; 3]],
        thresholds: &Thresholds,
    ) -> Option<Self> {
        let at_first = SeenPixels::of(CubeMap::new(TILES_AT_FIRST), offsets);
        if at_first.count == 0 {
            return None;
        }
        let points_a_pixel = offsets.len() as f64 / at_first.count as f64;
        let tiles_max = (TILES_AT_FIRST as f64 * points_a_pixel.sqrt()) as usize;
        let coarsest = TILES[TILES.len() - 1];
        let candidates = TILES.iter().filter(|&&tiles| tiles <= tiles_max.min(finest).max(coarsest));
        let mut seen = candidates.map(|&tiles| SeenPixels::of(CubeMap::new(tiles), offsets));
        seen.find_map(|seen| {
            let Gaps { of_one, wider } = seen.gaps(thresholds.one_surface_max);
            let is_fit = seen.map.tiles() == coarsest || wider <= f64::from(thresholds.sieve_share_max);
            is_fit.then(|| Self { map: seen.map, spacing: spacing(seen.map, of_one) })
        })
    }
}

/// How far from each other the points lie as a rule that leave such a share of gaps of one pixel: rings one and a half
/// pixels apart leave one in every second place.
pub(super) fn spacing(map: CubeMap, gaps_of_one: f64) -> f32 {
    map.pitch() * (1.0 + gaps_of_one as f32)
}

/// Gaps between the pixels in which points lie, as shares of these.
pub(super) struct Gaps {
    /// Beside or above, whichever has more: gaps of one pixel.
    pub(super) of_one: f64,
    /// Gaps of two or more, beside and above.
    pub(super) wider: f64,
}

/// How far pixels with points and the next ones beside them are from each other, or above them where that is farther,
/// radians; 0 where none has a neighbor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbors {
    /// Mean from one to the next: where several points lie in a pixel it is how wide pixels are.
    pub(super) apart: f32,
    /// Mean width of these pixels.
    pub(super) width: f32,
}

/// The pixels in which points lie.
pub(super) struct SeenPixels {
    map: CubeMap,
    is_seen: Vec<bool>,
    count: usize,
}

impl SeenPixels {
    pub(super) fn of(map: CubeMap, offsets: &[[f32; 3]]) -> Self {
        let mut seen = Self { map, is_seen: vec![false; FACES * map.pixels() * map.pixels()], count: 0 };
        for projection in offsets.iter().filter_map(|&offset| map.project(offset)) {
            let [column, row] = projection.pixel;
            let at = (projection.face * map.pixels() + row) * map.pixels() + column;
            seen.count += usize::from(!std::mem::replace(&mut seen.is_seen[at], true));
        }
        seen
    }

    /// Gaps, of which those as wide as `most` or wider are none between points of one surface.
    pub(super) fn gaps(&self, most: f32) -> Gaps {
        // Without a limit it is the largest number.
        let most = (most / self.map.pitch()) as usize;
        let (mut of_one, mut wider) = ([0usize; 2], 0);
        self.for_neighbors(|axis, not_seen, _| {
            of_one[axis] += usize::from(not_seen == 1);
            wider += usize::from((2..most).contains(&not_seen));
        });
        let share = |count: usize| count as f64 / self.count.max(1) as f64;
        Gaps { of_one: share(of_one[0].max(of_one[1])), wider: share(wider) }
    }

    /// How far neighbors are from each other where no more than one pixel is between them.
    pub(super) fn neighbors(&self) -> Neighbors {
        let (mut apart, mut widths, mut counts) = ([0.0; 2], [0.0; 2], [0usize; 2]);
        self.for_neighbors(|axis, not_seen, pixel| {
            if not_seen < 2 {
                let step = if axis == 0 { [1, 0] } else { [0, 1] };
                let width = f64::from(self.map.pitch() * self.map.angle_of_step(pixel, step));
                apart[axis] += width * (not_seen + 1) as f64;
                widths[axis] += width;
                counts[axis] += 1;
            }
        });
        let mean = |sums: [f64; 2], axis: usize| (sums[axis] / counts[axis].max(1) as f64) as f32;
        let farther = usize::from(mean(apart, 1) > mean(apart, 0));
        Neighbors { apart: mean(apart, farther), width: mean(widths, farther) }
    }

    /// Calls `f` for each pixel and the one before it in its row (axis 0), and in its column (axis 1): with how many
    /// between them are not seen, and the pixel.
    fn for_neighbors(&self, mut f: impl FnMut(usize, usize, [usize; 2])) {
        let side = self.map.pixels();
        for face in self.is_seen.chunks(side * side) {
            let mut below: Vec<Option<usize>> = vec![None; side];
            for (row, pixels) in face.chunks(side).enumerate() {
                let mut left: Option<usize> = None;
                for column in (0..side).filter(|&column| pixels[column]) {
                    if let Some(left) = left.replace(column) {
                        f(0, column - left - 1, [column, row]);
                    }
                    if let Some(below) = below[column].replace(row) {
                        f(1, row - below - 1, [column, row]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on `rings` rings of some degrees from each other, a point every tenth of a degree on a quarter of the way
    /// around.
    fn rings(rings: usize, apart_deg: f32) -> Vec<[f32; 3]> {
        let point = |i: usize| {
            let elevation = ((i / 900) as f32 - (rings as f32 - 1.0) / 2.0) * apart_deg;
            let azimuth = (i % 900) as f32 * 0.1 - 45.0;
            let ([sin, cos], [up, level]) = (
                [azimuth.to_radians().sin(), azimuth.to_radians().cos()],
                [elevation.to_radians().sin(), elevation.to_radians().cos()],
            );
            [7.0 * level * cos, 7.0 * level * sin, 7.0 * up]
        };
        (0..rings * 900).map(point).collect()
    }

    #[test]
    fn points_lie_as_far_apart_as_their_rings() {
        for (count, apart_deg) in [(64, 0.4), (32, 1.0), (16, 2.0), (8, 4.0)] {
            let density = PointDensity::of(&rings(count, apart_deg), &Thresholds::DEFAULT).unwrap();
            let spacing_deg = density.spacing.to_degrees();
            assert!(
                (0.9 * apart_deg..1.6 * apart_deg).contains(&spacing_deg),
                "rings of {apart_deg} degrees lie {spacing_deg} apart"
            );
        }
    }

    #[test]
    fn points_sent_several_times_lie_no_closer() {
        let once = rings(16, 2.0);
        let four_times: Vec<_> = (0..4).flat_map(|_| once.iter().copied()).collect();
        assert_eq!(
            PointDensity::of(&once, &Thresholds::DEFAULT),
            PointDensity::of(&four_times, &Thresholds::DEFAULT)
        );
    }

    #[test]
    fn the_sensors_own_place_has_no_density() {
        assert_eq!(PointDensity::of(&[], &Thresholds::DEFAULT), None);
        assert_eq!(PointDensity::of(&[[0.0; 3]], &Thresholds::DEFAULT), None);
    }
}
