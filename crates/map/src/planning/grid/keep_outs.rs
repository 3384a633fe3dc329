//! Keep-outs from above: a cell that has a point of one in the band is occupied.

use hashbrown::HashMap;

use super::cells::{Cells, WHOLE_WITHIN};
use super::occupancy_grid::Grid;
use super::projection::Projection;
use crate::map::Outline;
use crate::planning::keep_outs::Shapes;
use crate::util::StopSignal;

impl Projection<'_> {
    /// Marks the cells of `grid`, which are `cells`, that have a point of a shape between the heights of the band or on
    /// them: above a floor between the lowest and the highest that the band has in the cell.
    pub(super) fn mark_keep_outs(
        &self,
        shapes: &Shapes<'_>,
        cells: &Cells,
        grid: &mut Grid,
        band_m: [f64; 2],
        stop: StopSignal<'_>,
    ) {
        for shape in shapes.iter().map(|of| &of.keep_out.shape) {
            let mut outlines = HashMap::new();
            let Some(outline) = shape.outline(self.above(band_m, self.base_range())) else { continue };
            let [xs, ys] = spans(&outline, cells, grid.cell_m);
            for y in stop.paced(ys, 1) {
                for x in xs.clone() {
                    let number = cells.number([x, y]).filter(|number| !grid.is_occupied(*number));
                    let Some(number) = number else { continue };
                    let bases = self.bases_of([x, y]);
                    let outline =
                        outlines.entry(bases).or_insert_with(|| shape.outline(self.above(band_m, bases)));
                    if outline.as_ref().is_some_and(|outline| meets(outline, [x, y], grid.cell_m)) {
                        grid.occupied[number / 64] |= 1 << (number % 64);
                    }
                }
            }
        }
    }

    /// The band of the map frame that begins above the lowest of these heights and ends above the highest.
    fn above(&self, band_m: [f64; 2], bases: [i32; 2]) -> [f64; 2] {
        [0, 1].map(|end| band_m[end] + f64::from(bases[end]) * self.voxel_m)
    }

    /// The lowest and the highest height that the band counts from in a cell.
    fn bases_of(&self, cell: [i64; 2]) -> [i32; 2] {
        if self.base_range() == [0; 2] {
            return [0; 2];
        }
        let columns = |axis: usize| {
            let [first, end] = [cell[axis], cell[axis] + 1].map(|at| at.saturating_mul(self.cell_voxels));
            first as i32..end as i32
        };
        let all = columns(1).flat_map(|y| columns(0).map(move |x| self.base([x, y]).height));
        all.fold([i32::MAX, i32::MIN], |[low, high], base| [low.min(base), high.max(base)])
    }
}

/// The cells along x and y that an outline may meet.
fn spans(outline: &Outline, cells: &Cells, cell_m: f64) -> [std::ops::Range<i64>; 2] {
    let (low_m, high_m) = outline.bounds_m();
    std::array::from_fn(|axis| {
        let (first, end) = (cells.first[axis], cells.end[axis]);
        // One more on each side, whatever the rounding; a conversion keeps to what a number can hold.
        let low = ((low_m[axis] / cell_m).floor() as i64).saturating_sub(1);
        let high = ((high_m[axis] / cell_m).floor() as i64).saturating_add(2);
        low.clamp(first, end)..high.clamp(first, end)
    })
}

/// True where an outline has a point of a cell. What lies on a border belongs to the upper cell, as points on it do,
/// and nearly on it counts as on it.
fn meets(outline: &Outline, cell: [i64; 2], cell_m: f64) -> bool {
    let corner = |offset: f64| cell.map(|c| (c as f64 + offset - WHOLE_WITHIN) * cell_m);
    outline.meets(corner(0.0), corner(1.0 - WHOLE_WITHIN))
}
