//! Points in `.npy` files of numpy: one array of numbers, with a row a point.

use super::array_header::ArrayHeader;
use super::columns::Columns;
use super::coordinates::Coordinates;
use super::count::check_count;
use super::error::Problem;

/// Columns of an array of which nobody says what they hold: of one with more each column may be a point.
const COLUMNS_MAX: usize = 16;

/// The points of an array of shape (..., 3), or with more columns.
///
/// # Errors
/// Where it is no such array, or is cut short.
pub(super) fn points<C: Coordinates>(bytes: &[u8], named: Option<Columns>) -> Result<Vec<C>, Problem> {
    let (header, data) = ArrayHeader::parse(bytes).map_err(|error| Problem::new(error.to_string()))?;
    let (shape, element_bytes) = (header.shape(), header.element_bytes());
    let width = shape.last().copied().unwrap_or_default();
    let columns = match named {
        Some(columns) if columns.count == width => columns,
        Some(columns) => {
            let problem = format!("an array of shape {shape:?}, where columns names {}", columns.count);
            return Err(Problem::new(problem));
        }
        None if (3..=COLUMNS_MAX).contains(&width) => Columns::xyz_and(width - 3),
        None => {
            return Err(Problem::new(format!(
                "an array of shape {shape:?}, where (..., 3) is needed, or columns behind x y z, up to {COLUMNS_MAX}"
            )));
        }
    };
    let outer = &shape[..shape.len() - 1];
    let rows = outer.iter().try_fold(1u64, |rows, &length| rows.checked_mul(length as u64));
    let rows = rows.ok_or_else(|| Problem::new(format!("an array of shape {shape:?} fits into no file")))?;
    check_count("points", rows, (width * element_bytes) as u64, data.len())?;
    let rows = rows as usize;
    let number = |at: usize| header.number(&data[at * element_bytes..(at + 1) * element_bytes]);
    let place = |row: usize, column: usize| {
        if header.is_by_columns() { place_by_columns(row, column, outer, rows) } else { row * width + column }
    };
    let point = |row: usize| C::of_doubles(columns.axes.map(|column| number(place(row, column))));
    Ok((0..rows).map(point).collect())
}

/// Where an element of an array lies that is stored with its first index running fastest.
fn place_by_columns(row: usize, column: usize, outer: &[usize], rows: usize) -> usize {
    // The number of a row counts with its last index running fastest.
    let (mut rest, mut stride_after, mut place) = (row, rows, column * rows);
    for &length in outer.iter().rev() {
        stride_after /= length;
        place += rest % length * stride_after;
        rest /= length;
    }
    place
}
