//! A range image: how far a scan saw in each direction.

use super::cube_map::{CubeMap, Pixel, Projection};
use super::density::PointDensity;
use super::nearest_depths::{NearestDepths, SPACING_MAX};
use super::ray_gaps::RayGaps;
use super::sight::{Sight, sight};
use super::tile::{TILE_BYTES, Tile};
use super::vectors::norm;
use crate::geometry::Point;

/// Most bytes of a range image that is kept.
pub const IMAGE_BYTES_MAX: usize = 8192;
/// Tiles along the side of a face, finest first, fewer than [`TELLS_OPEN`]: pixels of 0.6 to 7 degrees.
const TILES: [usize; 14] = [25, 22, 20, 18, 16, 14, 12, 10, 8, 6, 5, 4, 3, 2];
/// Bytes of an image before its tiles: how many there are along a side, the unit of depths, and how the rays lay.
const HEAD_BYTES: usize = 1 + 3 * 4;
/// Says in an image's first byte that its head tells how the rays lay. The first images did not.
const TELLS_RAYS: u8 = 0x80;
/// Says in an image's first byte that a number is behind its head: from where on nothing was met.
const TELLS_OPEN: u8 = 0x40;
/// Bytes of that number.
const OPEN_BYTES: usize = 4;
/// How much nearer than where nothing was met a pixel may tell it, as a share: its depth is the least of rays that ran up to 2.9 degrees
/// away, and of a place in it.
const OPEN_SLACK: f32 = 0.035;
/// Bytes of what their heads did not tell.
const RAYS_BYTES: usize = 2 * 4;
/// Depths in the image's unit are at most this.
const DEPTH_MAX: f32 = u16::MAX as f32;
/// Movements of the sensor up to this are taken for none, meters.
const MOVED_MIN_M: f32 = 0.01;
/// Pixels around one in which what is seen from a moving sensor is looked for, at most.
const MOVED_PIXELS_MAX: f32 = 8.0;
/// How much more coarser pixels have to tell, since they tell it less well.
const WORTHWHILE: f32 = 1.03;

/// How far a scan saw in each direction from its sensor: on the six faces of a cube around it, the depth along the face's
/// axis up to which nothing was in the way (paper III-B: free space is generated from the recorded poses and the sensor).
///
/// A pixel tells the nearest of the points seen in it, so that a direction is never said to be seen further than the nearest
/// surface there. Only tiles with something seen are kept: a camera spends its 8 kB on what it looks at.
///
/// Rays that a moving sensor took elsewhere count as taken from the image's place, up to [`Sweep::moved_m`] beside where they ran. So
/// a place counts as seen through only where all that lies so near to it was.
#[derive(Clone, PartialEq)]
pub struct RangeImage {
    map: CubeMap,
    /// Meters of one unit of depth.
    unit_m: f32,
    rays: Rays,
    /// [`Sweep::open_m`].
    open_m: f32,
    /// For each tile of the cube its number among those that are kept.
    places: Vec<u16>,
    tiles: Vec<Tile>,
}

/// The place of a tile that is not kept.
const NOT_SEEN: u16 = u16::MAX;

/// A place that a scan met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// From the sensor, in its frame, meters.
    pub offset: [f32; 3],
    /// How far off it may be along the axis of its face, meters: pixels are wide, and depths are rounded.
    pub error_m: f32,
}

/// How a scan looked around.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// What is further away is seen up to here, meters.
    pub range_max_m: f32,
    /// How far the sensor was, at most, from the scan's pose when it took a ray, meters; 0 of one that stood.
    pub moved_m: f32,
    /// Rays that end here or farther away met nothing: they run on, meters. Infinite: each met something.
    pub open_m: f32,
}

/// How the rays of an image lay.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rays {
    /// [`Sweep::moved_m`].
    moved_m: f32,
    /// [`PointDensity::spacing`].
    spacing: f32,
}

/// What it takes to have seen well beyond a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WellBeyond {
    /// How far behind it everything has to be that was seen around it, meters.
    pub margin_m: f32,
    /// How far from each other rays may have passed it, meters: what is larger than that was met by one.
    pub gap_max_m: f32,
}

