//! A range image: how far a scan saw in each direction.

use super::cube_map::{CubeMap, FACES, Projection, TILE_SIDE};
use super::tile::{TILE_BYTES, TILE_PIXELS, Tile};
use crate::geometry::Point;

/// Most bytes of a range image that is kept.
pub const IMAGE_BYTES_MAX: usize = 8192;
/// Tiles along the side of a face, finest first: pixels of 0.6 to 7 degrees.
const TILES: [usize; 14] = [25, 22, 20, 18, 16, 14, 12, 10, 8, 6, 5, 4, 3, 2];
/// Bytes of an image before its tiles: how many there are along a side, and the unit of depths.
const HEAD_BYTES: usize = 1 + 4;
/// Depths in the image's unit are at most this.
const DEPTH_MAX: f32 = u16::MAX as f32;
/// How far from each other the points of a pixel may lie for it to count as seen, as the side of a pixel at depth 1: 1.4 degrees. What lies
/// between them is not looked at.
const SPACING_MAX: f32 = 0.025;
/// How much more coarser pixels have to tell, since they tell it less well.
const WORTHWHILE: f32 = 1.03;

/// How far a scan saw in each direction from its sensor: on the six faces of a cube around it, the depth along the face's
/// axis up to which nothing was in the way (paper III-B: free space is generated from the recorded poses and the sensor).
///
/// A pixel tells the nearest of the points seen in it, so that a direction is never said to be seen further than the nearest
/// surface there. Only tiles with something seen are kept: a camera spends its 8 kB on what it looks at.
#[derive(Clone, PartialEq)]
pub struct RangeImage {
    map: CubeMap,
    /// Meters of one unit of depth.
    unit_m: f32,
    /// For each tile of the cube its number among those that are kept.
    places: Vec<u16>,
    tiles: Vec<Tile>,
}

/// The place of a tile that is not kept.
const NOT_SEEN: u16 = u16::MAX;

/// Between which distances from the sensor a scan is believed to see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenRange {
    /// Points nearer than this say nothing: the robot itself, meters.
    pub min_m: f32,
    /// What is further away is seen up to here, meters.
    pub max_m: f32,
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
}

