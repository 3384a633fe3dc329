//! The surface that a scan shows: its points, and which of them lie on one surface.

use super::ray_index::{Ball, RayIndex, RayWindow};
use crate::visibility::directions::{CubeMap, FACES, Pixel, Projection};
use crate::visibility::directions::{across, between, distance, norm};
use crate::visibility::imaging::{PointDensity, ScanRays, SensorRays};
use crate::visibility::thresholds::Thresholds;

/// How often pixels between two that are seen are filled: for rows or columns between those with points, for where both
/// meet, and for where pixels are smallest, at the corners of the cube.
const FILLINGS: usize = 3;
/// A ray without a return is believed as far as all that was met in so many pixels on each side of its own.
const AGREE: isize = 2;
/// Number of a pixel in which nothing was seen.
const NOT_SEEN: u32 = u32::MAX;

/// How the points of a scan make a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSettings {
    /// Smallest angle between a ray and a surface, radians: two points beside each other that only a surface at a
    /// smaller one would join are the rim of the nearer one.
    pub grazing_rad: f32,
    /// Steps in range that are noise, meters.
    pub noise_m: f32,
    /// Largest distance between two neighboring samples of the surface, meters.
    pub spacing_m: f32,
    /// How the rays lie, where the sensor is known.
    pub sensor: Option<SensorRays>,
    /// What was found by trial.
    pub thresholds: Thresholds,
}

/// The surface that a scan shows, as it is seen from the sensor: on the six faces of a cube around it, the nearest
/// point in each pixel, and which pixels beside each other show one surface.
///
/// Pixels are as fine as the points lie, and no finer, so that a scan is not seen through a sieve: rows of points with
/// rows between them in which there are none are one surface where they are no farther apart than two pixels.
#[derive(Debug, Clone)]
pub struct ScanSurface {
    map: CubeMap,
    settings: SurfaceSettings,
    /// For each pixel, face by face and row by row, the number of its hit.
    places: Vec<u32>,
    hits: Vec<Hit>,
    /// All of the scan's rays, as far as they are believed.
    rays: RayIndex,
}

/// Where a direction was seen to end.
#[derive(Debug, Clone, Copy)]
struct Hit {
    /// From the sensor, in its frame, meters.
    offset: [f32; 3],
    distance_m: f32,
    /// Something beside it lies behind it, or was not seen.
    is_rim: bool,
    /// Between two others, and no point of the scan.
    is_filled: bool,
    /// The ray ran on: there is no surface.
    is_open: bool,
}

impl Hit {
    fn at(offset: [f32; 3]) -> Self {
        Self { offset, distance_m: norm(offset), is_rim: false, is_filled: false, is_open: false }
    }
}

impl ScanSurface {
    /// The surface of a scan with these rays; none of a scan without any.
    pub fn of(rays: ScanRays<'_>, settings: SurfaceSettings) -> Option<Self> {
        let mut offsets: Vec<_> = rays.all().map(|point| point.xyz()).collect();
        let density = match settings.sensor {
            Some(sensor) => Some(sensor.density()).filter(|_| !offsets.is_empty()),
            None => PointDensity::of(&offsets, &settings.thresholds),
        };
        let PointDensity { map, .. } = density?;
        let places = vec![NOT_SEEN; FACES * map.pixels() * map.pixels()];
        let index = RayIndex::of(map, &[]);
        let mut surface = Self { map, settings, places, hits: Vec::new(), rays: index };
        let (returned, no_returns) = offsets.split_at_mut(rays.met.len() + rays.beyond.len());
        surface.see_nearest(&returned[..rays.met.len()], false);
        surface.see_nearest(&returned[rays.met.len()..], true);
        // All of them are cut before one is seen: they do not vouch for each other's ends.
        no_returns.iter_mut().for_each(|end| *end = surface.cut_to_what_agrees(*end));
        surface.see_nearest(no_returns, true);
        surface.rays = RayIndex::of(map, &offsets);
        (0..FILLINGS).for_each(|_| surface.fill());
        surface.find_rims();
        Some(surface)
    }