/// Why bytes are not a range image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RangeImageError {
    /// Too few bytes, or too many.
    #[error("a range image of {got} bytes, {expected} expected")]
    Length {
        /// Bytes that are there.
        got: usize,
        /// Bytes that its head and its tiles make.
        expected: usize,
    },
    /// The number of tiles along a side is out of range.
    #[error("a range image of {0} tiles along a side, at least 1 expected")]
    Tiles(usize),
    /// The unit of depths is not a positive number.
    #[error("a range image with {0} m as its unit of depth, a positive number expected")]
    Unit(f32),
    /// What it tells of its rays cannot be.
    #[error("a range image whose sensor moved by {0} m, its rays {1} apart: neither may be negative")]
    Rays(f32, f32),
    /// What it tells of rays that ran on cannot be.
    #[error("a range image whose rays ran on beyond {0} m, a number from 0 expected")]
    Open(f32),
}

impl RangeImage {
    /// The image of at most `bytes_max` bytes of a scan whose rays ended at `points` (sensor frame, finite); none where nothing is seen.
    ///
    /// Points of the robot itself belong to them: what lies behind it was not seen. Pixels are as fine as `bytes_max` allows and as
    /// the points lie. Those in which the points lie far from each other are not seen.
    pub fn of_points(points: &[Point], sweep: Sweep, bytes_max: usize) -> Option<Self> {
        let offsets: Vec<_> = points.iter().filter_map(|point| sweep.limited(point.xyz())).collect();
        let PointDensity { map, spacing } = PointDensity::of(&offsets)?;
        let rays = Rays { moved_m: sweep.told_moved_m(), spacing };
        let depths = TILES.iter().map(|&tiles| NearestDepths::of(CubeMap::new(tiles), &offsets));
        let mut fitting =
            depths.filter(|depths| depths.touched_tiles() <= tiles_max(depths.map(), bytes_max));
        let of_depths = |depths: &NearestDepths| Self::of_depths(depths, rays, sweep.open_m);
        let first = of_depths(&fitting.next()?);
        // Coarser pixels tell more of a scan whose points lie further apart than the finest pixels.
        let coarser = fitting.take_while(|depths| depths.map().pitch() <= SPACING_MAX);
        let mut best = coarser.map(|depths| of_depths(&depths)).fold(first, Self::that_tells_more);
        best.note_gaps(&RayGaps { map: map.finer(), spacing, offsets: &offsets });
        (!best.tiles.is_empty()).then_some(best)
    }

    /// Tells the gaps between rays in the tiles that were seen there: pixels and their parts are too wide to tell of them.
    fn note_gaps(&mut self, gaps: &RayGaps<'_>) {
        gaps.for_each(|direction, gap| {
            let Some(Projection { face, pixel, .. }) = self.map.project(direction) else { return };
            let (tile, pixel) = self.map.place(face, pixel);
            let kept = self.tiles.get_mut(usize::from(self.places[tile]));
            if let Some(tile) = kept.filter(|tile| tile.depth(pixel).is_some()) {
                tile.note_gap(gap);
            }
        });
    }

    /// The coarser image where it tells so much more that this is worth it.
    fn that_tells_more(finer: Self, coarser: Self) -> Self {
        if coarser.seen_area() > WORTHWHILE * finer.seen_area() { coarser } else { finer }
    }

    /// The part of the cube around the sensor in which something was seen, in squares of side 1 at depth 1.
    fn seen_area(&self) -> f32 {
        let seen: usize = self.tiles.iter().map(Tile::seen_pixels).sum();
        seen as f32 * self.map.pitch() * self.map.pitch()
    }

    fn of_depths(depths: &NearestDepths, rays: Rays, open_m: f32) -> Self {
        let map = depths.map();
        let unit_m = (depths.max() / DEPTH_MAX).max(f32::MIN_POSITIVE);
        let (mut places, mut tiles) = (vec![NOT_SEEN; map.tiles_of_all_faces()], Vec::new());
        for (place, seen) in places.iter_mut().zip(depths.seen_tiles(rays.spacing)) {
            let depths = seen.map(|depth| depth.map(|depth_m| (depth_m / unit_m).min(DEPTH_MAX) as u16));
            if depths.iter().any(Option::is_some) {
                *place = tiles.len() as u16;
                tiles.push(Tile::new(&depths));
            }
        }
        Self { map, unit_m, rays, open_m, places, tiles }
    }

    /// True where the scan saw beyond the point at `offset` from the sensor, in its frame: the point was not hidden, and nothing
    /// was there.
    #[inline]
    pub fn sees_through(&self, offset: [f32; 3]) -> bool {
        self.map.project(offset).is_some_and(|Projection { face, pixel, depth_m }| {
            self.sees_beyond((face, pixel), depth_m)
                && (self.rays.moved_m == 0.0 || self.sees_beyond_around((face, pixel), depth_m, depth_m, 0))
        })
    }

