//! Depths of 8 x 8 pixels: two integers for all of them, and six bits each.

use crate::visibility::directions::TILE_SIDE;

/// Pixels of a tile.
pub(in crate::visibility) const TILE_PIXELS: usize = TILE_SIDE * TILE_SIDE;
/// Bits of a pixel when it is stored. Eight would tell depths better, but of fewer pixels: coarser ones tell less of a
/// scan all around than the rounding takes.
const PIXEL_BITS: usize = 6;
/// Bytes of a tile when it is stored.
pub(in crate::visibility) const TILE_BYTES: usize = 4 + TILE_PIXELS * PIXEL_BITS / 8;
/// Steps that a pixel's bits tell apart: 0 says that it was not seen.
const STEPS: u32 = (1 << PIXEL_BITS) - 2;
/// Bits that a tile's step takes when it is stored; the others of its two bytes are the tile's gap.
const STEP_BITS: u32 = 11;
const _: () = assert!((u16::MAX as u32).div_ceil(STEPS) < 1 << STEP_BITS, "every step has its bits");
/// Largest gap that is told, in [`GAP_UNIT`].
const GAPS: u8 = (1 << (16 - STEP_BITS)) - 1;
/// Steps of gaps, radians: a quarter of a degree, up to 8 degrees.
const GAP_UNIT: f32 = 0.0045;
/// Pixels whose bits make up whole bytes, and how many bytes.
const PACKED_PIXELS: usize = 4;
const PACKED_BYTES: usize = PACKED_PIXELS * PIXEL_BITS / 8;

/// Depths of the pixels of a tile, in the image's unit: pixel i was seen up to `base + step * (seen[i] - 1)`, or not at
/// all where `seen[i]` is 0.
///
/// Depths beside each other are alike, so that little is lost where they are rounded down: no more is said to be seen
/// than was.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::visibility) struct Tile {
    base: u16,
    step: u16,
    /// How far apart rays passed at most through what was seen of it, in [`GAP_UNIT`].
    gap: u8,
    seen: [u8; TILE_PIXELS],
}

impl Tile {
    /// A tile of depths in the image's unit, without gaps; none of pixels that were not seen.
    pub(in crate::visibility) fn new(depths: &[Option<u16>; TILE_PIXELS]) -> Self {
        let seen = || depths.iter().flatten().copied();
        let base = seen().min().unwrap_or(0);
        let step = u32::from(seen().max().unwrap_or(0) - base).div_ceil(STEPS).max(1) as u16;
        let byte = |depth: Option<u16>| depth.map_or(0, |depth| 1 + ((depth - base) / step) as u8);
        Self { base, step, gap: 0, seen: depths.map(byte) }
    }

    /// Tells of a gap between rays through what was seen of it, radians.
    pub(in crate::visibility) fn note_gap(&mut self, gap: f32) {
        self.gap = self.gap.max(((gap / GAP_UNIT).ceil() as u8).min(GAPS));
    }

    /// How deep a pixel was seen, in the image's unit; none where it was not.
    #[inline(always)]
    pub(in crate::visibility) fn depth(&self, pixel: usize) -> Option<u32> {
        let seen = u32::from(self.seen[pixel]);
        (seen > 0).then(|| u32::from(self.base) + u32::from(self.step) * (seen - 1))
    }

    /// How far apart rays passed at most through what was seen of it, radians.
    pub(in crate::visibility) fn gap(&self) -> f32 {
        f32::from(self.gap) * GAP_UNIT
    }

    /// By how much depths may have been rounded down, in the image's unit.
    pub(in crate::visibility) fn step(&self) -> u16 {
        self.step
    }

    /// How many pixels were seen.
    pub(in crate::visibility) fn seen_pixels(&self) -> usize {
        self.seen.iter().filter(|seen| **seen > 0).count()
    }

    pub(in crate::visibility) fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(&self.base.to_le_bytes());
        bytes.extend_from_slice(&(u16::from(self.gap) << STEP_BITS | self.step).to_le_bytes());
        for pixels in self.seen.as_chunks::<PACKED_PIXELS>().0 {
            let packed = pixels.iter().rev().fold(0, |packed, &seen| packed << PIXEL_BITS | u32::from(seen));
            bytes.extend_from_slice(&packed.to_le_bytes()[..PACKED_BYTES]);
        }
    }

    pub(in crate::visibility) fn read(bytes: &[u8; TILE_BYTES]) -> Self {
        let [b0, b1, s0, s1, packed @ ..] = bytes;
        let packed = packed.as_chunks::<PACKED_BYTES>().0;
        let seen = std::array::from_fn(|pixel| {
            let [b0, b1, b2] = packed[pixel / PACKED_PIXELS];
            let word = u32::from_le_bytes([b0, b1, b2, 0]);
            (word >> (pixel % PACKED_PIXELS * PIXEL_BITS)) as u8 & ((1 << PIXEL_BITS) - 1)
        });
        let gap_and_step = u16::from_le_bytes([*s0, *s1]);
        let (gap, step) = ((gap_and_step >> STEP_BITS) as u8, gap_and_step & ((1 << STEP_BITS) - 1));
        Self { base: u16::from_le_bytes([*b0, *b1]), step, gap, seen }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_that_are_alike_are_told_to_the_unit() {
        let depths = std::array::from_fn(|i| (i % 5 != 0).then_some(7000 + i as u16));
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
        for gap in [0.0, 0.004, 0.05, 9.0] {
            let mut tile = Tile::new(&std::array::from_fn(|i| (i % 3 == 0).then_some(i as u16 * 900)));
            tile.note_gap(gap);
            let mut bytes = Vec::new();
            tile.write(&mut bytes);
            assert_eq!(Tile::read(bytes.as_slice().try_into().unwrap()), tile);
            // No narrower than it is, but for those wider than what is told.
            assert!(
                tile.gap() >= gap.min(0.139) && tile.gap() < gap + 0.0046,
                "{gap} was told as {}",
                tile.gap()
            );
        }
    }
}