impl RangeImage {
    /// The image of at most `bytes_max` bytes of a scan of `points` (sensor frame, finite); none where nothing is seen in `range`.
    ///
    /// Pixels are as fine as that allows and as the points lie. Those in which the points lie far from each other are not seen.
    pub fn of_points(points: &[Point], range: SeenRange, bytes_max: usize) -> Option<Self> {
        let offsets: Vec<_> = points.iter().filter_map(|point| range.limited(point.xyz())).collect();
        if offsets.is_empty() {
            return None;
        }
        let depths = TILES.iter().map(|&tiles| NearestDepths::of(CubeMap::new(tiles), &offsets));
        let mut fitting = depths.filter(|depths| depths.touched_tiles() <= tiles_max(depths.map, bytes_max));
        let first = Self::of_depths(&fitting.next()?);
        // Coarser pixels tell more of a scan whose points lie further apart than the finest pixels.
        let coarser =
            fitting.take_while(|depths| depths.map.pitch() <= SPACING_MAX).map(|it| Self::of_depths(&it));
        let best = coarser.fold(first, Self::that_tells_more);
        (!best.tiles.is_empty()).then_some(best)
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

    fn of_depths(depths: &NearestDepths) -> Self {
        let map = depths.map;
        let unit_m = (depths.max() / DEPTH_MAX).max(f32::MIN_POSITIVE);
        let (mut places, mut tiles) = (vec![NOT_SEEN; map.tiles_of_all_faces()], Vec::new());
        for (tile, place) in places.iter_mut().enumerate() {
            let depths =
                depths.tile(tile).map(|depth| depth.map(|depth| (depth / unit_m).min(DEPTH_MAX) as u16));
            if depths.iter().any(Option::is_some) {
                *place = tiles.len() as u16;
                tiles.push(Tile::new(&depths));
            }
        }
        Self { map, unit_m, places, tiles }
    }

    /// True where the scan saw beyond the point at `offset` from the sensor, in its frame: the point was not hidden, and nothing
    /// was there.
    #[inline]
    pub fn sees_through(&self, offset: [f32; 3]) -> bool {
        self.map.project(offset).is_some_and(|Projection { face, pixel, depth_m }| {
            self.depth_m(face, pixel).is_some_and(|seen_m| depth_m < seen_m)
        })
    }

    /// True where the scan saw further than `margin_m` beyond the point at `offset` in its own pixel and in all that lie around it: no
    /// surface that is seen askew or in part is seen through so, nor what lies beside a rim.
    pub fn sees_well_beyond(&self, offset: [f32; 3], margin_m: f32) -> bool {
        let Some(Projection { face, pixel: [column, row], depth_m }) = self.map.project(offset) else {
            return false;
        };
        let last = self.map.pixels() - 1;
        // What lies across the edge of a face is not looked at: there nothing is seen well.
        let is_inside = (1..last).contains(&column) && (1..last).contains(&row);
        is_inside
            && (row - 1..=row + 1).all(|row| {
                (column - 1..=column + 1).all(|column| {
                    self.depth_m(face, [column, row]).is_some_and(|seen_m| depth_m + margin_m < seen_m)
                })
            })
    }

    /// How deep a pixel was seen, meters; none where it was not.
    #[inline(always)]
    fn depth_m(&self, face: usize, pixel: [usize; 2]) -> Option<f32> {
        let (tile, pixel) = self.map.place(face, pixel);
        let tile = self.tiles.get(usize::from(self.places[tile]))?;
        tile.depth(pixel).map(|depth| depth as f32 * self.unit_m)
    }

    /// The directions that were seen, each as the point up to which: offsets from the sensor in its frame, meters.
    pub fn seen(&self) -> impl Iterator<Item = [f32; 3]> {
        let side = self.map.pixels();
        let pixels =
            (0..FACES).flat_map(move |face| (0..side * side).map(move |i| (face, [i % side, i / side])));
        pixels.filter_map(|(face, pixel)| {
            let depth_m = self.depth_m(face, pixel)?;
            Some(self.map.direction(face, pixel).map(|c| c * depth_m))
        })
    }

    /// The side of a pixel at depth 1.
    pub fn pitch(&self) -> f32 {
        self.map.pitch()
    }

    /// Bytes of the image where it is stored.
    pub fn stored_bytes(&self) -> usize {
        stored_bytes(self.map, self.tiles.len())
    }

    /// Bytes of memory.
    pub fn memory_bytes(&self) -> usize {
        self.places.len() * size_of::<u16>() + self.tiles.len() * size_of::<Tile>()
    }

    /// The image as bytes: how many tiles there are along a side (1 byte), the unit of depths (f32), a bit for each tile of the
    /// six faces that says whether it is kept, and the tiles that are. All little-endian.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.stored_bytes());
        bytes.push(self.map.tiles() as u8);
        bytes.extend_from_slice(&self.unit_m.to_le_bytes());
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
        let Some((&[tiles, ref unit_m @ ..], rest)) = bytes.split_first_chunk::<HEAD_BYTES>() else {
            return Err(short);
        };
        let (tiles, unit_m) = (usize::from(tiles), f32::from_le_bytes(*unit_m));
        if tiles == 0 {
            return Err(RangeImageError::Tiles(tiles));
        }
        if !(unit_m > 0.0 && (unit_m * DEPTH_MAX).is_finite()) {
            return Err(RangeImageError::Unit(unit_m));
        }
        let map = CubeMap::new(tiles);
        let count = map.tiles_of_all_faces();
        let bits = &rest[..count.div_ceil(8).min(rest.len())];
        let is_kept = |tile: usize| bits.get(tile / 8).is_some_and(|byte| byte >> (tile % 8) & 1 == 1);
        let kept = (0..count).filter(|&tile| is_kept(tile)).count();
        let expected = stored_bytes(map, kept);
        if bytes.len() != expected {
            return Err(RangeImageError::Length { got: bytes.len(), expected });
        }
        let mut places = vec![NOT_SEEN; count];
        for (place, tile) in (0..count).filter(|&tile| is_kept(tile)).enumerate() {
            places[tile] = place as u16;
        }
        let (tiles, _) = rest[bits.len()..].as_chunks::<TILE_BYTES>();
        Ok(Self { map, unit_m, places, tiles: tiles.iter().map(Tile::read).collect() })
    }
}

impl std::fmt::Debug for RangeImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { map, unit_m, tiles, .. } = self;
        write!(f, "RangeImage {{ side: {}, unit_m: {unit_m}, tiles: {} }}", map.pixels(), tiles.len())
    }
}