    /// Sees the nearest in each pixel.
    fn see_nearest(&mut self, offsets: &[[f32; 3]], is_open: bool) {
        for &offset in offsets {
            let Some(Projection { face, pixel, .. }) = self.map.project(offset) else { continue };
            let hit = Hit { is_open, ..Hit::at(offset) };
            let place = self.place((face, pixel));
            match self.hits.get_mut(self.places[place] as usize) {
                Some(nearest) if nearest.distance_m <= hit.distance_m => {}
                Some(nearest) => *nearest = hit,
                None => self.put(place, hit),
            }
        }
    }

    /// The end of a ray without a return, no farther away than what other rays met around it.
    fn cut_to_what_agrees(&self, end: [f32; 3]) -> [f32; 3] {
        let Some(Projection { face, pixel, .. }) = self.map.project(end) else { return end };
        let around = (-AGREE..=AGREE).flat_map(|up| (-AGREE..=AGREE).map(move |right| [right, up]));
        let hits = around.filter_map(|steps| self.hit(self.map.beside((face, pixel), steps)?));
        let nearest_m = hits.map(|hit| hit.distance_m).fold(f32::INFINITY, f32::min);
        let share = (nearest_m / norm(end)).min(1.0);
        end.map(|c| c * share)
    }

    fn put(&mut self, place: usize, hit: Hit) {
        self.places[place] = self.hits.len() as u32;
        self.hits.push(hit);
    }

    /// Sees in a pixel between two that show one surface, beside or above each other, what lies halfway between them.
    fn fill(&mut self) {
        let between = |a: Option<&Hit>, b: Option<&Hit>| {
            let (a, b) = (a?, b?);
            let halfway = std::array::from_fn(|axis| (a.offset[axis] + b.offset[axis]) / 2.0);
            let filled = Hit { is_filled: true, is_open: a.is_open || b.is_open, ..Hit::at(halfway) };
            self.are_joined(a, b).then_some(filled)
        };
        let halfway = |pixel: Pixel| {
            let at = |steps| self.hit(self.map.beside(pixel, steps)?);
            let beside = between(at([-1, 0]), at([1, 0]));
            let above = between(at([0, -1]), at([0, 1]));
            beside.into_iter().chain(above).min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
        };
        let unseen = self.map.all_pixels().filter(|&pixel| self.hit(pixel).is_none());
        let filled: Vec<(usize, Hit)> =
            unseen.filter_map(|pixel| Some((self.place(pixel), halfway(pixel)?))).collect();
        filled.into_iter().for_each(|(place, hit)| self.put(place, hit));
    }

    fn find_rims(&mut self) {
        let is_rim = |pixel: Pixel, hit: &Hit| {
            AROUND.iter().any(|&steps| {
                let beside = self.map.beside(pixel, steps).and_then(|pixel| self.hit(pixel));
                beside
                    .is_none_or(|beside| beside.distance_m > hit.distance_m && !self.are_joined(hit, beside))
            })
        };
        let rims: Vec<usize> = self
            .map
            .all_pixels()
            .filter(|&pixel| self.hit(pixel).is_some_and(|hit| is_rim(pixel, hit)))
            .map(|pixel| self.places[self.place(pixel)] as usize)
            .collect();
        rims.into_iter().for_each(|i| self.hits[i].is_rim = true);
    }

    /// True where two points beside each other can lie on one surface that is not seen at a smaller angle than the
    /// grazing one.
    fn are_joined(&self, a: &Hit, b: &Hit) -> bool {
        let (near, far) = if a.distance_m <= b.distance_m { (a, b) } else { (b, a) };
        let scale = near.distance_m / far.distance_m;
        let beside_near = far.offset.map(|c| c * scale);
        let across_m = distance(near.offset, beside_near);
        let SurfaceSettings { grazing_rad, noise_m, spacing_m, thresholds, .. } = self.settings;
        far.distance_m - near.distance_m <= across_m / grazing_rad.tan() + noise_m
            && distance(near.offset, far.offset) <= thresholds.patch_max * spacing_m
    }

    /// The ends of the directions that were seen, or where they are `range_m` from the sensor if that is nearer:
    /// offsets in the sensor frame, meters.
    pub fn seen(&self, range_m: f32) -> impl Iterator<Item = [f32; 3]> {
        self.hits.iter().map(move |hit| {
            let share = (range_m / hit.distance_m).min(1.0);
            hit.offset.map(|c| c * share)
        })
    }

