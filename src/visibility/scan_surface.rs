//! The surface that a scan shows: its points, and which of them lie on one surface.

use super::cube_map::{CubeMap, FACES, Projection, TILE_SIDE};
use crate::geometry::Point;

/// Tiles along the side of a face, finest first: pixels of 0.28 to 5.6 degrees.
const TILES: [usize; 11] = [40, 32, 25, 20, 16, 13, 10, 8, 6, 4, 2];
/// Tiles along the side of a face with which it is found out how densely a scan's points lie.
const TILES_OF_DENSITY: usize = 10;
/// Largest share of the seen pixels beside which two or more are not seen though others behind them are: a finer image would
/// be a sieve.
const GAPS_MAX: f64 = 0.05;
/// Pixels over which a gap is looked for.
const GAP_PIXELS_MAX: usize = 8;
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

/// A pixel: its face, and its column and row there.
type Pixel = (usize, [usize; 2]);

impl ScanSurface {
    /// The surface of a scan of `points` (sensor frame, finite); none of a scan without points.
    pub fn of(points: &[Point], settings: SurfaceSettings) -> Option<Self> {
        let offsets: Vec<_> = points.iter().map(|point| point.xyz()).collect();
        let densest = Self::of_points(&offsets, CubeMap::new(TILES_OF_DENSITY), settings);
        if densest.hits.is_empty() {
            return None;
        }
        let points_a_pixel = offsets.len() as f64 / densest.hits.len() as f64;
        let tiles_max = (TILES_OF_DENSITY as f64 * points_a_pixel.sqrt()) as usize;
        let coarsest = TILES[TILES.len() - 1];
        let candidates = TILES.iter().filter(|&&tiles| tiles <= tiles_max.max(coarsest));
        let mut surface = candidates
            .map(|&tiles| Self::of_points(&offsets, CubeMap::new(tiles), settings))
            .find(|surface| surface.map.tiles() == coarsest || surface.gaps() <= GAPS_MAX)?;
        (0..FILLINGS).for_each(|_| surface.fill());
        surface.find_rims();
        Some(surface)
    }

