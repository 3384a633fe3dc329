//! A range image: how far a scan saw in each direction.

use super::sight::{Sight, sight};
use super::tile::Tile;
use crate::visibility::directions::norm;
use crate::visibility::directions::{CubeMap, Pixel, Projection};

/// Most bytes of a range image that is kept.
pub const IMAGE_BYTES_MAX: usize = 8192;
/// How much nearer than where nothing was met a pixel may tell it, as a share: its depth is the least of rays that ran
/// up to 2.9 degrees away, and of a place in it.
const OPEN_SLACK: f32 = 0.035;
/// Depths in the image's unit are at most this.
pub(in crate::visibility) const DEPTH_MAX: f32 = u16::MAX as f32;
/// Pixels around one in which what is seen from a moving sensor is looked for, at most.
const MOVED_PIXELS_MAX: f32 = 8.0;

/// How far a scan saw in each direction from its sensor: on the six faces of a cube around it, the depth along the
/// face's axis up to which nothing was in the way (paper III-B: free space is generated from the recorded poses and the
/// sensor).
///
/// A pixel tells the nearest of the points seen in it, so that a direction is never said to be seen further than the
/// nearest surface there. Only tiles with something seen are kept: a camera spends its 8 kB on what it looks at.
///
/// Rays that a moving sensor took elsewhere count as taken from the image's place, up to [`Sweep::moved_m`] beside
/// where they ran. So a place counts as seen through only where all that lies so near to it was.
///
/// [`Sweep::moved_m`]: crate::visibility::Sweep::moved_m
#[derive(Clone, PartialEq)]
pub struct RangeImage {
    pub(in crate::visibility) map: CubeMap,
    /// Meters of one unit of depth.
    pub(in crate::visibility) unit_m: f32,
    pub(in crate::visibility) rays: RaySpacing,
    /// [`Sweep::open_m`](crate::visibility::Sweep::open_m).
    pub(in crate::visibility) open_m: f32,
    /// For each tile of the cube its number among those that are kept.
    pub(in crate::visibility) places: Vec<u16>,
    pub(in crate::visibility) tiles: Vec<Tile>,
}

/// The place of a tile that is not kept.
pub(in crate::visibility) const NOT_SEEN: u16 = u16::MAX;

/// A place that a scan met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// From the sensor, in its frame, meters.
    pub offset: [f32; 3],
    /// How far off it may be along the axis of its face, meters: pixels are wide, and depths are rounded.
    pub error_m: f32,
}

/// How the rays of an image lay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::visibility) struct RaySpacing {
    /// [`Sweep::moved_m`](crate::visibility::Sweep::moved_m).
    pub(in crate::visibility) moved_m: f32,
    /// The spacing of its points, see `PointDensity`.
    pub(in crate::visibility) spacing: f32,
}

/// The evidence that proves a place empty: see [`RangeImage::proves_absent`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbsenceEvidence {
    /// How far behind it everything has to be that was seen around it, meters.
    pub margin_m: f32,
    /// How far from each other rays may have passed it, meters: what is larger than that was met by one.
    pub gap_max_m: f32,
}

impl RangeImage {
    /// True where the scan proves the point at `offset` from the sensor, in its frame, to be free: the scan saw beyond
    /// it.
    #[inline]
    pub fn is_free(&self, offset: [f32; 3]) -> bool {
        self.map.project(offset).is_some_and(|Projection { face, pixel, depth_m }| {
            self.depth_exceeds((face, pixel), depth_m)
                && (self.rays.moved_m == 0.0
                    || self.depth_exceeds_in_window((face, pixel), depth_m, depth_m, 0))
        })
    }

    /// True where the scan proves that nothing is at the point at `offset`: it saw beyond it by a margin, in its own
    /// pixel and in all around it, by rays that leave no larger gap. A surface that is seen askew or in part, what lies
    /// beside a rim, and what fits between the rays are not proved absent.
    pub fn proves_absent(&self, offset: [f32; 3], least: AbsenceEvidence) -> bool {
        let AbsenceEvidence { margin_m, gap_max_m } = least;
        self.map.project(offset).is_some_and(|Projection { face, pixel, depth_m }| {
            let distance_m = norm(offset);
            distance_m * self.gap_at((face, pixel)) <= gap_max_m
                && self.depth_exceeds_in_window((face, pixel), depth_m, depth_m + margin_m, 1)
        })
    }

    /// How far apart rays passed around a pixel, as a rule and at most in the gaps between them, radians.
    fn gap_at(&self, pixel: Pixel) -> f32 {
        let around = [[-1, -1], [1, -1], [-1, 1], [1, 1]].into_iter();
        let pixels = around.filter_map(|steps| self.map.beside(pixel, steps));
        let tiles = pixels.filter_map(|pixel| self.tile_at(pixel));
        tiles.map(Tile::gap).fold(self.rays.spacing, f32::max)
    }

    /// True where a pixel was seen beyond a depth.
    #[inline(always)]
    fn depth_exceeds(&self, (face, pixel): Pixel, beyond_m: f32) -> bool {
        self.depth_m(face, pixel).is_some_and(|seen_m| beyond_m < seen_m)
    }

    /// [`RangeImage::depth_exceeds`] of all pixels in which what is so deep as `depth_m` can have been seen by a sensor
    /// that moved, and so many more around them.
    #[inline(never)]
    fn depth_exceeds_in_window(&self, pixel: Pixel, depth_m: f32, beyond_m: f32, more: isize) -> bool {
        let Some(moved) = self.moved_pixels(depth_m) else { return false };
        let around = || -(moved + more)..=moved + more;
        // What lies on another face is less deep there than here, so that no less is asked of it.
        around().all(|up| {
            around().all(|right| {
                self.map.beside(pixel, [right, up]).is_some_and(|pixel| self.depth_exceeds(pixel, beyond_m))
            })
        })
    }