    /// Calls `f` with samples of the surface (sensor frame, meters) within `range_m`, of which two beside each other
    /// are no farther apart than the settings say, but for the points of the scan itself.
    pub fn for_samples(&self, range_m: f32, mut f: impl FnMut([f32; 3])) {
        for pixel in self.map.all_pixels() {
            let is_surface = |hit: &&Hit| !hit.is_open && hit.distance_m <= range_m;
            let Some(hit) = self.hit(pixel).filter(is_surface) else { continue };
            if hit.is_filled {
                f(hit.offset);
            }
            let beside = |steps| {
                let beside = self.map.beside(pixel, steps).and_then(|pixel| self.hit(pixel))?;
                (!beside.is_open && self.are_joined(hit, beside)).then_some(beside)
            };
            let (right, up) = (beside([1, 0]), beside([0, 1]));
            let across = beside([1, 1]).zip(right).zip(up).filter(|((across, right), up)| {
                self.are_joined(right, across) && self.are_joined(up, across)
            });
            match (across, right, up) {
                (Some(((across, right), up)), ..) => {
                    self.for_samples_of_patch([hit, right, up, across], &mut f)
                }
                (None, right, up) => {
                    for other in right.into_iter().chain(up) {
                        self.for_samples_of_edge(hit, other, &mut f);
                    }
                }
            }
        }
    }

    fn for_samples_of_edge(&self, a: &Hit, b: &Hit, f: &mut impl FnMut([f32; 3])) {
        let steps = self.steps(distance(a.offset, b.offset));
        (1..steps).for_each(|i| f(between(a.offset, b.offset, i as f32 / steps as f32)));
    }

    fn for_samples_of_patch(&self, [a, right, up, across]: [&Hit; 4], f: &mut impl FnMut([f32; 3])) {
        let sides = |a: &Hit, b: &Hit, c: &Hit, d: &Hit| {
            self.steps(distance(a.offset, b.offset).max(distance(c.offset, d.offset)))
        };
        let (columns, rows) = (sides(a, right, up, across), sides(a, up, right, across));
        for row in 0..rows {
            let along = row as f32 / rows as f32;
            let from = between(a.offset, up.offset, along);
            let to = between(right.offset, across.offset, along);
            let first = usize::from(row == 0);
            (first..columns).for_each(|column| f(between(from, to, column as f32 / columns as f32)));
        }
    }

    /// Parts of a way of so many meters, none of them longer than two samples are apart.
    fn steps(&self, meters: f32) -> usize {
        (meters / self.settings.spacing_m).ceil().max(1.0) as usize
    }

    /// True where the direction of `offset` (sensor frame) was seen to end more than `margin_m` beyond it.
    #[inline]
    pub fn depth_exceeds(&self, offset: [f32; 3], margin_m: f32) -> bool {
        let seen = self.map.project(offset).and_then(|seen| self.hit((seen.face, seen.pixel)));
        seen.is_some_and(|hit| hit.distance_m > norm(offset) + margin_m)
    }

    /// True where the scan saw through a ball of `radius_m` around `offset` (sensor frame): each direction in which the
    /// ball lies ends beyond it, and no direction within a pixel of these is unseen, or ends before that at a rim.
    ///
    /// Nothing is seen through where rays ran farther from each other than `gap_max_m`: what is larger than that was
    /// met by one.
    pub fn sees_through(&self, offset: [f32; 3], radius_m: f32, gap_max_m: f32) -> bool {
        let Some(Projection { depth_m, .. }) = self.map.project(offset) else { return false };
        let (distance_m, pixel_m) = (norm(offset), depth_m * self.map.pitch());
        let thresholds = &self.settings.thresholds;
        if distance_m <= thresholds.ball_distance_min * radius_m {
            return false;
        }
        let window_m = radius_m + pixel_m;
        // Where faces meet pixels are half as wide as in their middle.
        let steps = (2.0 * window_m / (0.5 * pixel_m)).ceil();
        let [right, up] = across(offset);
        let along = |i: usize| i as f32 / steps * 2.0 * window_m - window_m;
        let ends_beyond = (0..=steps as usize).all(|row| {
            (0..=steps as usize).all(|column| {
                let (a, b) = (along(column), along(row));
                let around = std::array::from_fn(|axis| offset[axis] + right[axis] * a + up[axis] * b);
                let seen = self.map.project(around).and_then(|seen| self.hit((seen.face, seen.pixel)));
                let is_within = a * a + b * b <= radius_m * radius_m;
                seen.is_some_and(|hit| hit.distance_m > distance_m + radius_m || !(is_within || hit.is_rim))
            })
        });
        ends_beyond && self.rays.pass(Ball { offset, radius_m }, gap_max_m / 2.0, thresholds)
    }

