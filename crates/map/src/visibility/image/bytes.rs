//! The bytes of a range image, as it is stored.

use super::layout::{HEAD_BYTES, stored_bytes};
use super::range_image::{DEPTH_MAX, NOT_SEEN, RangeImage, RaySpacing};
use super::tile::{TILE_BYTES, Tile};
use crate::visibility::directions::CubeMap;
use crate::visibility::thresholds::Thresholds;

/// Says in an image's first byte that its head tells how the rays lay. The first images did not.
const TELLS_RAYS: u8 = 0x80;
/// Says in an image's first byte that a number is behind its head: from where on nothing was met.
const TELLS_OPEN: u8 = 0x40;
/// Bytes of that number.
const OPEN_BYTES: usize = 4;
/// Bytes of what their heads did not tell.
const RAYS_BYTES: usize = 2 * 4;

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
    /// Bytes of the image where it is stored.
    pub fn stored_bytes(&self) -> usize {
        stored_bytes(self.map, self.tiles.len()) + if self.tells_open() { OPEN_BYTES } else { 0 }
    }

    /// True where some of its rays ran on.
    fn tells_open(&self) -> bool {
        self.open_m.is_finite()
    }

    /// The image as bytes: how many tiles there are along a side and 128 (1 byte; and 64 where rays ran on), the unit
    /// of depths (f32), how far the sensor moved in meters (f32) and how far apart the rays lay at depth 1 (f32), from
    /// where on nothing was met in meters (f32; where rays ran on), a bit for each tile of the six faces that says
    /// whether it is kept, and the tiles that are. All little-endian. The first images, without the 128, told nothing
    /// of their rays.
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
            RaySpacing::from_bytes(rest).ok_or_else(|| short.clone())?
        } else {
            (RaySpacing::NOT_TOLD, rest)
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
        let RaySpacing { moved_m, spacing } = rays;
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

impl RaySpacing {
    /// What is taken of the first images: a sensor that stood, and rays as far apart as they may lie in a pixel.
    const NOT_TOLD: Self = Self { moved_m: 0.0, spacing: Thresholds::DEFAULT.spacing_max };

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