    /// True where the scan saw well beyond the point at `offset`: in its own pixel and in all that lie around it, no surface that is
    /// seen askew or in part is seen through so, nor what lies beside a rim, and nothing that fits between the rays.
    pub fn sees_well_beyond(&self, offset: [f32; 3], least: WellBeyond) -> bool {
        let WellBeyond { margin_m, gap_max_m } = least;
        self.map.project(offset).is_some_and(|Projection { face, pixel, depth_m }| {
            let distance_m = norm(offset);
            distance_m * self.gap_at((face, pixel)) <= gap_max_m
                && self.sees_beyond_around((face, pixel), depth_m, depth_m + margin_m, 1)
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
    fn sees_beyond(&self, (face, pixel): Pixel, beyond_m: f32) -> bool {
        self.depth_m(face, pixel).is_some_and(|seen_m| beyond_m < seen_m)
    }

    /// [`RangeImage::sees_beyond`] of all pixels in which what is so deep as `depth_m` can have been seen by a sensor that moved, and so many
    /// more around them.
    #[inline(never)]
    fn sees_beyond_around(&self, pixel: Pixel, depth_m: f32, beyond_m: f32, more: isize) -> bool {
        let Some(moved) = self.moved_pixels(depth_m) else { return false };
        let around = || -(moved + more)..=moved + more;
        // What lies on another face is less deep there than here, so that no less is asked of it.
        around().all(|up| {
            around().all(|right| {
                self.map.beside(pixel, [right, up]).is_some_and(|pixel| self.sees_beyond(pixel, beyond_m))
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
    pub(super) fn depth_m(&self, face: usize, pixel: [usize; 2]) -> Option<f32> {
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

    /// Some of the places that the scan met, `wish` of them or fewer, from all over what it saw, and none of which is off by more than
    /// `error_max_m`: at the rims of things a pixel does not tell where in it they lie.
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
    pub(super) fn kept_pixels(&self) -> impl Iterator<Item = Pixel> {
        let kept = self.places.iter().enumerate().filter(|(_, place)| **place != NOT_SEEN);
        kept.flat_map(|(tile, _)| self.map.pixels_of_tile(tile))
    }

    /// What was met in a pixel. Its depth is that of the nearest point in it: how far off that is from the middle of the pixel is told
    /// by the pixels around it.
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
    pub(super) fn map(&self) -> CubeMap {
        self.map
    }

    /// The side of a pixel at depth 1.
    pub fn pitch(&self) -> f32 {
        self.map.pitch()
    }

    /// Bytes of the image where it is stored.
    pub fn stored_bytes(&self) -> usize {
        stored_bytes(self.map, self.tiles.len()) + if self.tells_open() { OPEN_BYTES } else { 0 }
    }

    /// True where some of its rays ran on.
    fn tells_open(&self) -> bool {
        self.open_m.is_finite()
    }

    /// Bytes of memory.
    pub fn memory_bytes(&self) -> usize {
        self.places.len() * size_of::<u16>() + self.tiles.len() * size_of::<Tile>()
    }

    /// The image as bytes: how many tiles there are along a side and 128 (1 byte; and 64 where rays ran on), the unit of depths (f32), how
    /// far the sensor moved in meters (f32) and how far apart the rays lay at depth 1 (f32), from where on nothing was met in meters
    /// (f32; where rays ran on), a bit for each tile of the six faces that says whether it is
    /// kept, and the tiles that are. All little-endian. The first images, without the 128, told nothing of their rays.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.stored_bytes());
        let tells_open = if self.tells_open() { TELLS_OPEN } else { 0 };
        bytes.push(self.map.tiles() as u8 | TELLS_RAYS | tells_open);
        let open_m = self.tells_open().then_some(self.open_m);
        for number in [self.unit_m, self.rays.moved_m, self.rays.spacing].into_iter().chain(open_m) {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        bytes.extend(self.places.chunks(8).map(|places| {
            let bit = |(i, place): (usize, &u16)| u8::from(*place != NOT_SEEN) << i;
            places.iter().enumerate().map(bit).sum::<u8>()
        }));
        self.tiles.iter().for_each(|tile| tile.write(&mut bytes));
        bytes
    }

    /// The inverse of [`RangeImage::to_bytes`].
    ///
    /// # Errors
    /// For bytes that are not an image.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RangeImageError> {
        let short = RangeImageError::Length { got: bytes.len(), expected: HEAD_BYTES };
        let (&first, rest) = bytes.split_first().ok_or_else(|| short.clone())?;
        let (unit_m, rest) = number_from(rest).ok_or_else(|| short.clone())?;
        let tells_rays = first & TELLS_RAYS != 0;
        let (rays, rest) = if tells_rays {
            Rays::from_bytes(rest).ok_or_else(|| short.clone())?
        } else {
            (Rays::NOT_TOLD, rest)
        };
        let tells_open = tells_rays && first & TELLS_OPEN != 0;
        let (open_m, rest) = if tells_open { number_from(rest).ok_or(short)? } else { (f32::INFINITY, rest) };
        let tiles = usize::from(first & !(if tells_rays { TELLS_RAYS | TELLS_OPEN } else { TELLS_RAYS }));
        if tiles == 0 {
            return Err(RangeImageError::Tiles(tiles));
        }
        if !(unit_m > 0.0 && (unit_m * DEPTH_MAX).is_finite()) {
            return Err(RangeImageError::Unit(unit_m));
        }
        let Rays { moved_m, spacing } = rays;
        if !(moved_m >= 0.0 && moved_m.is_finite() && spacing >= 0.0 && spacing.is_finite()) {
            return Err(RangeImageError::Rays(moved_m, spacing));
        }
        if tells_open && !(open_m >= 0.0 && open_m.is_finite()) {
            return Err(RangeImageError::Open(open_m));
        }
        let map = CubeMap::new(tiles);
        let count = map.tiles_of_all_faces();
        let bits = &rest[..count.div_ceil(8).min(rest.len())];
        let is_kept = |tile: usize| bits.get(tile / 8).is_some_and(|byte| byte >> (tile % 8) & 1 == 1);
        let kept = (0..count).filter(|&tile| is_kept(tile)).count();
        let open = if tells_open { OPEN_BYTES } else { 0 };
        let expected = stored_bytes(map, kept) + open - if tells_rays { 0 } else { RAYS_BYTES };
        if bytes.len() != expected {
            return Err(RangeImageError::Length { got: bytes.len(), expected });
        }
        let mut places = vec![NOT_SEEN; count];
        for (place, tile) in (0..count).filter(|&tile| is_kept(tile)).enumerate() {
            places[tile] = place as u16;
        }
        let (tiles, _) = rest[bits.len()..].as_chunks::<TILE_BYTES>();
        Ok(Self { map, unit_m, rays, open_m, places, tiles: tiles.iter().map(Tile::read).collect() })
    }
}

impl std::fmt::Debug for RangeImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { map, unit_m, tiles, .. } = self;
        write!(f, "RangeImage {{ side: {}, unit_m: {unit_m}, tiles: {} }}", map.pixels(), tiles.len())
    }
}

impl Sweep {
    /// The sweep of a sensor that stood.
    pub const fn standing(range_max_m: f32) -> Self {
        Self { range_max_m, moved_m: 0.0, open_m: f32::INFINITY }
    }

    /// The point at `offset` from the sensor, as far as it is seen; none of what has no direction.
    pub fn limited(self, offset: [f32; 3]) -> Option<[f32; 3]> {
        let squared = offset.iter().map(|c| c * c).sum::<f32>();
        if !(squared > 0.0 && squared.is_finite()) {
            return None;
        }
        let scale = (self.range_max_m / squared.sqrt()).min(1.0);
        Some(offset.map(|c| c * scale))
    }

    /// How far the sensor moved, where that is more than noise.
    fn told_moved_m(self) -> f32 {
        if self.moved_m > MOVED_MIN_M { self.moved_m } else { 0.0 }
    }
}

impl Rays {
    /// What is taken of the first images: a sensor that stood, and rays as far apart as they may lie in a pixel.
    const NOT_TOLD: Self = Self { moved_m: 0.0, spacing: SPACING_MAX };

    fn from_bytes(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (moved_m, rest) = number_from(bytes)?;
        let (spacing, rest) = number_from(rest)?;
        Some((Self { moved_m, spacing }, rest))
    }
}

/// A number at the beginning of some bytes, and the bytes behind it.
fn number_from(bytes: &[u8]) -> Option<(f32, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((f32::from_le_bytes(*number), rest))
}

/// Bytes of an image with `kept` tiles where it is stored.
fn stored_bytes(map: CubeMap, kept: usize) -> usize {
    HEAD_BYTES + map.tiles_of_all_faces().div_ceil(8) + kept * TILE_BYTES
}

/// Tiles that an image of at most `bytes` bytes can keep.
fn tiles_max(map: CubeMap, bytes: usize) -> usize {
    bytes.saturating_sub(stored_bytes(map, 0)) / TILE_BYTES
}