    /// The widest gap between rays across a window, see [`RayWindow`], meters.
    pub fn widest_gap_m(&self, window: RayWindow) -> f32 {
        self.rays.widest_gap_m(window)
    }

    #[inline(always)]
    fn place(&self, (face, [column, row]): Pixel) -> usize {
        let side = self.map.pixels();
        (face * side + row) * side + column
    }

    #[inline(always)]
    fn hit(&self, pixel: Pixel) -> Option<&Hit> {
        self.hits.get(self.places[self.place(pixel)] as usize)
    }
}

/// The pixels around one.
const AROUND: [[isize; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    const SETTINGS: SurfaceSettings = SurfaceSettings {
        grazing_rad: 0.14,
        noise_m: 0.1,
        spacing_m: 0.2,
        sensor: None,
        thresholds: Thresholds::DEFAULT,
    };

    /// Rays half a degree apart about the x axis that end so far away as `end_m` says of their angles to the side and
    /// up, degrees; with those that it says nothing of.
    fn rays(end_m: impl Fn(f32, f32) -> Option<f32>) -> [Vec<Point>; 2] {
        let mut rays = [Vec::new(), Vec::new()];
        for i in 0..120 * 80 {
            let (side, up) = ((i % 120) as f32 * 0.5 - 30.0, (i / 120) as f32 * 0.5 - 20.0);
            let direction = [1.0, side.to_radians().tan(), up.to_radians().tan()];
            let end_m = end_m(side, up);
            let range_m = end_m.unwrap_or(50.0);
            rays[usize::from(end_m.is_none())].push(direction.map(|c| c * range_m / norm(direction)).into());
        }
        rays
    }

    fn sees_through(rays: &ScanRays<'_>, [x, side, up]: [f32; 3]) -> bool {
        let surface = ScanSurface::of(*rays, SETTINGS).unwrap();
        let at = [x, x * side.to_radians().tan(), x * up.to_radians().tan()];
        surface.sees_through(at, 0.087, 0.15)
    }

    #[test]
    fn rays_without_a_return_are_believed_where_those_beside_them_agree() {
        // Sky above, and ground below that is met far away.
        let [met, no_returns] = rays(|_, up| (up < 0.0).then_some(20.0));
        let open = ScanRays { no_returns: &no_returns, ..ScanRays::met(&met) };
        assert!(sees_through(&open, [5.0, 3.0, 8.0]) && sees_through(&open, [5.0, 3.0, 0.3]));
        assert!(!sees_through(&ScanRays::met(&met), [5.0, 3.0, 8.0]), "nobody tells of the sky");
        // A wall 4 m away, of which a few rays beside each other do not return.
        let [met, no_returns] = rays(|side, up| (side.abs() > 0.6 || up.abs() > 0.6).then_some(4.0));
        assert!(!no_returns.is_empty());
        let wall = ScanRays { no_returns: &no_returns, ..ScanRays::met(&met) };
        assert!(!sees_through(&wall, [5.0, 0.0, 0.0]), "behind a hole in a wall");
        let [met, no_returns] = rays(|side, _| (side.abs() > 2.0).then_some(4.0));
        let gap = ScanRays { no_returns: &no_returns, ..ScanRays::met(&met) };
        assert!(!sees_through(&gap, [5.0, 0.0, 0.0]), "in a narrow gap");
    }

    #[test]
    fn rays_that_ran_on_are_seen_through_and_are_no_surface() {
        let beyond: Vec<Point> = rays(|_, _| Some(8.0))[0].clone();
        let rays = ScanRays { beyond: &beyond, ..ScanRays::default() };
        assert!(sees_through(&rays, [7.0, 3.0, 8.0]) && !sees_through(&rays, [8.1, 3.0, 8.0]));
        let (mut open, mut met) = (0, 0);
        ScanSurface::of(rays, SETTINGS).unwrap().for_samples(20.0, |_| open += 1);
        ScanSurface::of(ScanRays::met(&beyond), SETTINGS).unwrap().for_samples(20.0, |_| met += 1);
        assert!(open == 0 && met > 100, "{open}, {met}");
    }
}