    /// The nearest point in each pixel.
    fn of_points(offsets: &[[f32; 3]], map: CubeMap, settings: SurfaceSettings) -> Self {
        let pixels = FACES * map.pixels() * map.pixels();
        let mut surface = Self { map, settings, places: vec![NOT_SEEN; pixels], hits: Vec::new() };
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

    /// Pixels beside which two or more are not seen before the next that is, as a share of all that are seen.
    fn gaps(&self) -> f64 {
        let side = self.map.pixels();
        let is_seen = |face, pixel| self.hit((face, pixel)).is_some();
        let begins_gap = |face: usize, [column, row]: [usize; 2], [right, up]: [usize; 2]| {
            let after = (1..=GAP_PIXELS_MAX)
                .map(|i| [column + right * i, row + up * i])
                .take_while(|pixel| pixel.iter().all(|&c| c < side));
            let before_next = after.take_while(|&pixel| !is_seen(face, pixel)).count();
            let next = [column + right * (before_next + 1), row + up * (before_next + 1)];
            (2..GAP_PIXELS_MAX).contains(&before_next) && next.iter().all(|&c| c < side)
        };
        let seen = self.pixels().filter(|&(face, pixel)| is_seen(face, pixel));
        let gaps: usize = seen
            .map(|(face, pixel)| {
                usize::from(begins_gap(face, pixel, [1, 0])) + usize::from(begins_gap(face, pixel, [0, 1]))
            })
            .sum();
        gaps as f64 / self.hits.len().max(1) as f64
    }

    /// Sees in a pixel between two that show one surface, beside or above each other, what lies halfway between them.
    fn fill(&mut self) {
        let between = |a: Option<&Hit>, b: Option<&Hit>| {
            let (a, b) = (a?, b?);
            self.are_joined(a, b).then(|| std::array::from_fn(|axis| (a.offset[axis] + b.offset[axis]) / 2.0))
        };
        let halfway = |pixel: Pixel| {
            let at = |steps| self.hit(self.beside(pixel, steps)?);
            let beside = between(at([-1, 0]), at([1, 0]));
            let above = between(at([0, -1]), at([0, 1]));
            beside.into_iter().chain(above).min_by(|a, b| norm(*a).total_cmp(&norm(*b)))
        };
        let unseen = self.pixels().filter(|&pixel| self.hit(pixel).is_none());
        let filled: Vec<(usize, [f32; 3])> =
            unseen.filter_map(|pixel| Some((self.place(pixel), halfway(pixel)?))).collect();
        for (place, offset) in filled {
            self.put(place, Hit { offset, distance_m: norm(offset), is_rim: false, is_filled: true });
        }
    }

    fn find_rims(&mut self) {
        let is_rim = |pixel: Pixel, hit: &Hit| {
            AROUND.iter().any(|&steps| {
                let beside = self.beside(pixel, steps).and_then(|pixel| self.hit(pixel));
                beside
                    .is_none_or(|beside| beside.distance_m > hit.distance_m && !self.are_joined(hit, beside))
            })
        };
        let rims: Vec<usize> = self
            .pixels()
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
        for pixel in self.pixels() {
            let Some(hit) = self.hit(pixel).filter(|hit| hit.distance_m <= range_m) else { continue };
            if hit.is_filled {
                f(hit.offset);
            }
            let beside = |steps| {
                let beside = self.beside(pixel, steps).and_then(|pixel| self.hit(pixel))?;
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
    /// A ball that is smaller than the points are apart there is not seen through.
    pub fn sees_through(&self, offset: [f32; 3], radius_m: f32) -> bool {
        let Some(Projection { depth_m, .. }) = self.map.project(offset) else { return false };
        let (distance_m, pixel_m) = (norm(offset), depth_m * self.map.pitch());
        if distance_m <= NEAREST * radius_m || pixel_m > 2.0 * radius_m {
            return false;
        }
        let window_m = radius_m + pixel_m;
        // Where faces meet pixels are half as wide as in their middle.
        let steps = (2.0 * window_m / (0.5 * pixel_m)).ceil();
        let [right, up] = across(offset);
        let along = |i: usize| i as f32 / steps * 2.0 * window_m - window_m;
        (0..=steps as usize).all(|row| {
            (0..=steps as usize).all(|column| {
                let (a, b) = (along(column), along(row));
                let around = std::array::from_fn(|axis| offset[axis] + right[axis] * a + up[axis] * b);
                let seen = self.map.project(around).and_then(|seen| self.hit((seen.face, seen.pixel)));
                let is_within = a * a + b * b <= radius_m * radius_m;
                seen.is_some_and(|hit| hit.distance_m > distance_m + radius_m || !(is_within || hit.is_rim))
            })
        })
    }

    fn pixels(&self) -> impl Iterator<Item = Pixel> + use<> {
        let side = self.map.pixels();
        (0..FACES).flat_map(move |face| (0..side * side).map(move |i| (face, [i % side, i / side])))
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

    /// The pixel so many columns and rows away, on whatever face.
    fn beside(&self, (face, [column, row]): Pixel, [right, up]: [isize; 2]) -> Option<Pixel> {
        let side = self.map.pixels();
        let moved = |at: usize, by: isize| at.checked_add_signed(by).filter(|&at| at < side);
        match (moved(column, right), moved(row, up)) {
            (Some(column), Some(row)) => Some((face, [column, row])),
            _ => {
                let [u, v] = [(column, right), (row, up)]
                    .map(|(at, by)| (at as f32 + by as f32 + 0.5) * self.map.pitch() - 1.0);
                let Projection { face, pixel, .. } = self.map.project(self.map.on_face(face, [u, v]))?;
                Some((face, pixel))
            }
        }
    }
}

/// The pixels around one.
const AROUND: [[isize; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];
const _: () = assert!(TILE_SIDE * TILES[0] < 1 << 12, "all pixels have a number");

fn norm([x, y, z]: [f32; 3]) -> f32 {
    ((x * x + y * y) + z * z).sqrt()
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    norm(std::array::from_fn(|axis| a[axis] - b[axis]))
}

fn between(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|axis| a[axis] + (b[axis] - a[axis]) * share)
}

/// Two directions at right angles to each other and to `offset`, of length 1.
fn across(offset: [f32; 3]) -> [[f32; 3]; 2] {
    let offset = nalgebra::Vector3::from(offset);
    let other = nalgebra::Vector3::ith(offset.iamin(), 1.0);
    let right = offset.cross(&other).normalize();
    [right.into(), offset.cross(&right).normalize().into()]
}
