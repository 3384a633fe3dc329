//! Balls against the occupied cells of the field, which are its zeros: exact, and mostly in lines of memory that the
//! field's bounds were just read from.

use super::block::LINE_BYTES;
use super::cluster::FieldCluster;
use super::cube_search::SLACK;
use super::eight_points::COORDINATE_MAX;
use super::level::FieldLevel;
use crate::util::bits::any_bit;

/// Radius of the largest ball that is asked here, cells: beyond, blocks of voxels are faster.
const RADIUS_CELLS_MAX: f64 = 5.0;
/// Cells along an axis of a line of memory.
const LINE: usize = 4;
/// Lines along an axis that such a ball may meet.
const LINES: usize = 4;

/// Lines read one by one; neighbors are in one cluster more often than not.
struct LineReader<'a> {
    field: &'a FieldLevel,
    key: u64,
    cluster: Option<&'a FieldCluster>,
}

impl<'a> LineReader<'a> {
    fn new(field: &'a FieldLevel, index: [i32; 3]) -> Self {
        let key = FieldLevel::cluster_key(index);
        Self { field, key, cluster: field.cluster(key) }
    }

    /// The line of a cell; none where it is not made.
    #[inline(always)]
    fn line(&mut self, index: [i32; 3]) -> Option<&'a [u8; LINE_BYTES]> {
        let key = FieldLevel::cluster_key(index);
        if key != self.key {
            (self.key, self.cluster) = (key, self.field.cluster(key));
        }
        self.cluster?.line(FieldLevel::block_place(index), FieldLevel::cell_place(index))
    }
}

/// The lines along an axis that a ball may meet: the first cell of them, how many, the squared gap to each cell, and
/// the smallest to one of each line.
struct Along {
    first: i32,
    count: usize,
    squared: [[f64; LINE]; LINES],
    least: [f64; LINES],
}

impl Along {
    #[inline(always)]
    fn of(center: f64, radius: f64) -> Self {
        let [first, last] = [center - radius - SLACK, center + radius + SLACK].map(|c| c.floor() as i32 >> 2);
        let (mut squared, mut least) = ([[0.0; LINE]; LINES], [0.0; LINES]);
        for line in 0..LINES {
            for (cell, squared) in squared[line].iter_mut().enumerate() {
                let low = f64::from(first * LINE as i32 + (line * LINE + cell) as i32);
                let gap = (low - center).max(center - (low + 1.0)).max(0.0);
                *squared = gap * gap;
            }
            let [a, b, c, d] = squared[line];
            least[line] = a.min(b).min(c.min(d));
        }
        Self { first: first * LINE as i32, count: (last - first) as usize + 1, squared, least }
    }

    /// The lines that are not too far along this axis alone: the place of each, and its first cell.
    #[inline(always)]
    fn within(&self, squared_max: f64) -> impl Iterator<Item = (usize, i32)> {
        let lines = (0..self.count.min(LINES)).filter(move |&line| self.least[line] <= squared_max);
        lines.map(|line| (line, self.first + (line * LINE) as i32))
    }
}

/// What the cells of the field say of a ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::planning) enum BallState {
    /// It meets an occupied one.
    Meets,
    /// It meets none.
    IsFree,
    /// The ball is too large, or too far away.
    Unknown,
    /// The field is not made around this cell.
    Unmade([i32; 3]),
}

/// Whether a ball meets an occupied cell, as `cube_search` defines it.
#[inline(always)]
pub(in crate::planning) fn ask(field: &FieldLevel, center: [f64; 3], radius: f64) -> BallState {
    if radius > RADIUS_CELLS_MAX || center.iter().any(|c| c.abs() >= COORDINATE_MAX) {
        return BallState::Unknown;
    }
    let squared_max = radius * radius;
    let [xs, ys, zs] =
        [Along::of(center[0], radius), Along::of(center[1], radius), Along::of(center[2], radius)];
    let mut lines = LineReader::new(field, [xs.first, ys.first, zs.first]);
    for (line_z, z) in zs.within(squared_max) {
        for (line_y, y) in ys.within(squared_max) {
            for (line_x, x) in xs.within(squared_max) {
                if (xs.least[line_x] + ys.least[line_y]) + zs.least[line_z] > squared_max {
                    continue;
                }
                let gaps = [&xs.squared[line_x], &ys.squared[line_y], &zs.squared[line_z]];
                match lines.line([x, y, z]) {
                    None => return BallState::Unmade([x, y, z]),
                    Some(line) if line_meets(line, gaps, squared_max) => return BallState::Meets,
                    Some(_) => {}
                }
            }
        }
    }
    BallState::IsFree
}

/// True where a cell of the line is occupied and the squared gaps to it are not too large.
#[inline(always)]
fn line_meets(line: &[u8; LINE_BYTES], [xs, ys, zs]: [&[f64; LINE]; 3], squared_max: f64) -> bool {
    any_bit(zeros(line), |cell| {
        let [x, y, z] = [cell & 3, cell >> 2 & 3, cell >> 4 & 3].map(|i| i as usize);
        (xs[x] + ys[y]) + zs[z] <= squared_max
    })
}

/// The places of the bytes that are zero.
#[inline(always)]
fn zeros(line: &[u8; LINE_BYTES]) -> u64 {
    let mut zeros = 0;
    for (place, byte) in line.iter().enumerate() {
        zeros |= u64::from(*byte == 0) << place;
    }
    zeros
}