    /// By how many pixels what is so deep may have been seen beside its own; none where these are too many to look at.
    fn moved_pixels(&self, depth_m: f32) -> Option<isize> {
        let moved_m = self.rays.moved_m;
        // Towards the corners of a face a step aside is seen as up to a half more.
        let pixels = (1.5 * moved_m / ((depth_m - moved_m) * self.map.pitch())).ceil();
        (moved_m == 0.0 || depth_m > moved_m && pixels <= MOVED_PIXELS_MAX).then_some(pixels as isize)
    }

    /// How deep a pixel was seen, meters; none where it was not.
    #[inline(always)]
    pub(in crate::visibility) fn depth_m(&self, face: usize, pixel: [usize; 2]) -> Option<f32> {
        let (tile, pixel) = self.map.place(face, pixel);
        let tile = self.tiles.get(usize::from(self.places[tile]))?;
        tile.depth(pixel).map(|depth| depth as f32 * self.unit_m)
    }

    /// How deep a pixel was seen, meters; none where it was not, and where the rays in it ran on.
    #[inline(always)]
    fn met_depth_m(&self, (face, pixel): Pixel) -> Option<f32> {
        let depth_m = self.depth_m(face, pixel)?;
        (self.open_m.is_infinite() || !self.is_open((face, pixel), depth_m)).then_some(depth_m)
    }

    /// True where the rays in a pixel that was seen so deep may have run on.
    fn is_open(&self, (face, pixel): Pixel, depth_m: f32) -> bool {
        let step_m = self.tile_at((face, pixel)).map_or(0.0, |tile| f32::from(tile.step()) * self.unit_m);
        let told_m = (depth_m + step_m) * norm(self.map.direction(face, pixel));
        told_m >= self.open_m * (1.0 - OPEN_SLACK - 0.5 * self.map.pitch())
    }

    /// What the scan tells of the point at `offset` from the sensor, in its frame, meters, by what it met.
    pub fn sight(&self, offset: [f32; 3], tolerance_m: f32) -> Sight {
        sight(self.map, |pixel| self.met_depth_m(pixel), offset, tolerance_m + self.rays.moved_m)
    }

    /// The tile of a pixel, where it is kept.
    fn tile_at(&self, (face, pixel): Pixel) -> Option<&Tile> {
        self.tiles.get(usize::from(self.places[self.map.place(face, pixel).0]))
    }

    /// Some of the places that the scan met, `wish` of them or fewer, from all over what it saw, and none of which is
    /// off by more than `error_max_m`: at the rims of things a pixel does not tell where in it they lie.
    pub fn met(&self, wish: usize, error_max_m: f32) -> Vec<Met> {
        let met: Vec<Met> = self
            .kept_pixels()
            .filter_map(|pixel| self.met_at(pixel))
            .filter(|met| met.error_m <= error_max_m)
            .collect();
        let stride = met.len().div_ceil(wish.max(1)).max(1);
        met.into_iter().step_by(stride).collect()
    }

    /// The pixels of the tiles that are kept, seen or not.
    pub(in crate::visibility) fn kept_pixels(&self) -> impl Iterator<Item = Pixel> {
        let kept = self.places.iter().enumerate().filter(|(_, place)| **place != NOT_SEEN);
        kept.flat_map(|(tile, _)| self.map.pixels_of_tile(tile))
    }

    /// What was met in a pixel. Its depth is that of the nearest point in it: how far off that is from the middle of
    /// the pixel is told by the pixels around it.
    fn met_at(&self, (face, pixel): Pixel) -> Option<Met> {
        let depth_m = self.met_depth_m((face, pixel))?;
        let beside = [[-1, 0], [1, 0], [0, -1], [0, 1]].into_iter();
        let on_face =
            beside.filter_map(|steps| self.map.beside((face, pixel), steps)).filter(|at| at.0 == face);
        let changes =
            on_face.filter_map(|(face, pixel)| self.depth_m(face, pixel)).map(|m| (m - depth_m).abs());
        let tile = self.tile_at((face, pixel))?;
        Some(Met {
            offset: self.map.direction(face, pixel).map(|c| c * depth_m),
            error_m: changes.fold(f32::from(tile.step()) * self.unit_m, f32::max) + self.rays.moved_m,
        })
    }

    /// The directions that were seen, each as the point up to which: offsets from the sensor in its frame, meters.
    pub fn seen(&self) -> impl Iterator<Item = [f32; 3]> {
        self.map.all_pixels().filter_map(|(face, pixel)| {
            let depth_m = self.depth_m(face, pixel)?;
            Some(self.map.direction(face, pixel).map(|c| c * depth_m))
        })
    }

    /// Its pixels.
    pub(in crate::visibility) fn map(&self) -> CubeMap {
        self.map
    }

    /// The side of a pixel at depth 1.
    pub fn pitch(&self) -> f32 {
        self.map.pitch()
    }

    /// Bytes of memory.
    pub fn memory_bytes(&self) -> usize {
        self.places.len() * size_of::<u16>() + self.tiles.len() * size_of::<Tile>()
    }
}

impl std::fmt::Debug for RangeImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { map, unit_m, tiles, .. } = self;
        write!(f, "RangeImage {{ side: {}, unit_m: {unit_m}, tiles: {} }}", map.pixels(), tiles.len())
    }
}
