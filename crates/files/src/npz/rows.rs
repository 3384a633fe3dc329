//! The rows of an array of shape (n, 3), read part by part.

use std::io::Read;

use mrol_map::scan::ArrayHeader;

use super::error::NpzError;

/// Bytes in which the header of an array ends.
const HEADER_BYTES_MAX: u64 = 64 << 10;
/// Rows that are given out at once.
const ROWS_AT_ONCE: usize = 1 << 14;

/// An array that is read.
pub(super) struct Rows<R> {
    name: &'static str,
    pub(super) header: ArrayHeader,
    /// Bytes of the first numbers, which were read with the header.
    first: Vec<u8>,
    file: R,
}

impl<R: Read> Rows<R> {
    /// The array that a file begins with.
    pub(super) fn of(name: &'static str, mut file: R) -> Result<Self, NpzError> {
        let mut start = Vec::new();
        file.by_ref()
            .take(HEADER_BYTES_MAX)
            .read_to_end(&mut start)
            .map_err(|error| NpzError::array(name, error))?;
        let (header, first) = ArrayHeader::parse(&start).map_err(NpzError::header(name))?;
        let first = first.to_vec();
        Ok(Self { name, header, first, file })
    }

    /// The numbers of an array of a few.
    pub(super) fn few(self, shapes: &[&[usize]]) -> Result<Vec<f64>, NpzError> {
        let shape = self.header.shape();
        if !shapes.contains(&shape) {
            return Err(NpzError::array(self.name, format!("shape {shape:?}, where {shapes:?} is known")));
        }
        let (bytes, count) = (self.header.element_bytes(), shape.iter().product::<usize>());
        let numbers = self.first.get(..bytes * count).ok_or_else(|| self.cut_off(0))?;
        Ok(numbers.chunks_exact(bytes).map(|number| self.header.number(number)).collect())
    }

    /// Calls `take` with the rows of an array of shape (n, 3), in parts, and the bytes so far.
    pub(super) fn for_each_part(
        mut self,
        mut take: impl FnMut(&[[f64; 3]], u64) -> Result<(), NpzError>,
    ) -> Result<(), NpzError> {
        let (name, bytes) = (self.name, self.header.element_bytes());
        let rows = match *self.header.shape() {
            [rows, 3] if !self.header.is_by_columns() || rows == 1 => rows,
            ref shape => {
                let order = if self.header.is_by_columns() { " by columns" } else { "" };
                let problem = format!(
                    "shape {shape:?}{order}, where (n, 3) by rows is read: numpy.ascontiguousarray makes one"
                );
                return Err(NpzError::array(name, problem));
            }
        };
        let first = std::mem::take(&mut self.first);
        let mut numbers = first.as_slice().chain(&mut self.file);
        let (mut row, mut part, mut buffer) = (0, Vec::new(), Vec::new());
        while row < rows {
            let count = (rows - row).min(ROWS_AT_ONCE);
            buffer.clear();
            let read = numbers.by_ref().take((count * 3 * bytes) as u64).read_to_end(&mut buffer);
            read.map_err(|error| NpzError::array(name, error))?;
            if buffer.len() < count * 3 * bytes {
                return Err(cut_off(name, row + buffer.len() / (3 * bytes), rows));
            }
            row += count;
            part.clear();
            let number =
                |row: &[u8], column: usize| self.header.number(&row[column * bytes..(column + 1) * bytes]);
            part.extend(
                buffer.chunks_exact(3 * bytes).map(|row| [0, 1, 2].map(|column| number(row, column))),
            );
            take(&part, row as u64 * 3 * bytes as u64)?;
        }
        Ok(())
    }

    fn cut_off(&self, row: usize) -> NpzError {
        cut_off(self.name, row, self.header.shape().first().copied().unwrap_or(1))
    }
}

fn cut_off(name: &'static str, row: usize, rows: usize) -> NpzError {
    NpzError::array(
        name,
        format!("it ends after {row} of the {rows} rows that its header names: it was cut off"),
    )
}
