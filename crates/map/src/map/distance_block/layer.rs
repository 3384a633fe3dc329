//! One layer along z: what is occupied in it, and how far that is within each row.

use super::rows::{FAR, Rows, square_of};

/// A layer of the box and the margin around it.
#[derive(Debug)]
pub(super) struct Layer {
    /// A byte a cell, the margins among them, x fastest; 1 where it is occupied.
    occupied: Vec<u8>,
    /// Cells of a row, the margins among them.
    width: usize,
    margin: usize,
    has_occupied: Vec<bool>,
    /// The squares of the box's own cells.
    rows: Rows,
}

impl Layer {
    /// A layer of rows of `length` cells, with a margin at both ends, in which nothing is occupied.
    pub(super) fn empty(rows: usize, length: usize, margin: usize) -> Self {
        let width = length + 2 * margin;
        let (occupied, has_occupied) = (vec![0; rows * width], vec![false; rows]);
        Self { occupied, width, margin, has_occupied, rows: Rows::far(rows, length) }
    }

    /// Frees all cells.
    pub(super) fn clear(&mut self) {
        for row in 0..self.has_occupied.len() {
            if std::mem::take(&mut self.has_occupied[row]) {
                self.occupied[row * self.width..][..self.width].fill(0);
                self.rows.clear(row);
            }
        }
    }

    /// Occupies a cell, where the layer has it.
    pub(super) fn occupy(&mut self, x: usize, row: usize) {
        if x < self.width && row < self.has_occupied.len() {
            self.occupied[row * self.width + x] = 1;
            self.has_occupied[row] = true;
        }
    }

    /// The squares of the distances within each row.
    pub(super) fn measured(&mut self) -> &Rows {
        for row in (0..self.has_occupied.len()).filter(|&row| self.has_occupied[row]) {
            let occupied = &self.occupied[row * self.width..][..self.width];
            measure(occupied, self.margin, self.rows.row_mut(row));
        }
        &self.rows
    }
}

/// Puts into `squares` how far each cell is from the nearest occupied one, of a row with a margin at both ends.
fn measure(occupied: &[u8], margin: usize, squares: &mut [i16]) {
    let own = margin..margin + squares.len();
    squares.fill(FAR);
    let mut lower = |x: usize, away: &mut usize| {
        *away = if occupied[x] == 0 { away.saturating_add(1) } else { 0 };
        if own.contains(&x) && *away <= margin {
            let square = &mut squares[x - margin];
            *square = (*square).min(square_of(*away));
        }
    };
    let mut away = usize::MAX;
    (0..occupied.len()).for_each(|x| lower(x, &mut away));
    let mut away = usize::MAX;
    (0..occupied.len()).rev().for_each(|x| lower(x, &mut away));
}
