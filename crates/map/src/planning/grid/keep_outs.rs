//! Keep-outs from above: a cell that has a point of one in the band is occupied.

use super::cells::{Cells, WHOLE_WITHIN};
use super::occupancy_grid::Grid;
use crate::map::Outline;
use crate::planning::keep_outs::Shapes;
use crate::util::StopSignal;

/// Marks the cells of `grid`, which are `cells`, that have a point of a shape between the heights of the band or on
/// them.
pub(super) fn mark(
    shapes: &Shapes<'_>,
    cells: &Cells,
    grid: &mut Grid,
    band_m: [f64; 2],
    stop: StopSignal<'_>,
) {
    for outline in shapes.iter().filter_map(|of| of.keep_out.shape.outline(band_m)) {
        let [xs, ys] = spans(&outline, cells, grid.cell_m);
        for y in stop.paced(ys, 1) {
            for x in xs.clone() {
                let number = cells.number([x, y]).filter(|number| !grid.is_occupied(*number));
                if let Some(number) = number.filter(|_| meets(&outline, [x, y], grid.cell_m)) {
                    grid.occupied[number / 64] |= 1 << (number % 64);
                }
            }
        }
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
