//! Gaps between the rays of a scan: how wide they are where.

use crate::visibility::directions::{CubeMap, FACES, Projection};
use crate::visibility::thresholds::Thresholds;

/// The gaps between the rays of a scan.
pub(super) struct RayGaps<'a> {
    /// Whose pixels tell of gaps: of two of them and more.
    pub(super) map: CubeMap,
    /// How far from each other rays run as a rule, as the side of a square at depth 1.
    pub(super) spacing: f32,
    /// Gaps that are no wider are not told, radians.
    pub(super) least: f32,
    /// Where rays ended: offsets from the sensor.
    pub(super) offsets: &'a [[f32; 3]],
    pub(super) thresholds: &'a Thresholds,
}

/// Where a ray ran on its face.
struct Ran {
    pixel: [usize; 2],
    /// Along each side, see [`CubeMap::on_plane`].
    place: [f32; 2],
}

/// Where the rays in a pixel ran on its face: the smallest and the largest coordinate, to the right and up.
type Bounds = [[f32; 2]; 2];

impl RayGaps<'_> {
    /// Calls `f` for the pixels between rays in which none ran, with the direction of the pixel's middle and how wide
    /// the gap is in which it lies, radians.
    pub(super) fn for_each(&self, mut f: impl FnMut([f32; 3], f32)) {
        let mut of_faces: [Vec<Ran>; FACES] = Default::default();
        for &offset in self.offsets {
            let Some(Projection { face, pixel, .. }) = self.map.project(offset) else { continue };
            of_faces[face].push(Ran { pixel, place: self.map.on_plane(face, offset) });
        }
        // Face by face: the pixels of all of them would take some memory.
        of_faces.iter().enumerate().for_each(|(face, ran)| self.for_each_on(face, ran, &mut f));
    }

    fn for_each_on(&self, face: usize, ran: &[Ran], f: &mut impl FnMut([f32; 3], f32)) {
        if ran.is_empty() {
            return;
        }
        let side = self.map.pixels();
        let (mut numbers, mut bounds) = (vec![0u32; side * side], Vec::<Bounds>::new());
        for &Ran { pixel: [column, row], place: [u, v] } in ran {
            let number = &mut numbers[row * side + column];
            if *number == 0 {
                bounds.push([[u, u], [v, v]]);
                *number = bounds.len() as u32;
            }
            let [of_u, of_v] = &mut bounds[*number as usize - 1];
            *of_u = [of_u[0].min(u), of_u[1].max(u)];
            *of_v = [of_v[0].min(v), of_v[1].max(v)];
        }
        let bounds_at = |at: usize| (numbers[at] > 0).then(|| bounds[numbers[at] as usize - 1]);
        // To the side and up; 0 where a ray ran, infinite where none ran on a side.
        let gap = |&number: &u32| if number > 0 { [0.0; 2] } else { [f32::INFINITY; 2] };
        let mut gaps: Vec<[f32; 2]> = numbers.iter().map(gap).collect();
        for i in 0..side {
            measure(&mut gaps, 0, (0..side).map(|column| i * side + column), bounds_at);
            measure(&mut gaps, 1, (0..side).map(|row| row * side + i), bounds_at);
        }
        for at in (0..side * side).filter(|&at| gaps[at][0] > 0.0) {
            let pixel = [at % side, at / side];
            if let Some(gap) = self.width(&gaps, pixel) {
                f(self.map.direction(face, pixel), gap);
            }
        }
    }

    /// How wide the gap is in which a pixel lies, radians; none of one at the edge of what was seen, without rays on
    /// both sides, and of a gap that is not told.
    fn width(&self, gaps: &[[f32; 2]], pixel: [usize; 2]) -> Option<f32> {
        let side = self.map.pixels();
        let at = pixel[1] * side + pixel[0];
        // Rows between those of the sensor's own rays have none: their neighbors tell.
        let narrowest = |axis: usize, place: usize, step: usize| {
            let before = (place > 0).then(|| gaps[at - step][axis]);
            let behind = (place + 1 < side).then(|| gaps[at + step][axis]);
            before.into_iter().chain(behind).filter(|gap| *gap > 0.0).fold(gaps[at][axis], f32::min)
        };
        let [to_side, up] = [narrowest(0, pixel[1], side), narrowest(1, pixel[0], 1)];
        // No angle is larger than its length on the face.
        if to_side.min(up) <= self.least || to_side.min(up).is_infinite() {
            return None;
        }
        let to_side = to_side * self.map.angle_of_step(pixel, [1, 0]);
        let up = up * self.map.angle_of_step(pixel, [0, 1]);
        let (width, length) = (to_side.min(up), to_side.max(up));
        let Thresholds { lost_width_max, lost_length_max, lost_weight, .. } = self.thresholds;
        let is_of_lost_rays =
            width <= lost_width_max * self.spacing && length <= lost_length_max * self.spacing;
        let counts = if is_of_lost_rays { lost_weight * width } else { width };
        (counts > self.least).then_some(counts)
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
        let gaps = RayGaps {
            map: CubeMap::new(32),
            spacing: 0.5f32.to_radians(),
            least: 0.0,
            offsets: rays,
            thresholds: &Thresholds::DEFAULT,
        };
        let mut widest = 0f32;
        gaps.for_each(|[x, y, z], gap| {
            if x > 0.0 && y.abs() < within && z.abs() < within {
                widest = widest.max(gap);
            }
        });
        widest.to_degrees()
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
