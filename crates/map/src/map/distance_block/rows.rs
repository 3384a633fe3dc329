//! Rows of squares of distances.

use std::ops::RangeInclusive;

/// Four times the square of a distance, in cells, beyond every cap: the distance is 63.99 cells.
pub(super) const FAR: i16 = 16_383;

/// Rows of four times the squares of distances, in cells, and which of them have any below [`FAR`].
#[derive(Debug)]
pub(super) struct Rows {
    squares: Vec<i16>,
    /// Squares of a row.
    length: usize,
    is_near: Vec<bool>,
}

/// Four times the square of the distance from a cell's center to a cube so many cells away along an axis.
pub(super) fn square_of(cells: usize) -> i16 {
    let twice = (2 * cells).saturating_sub(1);
    i16::try_from(twice * twice).map_or(FAR, |square| square.min(FAR))
}

impl Rows {
    /// So many rows, all of them far.
    pub(super) fn far(rows: usize, length: usize) -> Self {
        Self { squares: vec![FAR; rows * length], length, is_near: vec![false; rows] }
    }

    /// A row; none where all of it is far.
    pub(super) fn near(&self, row: usize) -> Option<&[i16]> {
        self.is_near[row].then(|| self.row(row))
    }

    /// A row.
    pub(super) fn row(&self, row: usize) -> &[i16] {
        &self.squares[row * self.length..][..self.length]
    }

    /// A row to write near squares into.
    pub(super) fn row_mut(&mut self, row: usize) -> &mut [i16] {
        self.is_near[row] = true;
        &mut self.squares[row * self.length..][..self.length]
    }

    /// Makes a row far.
    pub(super) fn clear(&mut self, row: usize) {
        if self.is_near[row] {
            self.row_mut(row).fill(FAR);
            self.is_near[row] = false;
        }
    }

    /// Lowers a row to the least of what it has, and the rows `among` of `from` with the square of the way to each: the
    /// one in the middle is where this row is. `place` says where a row lies in `from`.
    pub(super) fn lower(
        &mut self,
        row: usize,
        from: &Self,
        among: RangeInclusive<usize>,
        place: impl Fn(usize) -> usize,
    ) {
        let middle = among.start().midpoint(*among.end());
        for other in among {
            if let Some(squares) = from.near(place(other)) {
                lower(self.row_mut(row), squares, square_of(other.abs_diff(middle)));
            }
        }
    }
}

/// Lowers each square to another one and what is added to that.
fn lower(squares: &mut [i16], others: &[i16], added: i16) {
    for (square, other) in squares.iter_mut().zip(others) {
        *square = (*square).min(other.saturating_add(added));
    }
}
