//! Depths of 8 x 8 pixels: an integer for all of them, and a byte each.

use super::cube_map::TILE_SIDE;

/// Pixels of a tile.
pub(super) const TILE_PIXELS: usize = TILE_SIDE * TILE_SIDE;
/// Bytes of a tile when it is stored.
pub(super) const TILE_BYTES: usize = 4 + TILE_PIXELS;
/// Steps that a byte tells apart: 0 says that the pixel was not seen.
const STEPS: u32 = 254;

/// Depths of the pixels of a tile, in the image's unit: pixel i was seen up to `base + step * (seen[i] - 1)`, or not at all where
/// `seen[i]` is 0.
///
/// Depths beside each other are alike, so that a byte each mostly tells them to the unit; where they are not, they are
/// rounded down: no more is said to be seen than was.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Tile {
    base: u16,
    step: u16,
    seen: [u8; TILE_PIXELS],
}

impl Tile {
    /// A tile of depths in the image's unit; none of pixels that were not seen.
    pub(super) fn new(depths: &[Option<u16>; TILE_PIXELS]) -> Self {
        let seen = || depths.iter().flatten().copied();
        let base = seen().min().unwrap_or(0);
        let step = u32::from(seen().max().unwrap_or(0) - base).div_ceil(STEPS).max(1) as u16;
        let byte = |depth: Option<u16>| depth.map_or(0, |depth| 1 + ((depth - base) / step) as u8);
        Self { base, step, seen: depths.map(byte) }
    }

    /// How deep a pixel was seen, in the image's unit; none where it was not.
    #[inline(always)]
    pub(super) fn depth(&self, pixel: usize) -> Option<u32> {
        let seen = u32::from(self.seen[pixel]);
        (seen > 0).then(|| u32::from(self.base) + u32::from(self.step) * (seen - 1))
    }

    /// How many pixels were seen.
    pub(super) fn seen_pixels(&self) -> usize {
        self.seen.iter().filter(|seen| **seen > 0).count()
    }

    pub(super) fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(&self.base.to_le_bytes());
        bytes.extend_from_slice(&self.step.to_le_bytes());
        bytes.extend_from_slice(&self.seen);
    }

    pub(super) fn read(bytes: &[u8; TILE_BYTES]) -> Self {
        let [b0, b1, s0, s1, seen @ ..] = *bytes;
        Self { base: u16::from_le_bytes([b0, b1]), step: u16::from_le_bytes([s0, s1]), seen }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_that_are_alike_are_told_to_the_unit() {
        let depths = std::array::from_fn(|i| (i % 5 != 0).then_some(7000 + i as u16 * 4));
        let tile = Tile::new(&depths);
        for (pixel, depth) in depths.iter().enumerate() {
            assert_eq!(tile.depth(pixel), depth.map(u32::from));
        }
    }

    #[test]
    fn depths_far_from_each_other_are_rounded_down_by_less_than_a_step() {
        let depths =
            std::array::from_fn(|i| Some(if i % 2 == 0 { i as u16 } else { u16::MAX - i as u16 * 31 }));
        let tile = Tile::new(&depths);
        for (pixel, depth) in depths.iter().flatten().enumerate() {
            let told = tile.depth(pixel).unwrap();
            let lost = u32::from(*depth) - told;
            assert!(lost <= u32::from(u16::MAX) / STEPS + 1, "{depth} was told as {told}");
        }
    }

    #[test]
    fn a_tile_comes_back_from_its_bytes() {
        let tile = Tile::new(&std::array::from_fn(|i| (i % 3 == 0).then_some(i as u16 * 900)));
        let mut bytes = Vec::new();
        tile.write(&mut bytes);
        assert_eq!(Tile::read(bytes.as_slice().try_into().unwrap()), tile);
    }
}
