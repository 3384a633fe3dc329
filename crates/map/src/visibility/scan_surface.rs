//! The surface that a scan shows: its points, and which of them lie on one surface.

use super::cube_map::{CubeMap, FACES, Pixel, Projection};
use super::density::PointDensity;
use super::ray_index::{Ball, RayIndex};
use super::vectors::{across, between, distance, norm};
use crate::geometry::Point;

/// Points that are farther apart than so many samples say nothing of what is between them.
const SAMPLES_MAX: f32 = 32.0;
/// Balls nearer than so many of their radii are not seen through: they would be looked at in too many directions.
const NEAREST: f32 = 4.0;
/// How often pixels between two that are seen are filled: for rows or columns between those with points, for where both meet, and
/// for where pixels are smallest, at the corners of the cube.
const FILLINGS: usize = 3;
/// Number of a pixel in which nothing was seen.
const NOT_SEEN: u32 = u32::MAX;

/// How the points of a scan make a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSettings {
    /// Smallest angle between a ray and a surface, radians: two points beside each other that only a surface at a smaller
    /// one would join are the rim of the nearer one.
    pub grazing_rad: f32,
    /// Steps in range that are noise, meters.
    pub noise_m: f32,
    /// Largest distance between two neighboring samples of the surface, meters.
    pub spacing_m: f32,
}

/// The surface that a scan shows, as it is seen from the sensor: on the six faces of a cube around it, the nearest point in
/// each pixel, and which pixels beside each other show one surface.
///
/// Pixels are as fine as the points lie, and no finer, so that a scan is not seen through a sieve: rows of points with rows
/// between them in which there are none are one surface where they are no farther apart than two pixels.
#[derive(Debug, Clone)]
pub struct ScanSurface {
    map: CubeMap,
    settings: SurfaceSettings,
    /// For each pixel, face by face and row by row, the number of its hit.
    places: Vec<u32>,
    hits: Vec<Hit>,
    /// All of the scan's rays.
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
}

impl ScanSurface {
    /// The surface of a scan of `points` (sensor frame, finite); none of a scan without points.
    pub fn of(points: &[Point], settings: SurfaceSettings) -> Option<Self> {
        let offsets: Vec<_> = points.iter().map(|point| point.xyz()).collect();
        let PointDensity { map, .. } = PointDensity::of(&offsets)?;
        let mut surface = Self::of_points(&offsets, map, settings);
        (0..FILLINGS).for_each(|_| surface.fill());
        surface.find_rims();
        Some(surface)
    }

    /// The nearest point in each pixel.
    fn of_points(offsets: &[[f32; 3]], map: CubeMap, settings: SurfaceSettings) -> Self {
        let places = vec![NOT_SEEN; FACES * map.pixels() * map.pixels()];
        let rays = RayIndex::of(map, offsets);
        let mut surface = Self { map, settings, places, hits: Vec::new(), rays };
        for &offset in offsets {
            let Some(Projection { face, pixel, .. }) = map.project(offset) else { continue };
            let hit = Hit { offset, distance_m: norm(offset), is_rim: false, is_filled: false };
            let place = surface.place((face, pixel));
            match surface.hits.get_mut(surface.places[place] as usize) {
                Some(nearest) if nearest.distance_m <= hit.distance_m => {}
                Some(nearest) => *nearest = hit,
                None => surface.put(place, hit),
            }
        }
        surface
    }

    fn put(&mut self, place: usize, hit: Hit) {
        self.places[place] = self.hits.len() as u32;
        self.hits.push(hit);
    }

    /// Sees in a pixel between two that show one surface, beside or above each other, what lies halfway between them.
    fn fill(&mut self) {
        let between = |a: Option<&Hit>, b: Option<&Hit>| {
            let (a, b) = (a?, b?);
            self.are_joined(a, b).then(|| std::array::from_fn(|axis| (a.offset[axis] + b.offset[axis]) / 2.0))
        };
        let halfway = |pixel: Pixel| {
            let at = |steps| self.hit(self.map.beside(pixel, steps)?);
            let beside = between(at([-1, 0]), at([1, 0]));
            let above = between(at([0, -1]), at([0, 1]));
            beside.into_iter().chain(above).min_by(|a, b| norm(*a).total_cmp(&norm(*b)))
        };
        let unseen = self.map.all_pixels().filter(|&pixel| self.hit(pixel).is_none());
        let filled: Vec<(usize, [f32; 3])> =
            unseen.filter_map(|pixel| Some((self.place(pixel), halfway(pixel)?))).collect();
        for (place, offset) in filled {
            self.put(place, Hit { offset, distance_m: norm(offset), is_rim: false, is_filled: true });
        }
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

    /// True where two points beside each other can lie on one surface that is not seen at a smaller angle than the grazing
    /// one.
    fn are_joined(&self, a: &Hit, b: &Hit) -> bool {
        let (near, far) = if a.distance_m <= b.distance_m { (a, b) } else { (b, a) };
        let scale = near.distance_m / far.distance_m;
        let beside_near = far.offset.map(|c| c * scale);
        let across_m = distance(near.offset, beside_near);
        let SurfaceSettings { grazing_rad, noise_m, spacing_m } = self.settings;
        far.distance_m - near.distance_m <= across_m / grazing_rad.tan() + noise_m
            && distance(near.offset, far.offset) <= SAMPLES_MAX * spacing_m
    }

    /// The ends of the directions that were seen, or where they are `range_m` from the sensor if that is nearer: offsets in
    /// the sensor frame, meters.
    pub fn seen(&self, range_m: f32) -> impl Iterator<Item = [f32; 3]> {
        self.hits.iter().map(move |hit| {
            let share = (range_m / hit.distance_m).min(1.0);
            hit.offset.map(|c| c * share)
        })
    }

    /// Calls `f` with samples of the surface (sensor frame, meters) within `range_m`, of which two beside each other are no
    /// farther apart than the settings say, but for the points of the scan itself.
    pub fn for_samples(&self, range_m: f32, mut f: impl FnMut([f32; 3])) {
        for pixel in self.map.all_pixels() {
            let Some(hit) = self.hit(pixel).filter(|hit| hit.distance_m <= range_m) else { continue };
            if hit.is_filled {
                f(hit.offset);
            }
            let beside = |steps| {
                let beside = self.map.beside(pixel, steps).and_then(|pixel| self.hit(pixel))?;
                self.are_joined(hit, beside).then_some(beside)
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
    pub fn sees_beyond(&self, offset: [f32; 3], margin_m: f32) -> bool {
        let seen = self.map.project(offset).and_then(|seen| self.hit((seen.face, seen.pixel)));
        seen.is_some_and(|hit| hit.distance_m > norm(offset) + margin_m)
    }

    /// True where the scan saw through a ball of `radius_m` around `offset` (sensor frame): each direction in which the ball
    /// lies ends beyond it, and no direction within a pixel of these is unseen, or ends before that at a rim.
    ///
    /// Nothing is seen through where rays ran farther from each other than `gap_max_m`: what is larger than that was met by one.
    pub fn sees_through(&self, offset: [f32; 3], radius_m: f32, gap_max_m: f32) -> bool {
        let Some(Projection { depth_m, .. }) = self.map.project(offset) else { return false };
        let (distance_m, pixel_m) = (norm(offset), depth_m * self.map.pitch());
        if distance_m <= NEAREST * radius_m {
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
        ends_beyond && self.rays.pass(Ball { offset, radius_m }, gap_max_m / 2.0)
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