impl SeenRange {
    /// The point at `offset` from the sensor, as far as it is seen; none of the robot itself, and of what is not finite.
    pub fn limited(self, offset: [f32; 3]) -> Option<[f32; 3]> {
        let squared = offset.iter().map(|c| c * c).sum::<f32>();
        if !(squared > 0.0 && squared >= self.min_m * self.min_m && squared.is_finite()) {
            return None;
        }
        let distance_m = squared.sqrt();
        let scale = (self.max_m / distance_m).min(1.0);
        Some(offset.map(|c| c * scale))
    }
}

/// Bytes of an image with `kept` tiles where it is stored.
fn stored_bytes(map: CubeMap, kept: usize) -> usize {
    HEAD_BYTES + map.tiles_of_all_faces().div_ceil(8) + kept * TILE_BYTES
}

/// Tiles that an image of at most `bytes` bytes can keep.
fn tiles_max(map: CubeMap, bytes: usize) -> usize {
    bytes.saturating_sub(stored_bytes(map, 0)) / TILE_BYTES
}

/// The depth of the nearest point in each pixel.
struct NearestDepths {
    map: CubeMap,
    /// Tile by tile; infinite where no point is.
    depths_m: Vec<f32>,
    /// How many points lie in each, up to the largest number of the type.
    points: Vec<u8>,
}

impl NearestDepths {
    fn of(map: CubeMap, offsets: &[[f32; 3]]) -> Self {
        let pixels = map.tiles_of_all_faces() * TILE_PIXELS;
        let (mut depths_m, mut points) = (vec![f32::INFINITY; pixels], vec![0u8; pixels]);
        for offset in offsets {
            if let Some(Projection { face, pixel, depth_m }) = map.project(*offset) {
                let (tile, pixel) = map.place(face, pixel);
                let (nearest, points) =
                    (&mut depths_m[tile * TILE_PIXELS + pixel], &mut points[tile * TILE_PIXELS + pixel]);
                *nearest = nearest.min(depth_m);
                *points = points.saturating_add(1);
            }
        }
        Self { map, depths_m, points }
    }

    fn touched_tiles(&self) -> usize {
        self.depths_m.chunks(TILE_PIXELS).filter(|tile| tile.iter().any(|depth| depth.is_finite())).count()
    }

    /// The largest depth, meters.
    fn max(&self) -> f32 {
        self.depths_m.iter().copied().filter(|depth| depth.is_finite()).fold(0.0, f32::max)
    }

    /// The depths of a tile's pixels. A pixel between two that were seen, beside or above each other, was seen as far as the nearer
    /// of them, and no farther than points of its own: points are not where pixels are.
    fn tile(&self, tile: usize) -> [Option<f32>; TILE_PIXELS] {
        let side = self.map.tiles();
        let (face, first) = (tile / (side * side), [tile % side * TILE_SIDE, tile / side % side * TILE_SIDE]);
        std::array::from_fn(|i| {
            let [column, row] = [first[0] + i % TILE_SIDE, first[1] + i / TILE_SIDE];
            let between =
                |a: [Option<usize>; 2], b: [Option<usize>; 2]| Some(self.at(face, a)?.min(self.at(face, b)?));
            let [before, after] = [column.checked_sub(1), column.checked_add(1)];
            let [below, above] = [row.checked_sub(1), row.checked_add(1)];
            self.at(face, [Some(column), Some(row)]).or_else(|| {
                let own_m = self.depths_m[tile * TILE_PIXELS + i];
                let beside = between([before, Some(row)], [after, Some(row)]);
                let over = between([Some(column), below], [Some(column), above]);
                beside.into_iter().chain(over).reduce(f32::min).map(|seen_m| seen_m.min(own_m))
            })
        })
    }

    /// Points of which one more lies in a pixel that counts as seen.
    fn points_before(&self) -> u8 {
        ((self.map.pitch() / SPACING_MAX).powi(2).ceil() as u8).saturating_sub(1)
    }

    /// The depth of a pixel that enough points are in.
    fn at(&self, face: usize, [column, row]: [Option<usize>; 2]) -> Option<f32> {
        let pixel = [column?, row?];
        if pixel.iter().any(|&i| i >= self.map.pixels()) {
            return None;
        }
        let (tile, pixel) = self.map.place(face, pixel);
        let pixel = tile * TILE_PIXELS + pixel;
        (self.points[pixel] > self.points_before()).then(|| self.depths_m[pixel])
    }
}
