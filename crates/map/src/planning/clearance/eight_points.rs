//! The look-up in the clearance field: eight points at a time, lower and upper bounds of their distances out.
//!
//! Plain arrays that the compiler turns into vector instructions, as wide as the CPU has them.

use super::block::FAR;
use super::level::FieldLevel;
use crate::util::prefetch;

/// Points that are looked up at once.
pub(in crate::planning) const LANES: usize = 8;
/// What f32 rounding may do to a bound, in cells of the field.
const ROUNDING: f32 = 1e-5;
/// Coordinates up to here, either way, have blocks with neighbors on all sides.
pub(super) const COORDINATE_MAX: f64 = ((1 << 20) - 64) as f64;

/// Eight points in cells of a level, axis by axis.
pub(in crate::planning) type Centers = [[f64; LANES]; 3];

/// Bounds of the distances from eight points to the nearest voxel, in cells of the field; zero and infinity where
/// nothing is known.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Bounds {
    pub(in crate::planning) lower: [f32; LANES],
    /// Infinite where nothing is known.
    pub(in crate::planning) upper: [f32; LANES],
}

/// The cells that eight points fall in, or neighbors where they are near a border; and how far from the cells' middles
/// they are, rounded up.
struct Cells {
    index: [[i32; LANES]; 3],
    off_middle: [f32; LANES],
    /// The lanes that are out of range, where all else means nothing.
    out_of_range: u8,
}

impl Cells {
    #[inline(always)]
    fn of(centers: &Centers, scale: f64) -> Self {
        // A sum that is this large has no room for fractions: its lowest bits are a whole number.
        const WHOLE: f64 = (3u64 << 51) as f64;
        let (mut index, mut squared, mut largest) = ([[0; LANES]; 3], [0f32; LANES], [0f64; LANES]);
        for axis in 0..3 {
            for lane in 0..LANES {
                let c = centers[axis][lane] * scale;
                largest[lane] = if c.abs() > largest[lane] { c.abs() } else { largest[lane] };
                let sum = (c - 0.5) + WHOLE;
                index[axis][lane] = sum.to_bits() as i32;
                let off = ((c - 0.5) - (sum - WHOLE)) as f32;
                squared[lane] += off * off;
            }
        }
        let mut off_middle = [0f32; LANES];
        for lane in 0..LANES {
            off_middle[lane] = squared[lane].sqrt() + ROUNDING;
        }
        let mut out_of_range = 0u32;
        for (lane, largest) in largest.iter().enumerate() {
            out_of_range |= u32::from(*largest >= COORDINATE_MAX) << lane;
        }
        Self { index, off_middle, out_of_range: out_of_range as u8 }
    }
}

/// Where the field says of eight points how far the nearest voxel is: found, and not read yet.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Found<'f> {
    bytes: [&'f u8; LANES],
    off_middle: [f32; LANES],
    /// The lanes in which the field is not made, or that are out of range: nothing is known of them.
    pub(in crate::planning) unknown: u8,
}

/// Stands for bytes that are not made.
static UNMADE: u8 = 0;

impl Found<'_> {
    /// Nothing was looked for yet.
    pub(in crate::planning) const NOTHING: Self =
        Self { bytes: [&UNMADE; LANES], off_middle: [0.0; LANES], unknown: 0 };
}

/// Finds eight points in the field of a level whose cells are 1 / `scale` of those in which the points are counted.
///
/// What [`Found::bounds`] reads is fetched. Into `found`, where it stays: lane by lane written and copied as a whole,
/// it would be waited for.
#[inline(always)]
pub(in crate::planning) fn find<'f>(
    field: &'f FieldLevel,
    centers: &Centers,
    scale: f64,
    found: &mut Found<'f>,
) {
    let cells = Cells::of(centers, scale);
    let (mut keys, mut blocks, mut places) = ([0; LANES], [0; LANES], [0; LANES]);
    for lane in 0..LANES {
        let index = [cells.index[0][lane], cells.index[1][lane], cells.index[2][lane]];
        keys[lane] = FieldLevel::cluster_key(index);
        blocks[lane] = FieldLevel::block_place(index);
        places[lane] = FieldLevel::cell_place(index);
    }
    let mut unknown = cells.out_of_range;
    // Neighboring points lie in one cluster more often than not.
    let (mut last, mut cluster) = (keys[0], field.cluster(keys[0]));
    for lane in 0..LANES {
        if keys[lane] != last {
            (last, cluster) = (keys[lane], field.cluster(keys[lane]));
        }
        found.bytes[lane] = match cluster.and_then(|cluster| cluster.byte(blocks[lane], places[lane])) {
            Some(byte) => {
                prefetch(byte);
                byte
            }
            None => {
                unknown |= 1 << lane;
                &UNMADE
            }
        };
    }
    (found.off_middle, found.unknown) = (cells.off_middle, unknown);
}

impl Found<'_> {
    /// What the field says.
    #[inline(always)]
    pub(in crate::planning) fn bounds(&self) -> Bounds {
        // One number of all bytes: taken one by one, each would be put into its lane by itself.
        let mut all = 0u64;
        for lane in 0..LANES {
            all |= u64::from(*self.bytes[lane]) << (8 * lane);
        }
        let bytes = all.to_le_bytes();
        let (mut lower, mut upper) = ([0f32; LANES], [0f32; LANES]);
        for lane in 0..LANES {
            let distance = f32::from(bytes[lane]).sqrt() * 0.5;
            lower[lane] = distance - self.off_middle[lane];
            upper[lane] = if bytes[lane] == FAR { f32::INFINITY } else { distance + self.off_middle[lane] };
        }
        if self.unknown != 0 {
            for lane in (0..LANES).filter(|lane| self.unknown >> lane & 1 == 1) {
                (lower[lane], upper[lane]) = (0.0, f32::INFINITY);
            }
        }
        Bounds { lower, upper }
    }
}

/// The lanes whose value has a minus.
#[inline(always)]
pub(in crate::planning) fn lanes_below_zero(values: &[f32; LANES]) -> u8 {
    let mut lanes = 0u32;
    for (lane, value) in values.iter().enumerate() {
        lanes |= value.to_bits() >> 31 << lane;
    }
    lanes as u8
}

/// The index of the field's cell that lane `lane` falls in; none where it is out of range.
pub(in crate::planning) fn cell(centers: &Centers, scale: f64, lane: usize) -> Option<[i32; 3]> {
    let cells = Cells::of(centers, scale);
    (cells.out_of_range >> lane & 1 == 0).then(|| [0, 1, 2].map(|axis| cells.index[axis][lane]))
}

/// The center in one lane.
#[inline(always)]
pub(in crate::planning) fn lane_of(centers: &Centers, lane: usize) -> [f64; 3] {
    [0, 1, 2].map(|axis: usize| centers[axis][lane])
}
