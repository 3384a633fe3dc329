//! Small balls against the occupied cells of the field, which are its zeros: exact, and mostly in lines of memory that the
//! field's bounds were just read from.

use super::clearance::{FieldCluster, FieldLevel};
use super::cubes::SLACK;
use super::eight::COORDINATE_MAX;

/// Radius of the largest ball that is asked here, cells: beyond, blocks of voxels are faster.
const RADIUS_CELLS_MAX: f64 = 2.5;
/// Cells along an axis that such a ball may meet.
const CELLS: usize = 8;

/// Cells read one by one; neighbors are in one cluster more often than not.
struct CellReader<'a> {
    field: &'a FieldLevel,
    key: u64,
    cluster: Option<&'a FieldCluster>,
}

impl<'a> CellReader<'a> {
    fn new(field: &'a FieldLevel, index: [i32; 3]) -> Self {
        let key = FieldLevel::cluster_key(index);
        Self { field, key, cluster: field.cluster(key) }
    }

    /// The byte of a cell; none where it is not made.
    #[inline(always)]
    fn byte(&mut self, index: [i32; 3]) -> Option<u8> {
        let key = FieldLevel::cluster_key(index);
        if key != self.key {
            (self.key, self.cluster) = (key, self.field.cluster(key));
        }
        self.cluster?.byte(FieldLevel::block_place(index), FieldLevel::cell_place(index)).copied()
    }
}

/// The cells along an axis that a ball may meet: the first of them, how many, and the squared gap to each.
struct Along {
    first: i32,
    count: usize,
    squared: [f64; CELLS],
}

impl Along {
    #[inline(always)]
    fn of(center: f64, radius: f64) -> Self {
        let (first, last) = ((center - radius - SLACK).floor(), (center + radius + SLACK).floor());
        let mut squared = [0.0; CELLS];
        for (n, squared) in squared.iter_mut().enumerate() {
            let low = first + n as f64;
            let gap = (low - center).max(center - (low + 1.0)).max(0.0);
            *squared = gap * gap;
        }
        Self { first: first as i32, count: (last - first) as usize + 1, squared }
    }

    /// The cells whose gap alone is not too large.
    #[inline(always)]
    fn within(&self, squared_max: f64) -> impl Iterator<Item = (i32, f64)> {
        let cells = self.squared[..self.count.min(CELLS)].iter().enumerate();
        let cells = cells.map(|(n, squared)| (self.first + n as i32, *squared));
        cells.filter(move |(_, squared)| *squared <= squared_max)
    }
}

/// True where a ball meets an occupied cell, as `cubes` defines it. None of a ball that is too large or too far, and where
/// a part of the field that is needed is not made.
#[inline(always)]
pub(super) fn meets(field: &FieldLevel, center: [f64; 3], radius: f64) -> Option<bool> {
    if radius > RADIUS_CELLS_MAX || center.iter().any(|c| c.abs() >= COORDINATE_MAX) {
        return None;
    }
    let squared_max = radius * radius;
    let [xs, ys, zs] =
        [Along::of(center[0], radius), Along::of(center[1], radius), Along::of(center[2], radius)];
    let mut cells = CellReader::new(field, [xs.first, ys.first, zs.first]);
    for (z, zz) in zs.within(squared_max) {
        for (y, yy) in ys.within(squared_max) {
            for (x, xx) in xs.within(squared_max) {
                if (xx + yy) + zz <= squared_max && cells.byte([x, y, z])? == 0 {
                    return Some(true);
                }
            }
        }
    }
    Some(false)
}
