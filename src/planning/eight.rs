//! The look-up in the clearance field: eight points at a time, lower and upper bounds of their distances out.
//!
//! Plain arrays that the compiler turns into vector instructions, as wide as the CPU has them.

use super::clearance::{FAR, FieldLevel};

/// Points that are looked up at once.
pub(super) const LANES: usize = 8;
/// What f32 rounding may do to a bound, in cells of the field.
const ROUNDING: f32 = 1e-5;
/// Coordinates up to here, either way, have blocks with neighbors on all sides.
pub(super) const COORDINATE_MAX: f64 = ((1 << 20) - 64) as f64;

/// Eight points in cells of a level, axis by axis.
pub(super) type Centers = [[f64; LANES]; 3];

/// Bounds of the distances from eight points to the nearest voxel, in cells of the field.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub(super) lower: [f32; LANES],
    /// Infinite where nothing is known.
    pub(super) upper: [f32; LANES],
    /// The lanes in which the field is not made; their bounds are zero and infinity.
    pub(super) unmade: u8,
}

/// The cells that eight points fall in, or neighbors where they are near a border; and how far from the cells' middles they
/// are, rounded up.
struct Cells {
    index: [[i32; LANES]; 3],
    off_middle: [f32; LANES],
    is_in_range: [bool; LANES],
}

impl Cells {
    #[inline(always)]
    fn of(centers: &Centers, scale: f64) -> Self {
        // A sum that is this large has no room for fractions: its lowest bits are a whole number.
        const WHOLE: f64 = (3u64 << 51) as f64;
        let (mut index, mut squared, mut is_in_range) = ([[0; LANES]; 3], [0f32; LANES], [true; LANES]);
        for axis in 0..3 {
            for lane in 0..LANES {
                let c = centers[axis][lane] * scale;
                is_in_range[lane] &= c.abs() < COORDINATE_MAX;
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
        Self { index, off_middle, is_in_range }
    }
}

/// Looks eight points up in the field of a level whose cells are 1 / `scale` of those in which the points are counted.
#[inline(always)]
pub(super) fn bounds(field: &FieldLevel, centers: &Centers, scale: f64) -> Bounds {
    let cells = Cells::of(centers, scale);
    let (bytes, unmade) = bytes(field, &cells);
    let (mut lower, mut upper) = ([0f32; LANES], [0f32; LANES]);
    for lane in 0..LANES {
        let distance = f32::from(bytes[lane]).sqrt() * 0.5;
        lower[lane] = distance - cells.off_middle[lane];
        upper[lane] = if bytes[lane] == FAR { f32::INFINITY } else { distance + cells.off_middle[lane] };
    }
    for lane in 0..LANES {
        if unmade >> lane & 1 == 1 {
            (lower[lane], upper[lane]) = (0.0, f32::INFINITY);
        }
    }
    Bounds { lower, upper, unmade }
}

/// The bytes of eight cells, and the lanes in which the field is not made.
#[inline(always)]
fn bytes(field: &FieldLevel, cells: &Cells) -> ([u8; LANES], u8) {
    let (mut keys, mut blocks, mut places) = ([0; LANES], [0; LANES], [0; LANES]);
    for lane in 0..LANES {
        let index = [0, 1, 2].map(|axis: usize| cells.index[axis][lane]);
        keys[lane] = FieldLevel::cluster_key(index);
        blocks[lane] = FieldLevel::block_place(index);
        places[lane] = FieldLevel::cell_place(index);
    }
    let (mut bytes, mut unmade) = ([0; LANES], 0);
    // Neighboring points lie in one cluster more often than not.
    let (mut last, mut cluster) = (keys[0], field.cluster(keys[0]));
    for lane in 0..LANES {
        if keys[lane] != last {
            (last, cluster) = (keys[lane], field.cluster(keys[lane]));
        }
        let byte = cluster.and_then(|cluster| cluster.byte(blocks[lane], places[lane]));
        match byte.filter(|_| cells.is_in_range[lane]) {
            Some(byte) => bytes[lane] = byte,
            None => unmade |= 1 << lane,
        }
    }
    (bytes, unmade)
}

/// The index of the field's cell that lane `lane` falls in; none where it is out of range.
pub(super) fn cell(centers: &Centers, scale: f64, lane: usize) -> Option<[i32; 3]> {
    let cells = Cells::of(centers, scale);
    cells.is_in_range[lane].then(|| [0, 1, 2].map(|axis| cells.index[axis][lane]))
}
