//! Points as bare little-endian float32, row by row.

use super::columns::Columns;
use super::coordinates::Coordinates;
use super::error::Problem;
use super::row_length::{NAMES, name_of, other_row_length};

/// Bytes of a number.
const NUMBER_BYTES: usize = size_of::<f32>();

/// The points of rows with these columns or, where nobody names them, of as many numbers as is usual for the file.
///
/// # Errors
/// When the last row is cut short; and where nobody names the columns and the numbers look like rows of another length.
pub(super) fn points<C: Coordinates>(
    bytes: &[u8],
    named: Option<Columns>,
    usual: Columns,
) -> Result<Vec<C>, Problem> {
    let columns = named.unwrap_or(usual);
    let row_bytes = NUMBER_BYTES * columns.count;
    if !bytes.len().is_multiple_of(row_bytes) {
        let mut problem = format!(
            "{} bytes are not whole points of {row_bytes} bytes, point {} is cut short",
            bytes.len(),
            bytes.len() / row_bytes
        );
        let fits =
            |length: &usize| *length != usual.count && bytes.len().is_multiple_of(NUMBER_BYTES * length);
        let other = NAMES.iter().map(|(length, _)| *length).find(fits).filter(|_| named.is_none());
        if let Some(other) = other {
            problem += &format!("; they may be rows of {other} numbers: give {}", option(other));
        }
        return Err(Problem::new(problem));
    }
    let numbers: Vec<f32> = bytes.as_chunks().0.iter().map(|number| f32::from_le_bytes(*number)).collect();
    if named.is_none()
        && let Some(other) = other_row_length(&numbers, usual.count)
    {
        let this = usual.count;
        return Err(Problem::new(format!(
            "the numbers look like rows of {other} ({}), not of {this} ({}): give {}, or {} where they are that",
            name_of(other),
            name_of(this),
            option(other),
            option(this)
        )));
    }
    let point = |row: &[f32]| C::of_singles(columns.axes.map(|axis| row[axis]));
    Ok(numbers.chunks_exact(columns.count).map(point).collect())
}

/// The option that says so.
fn option(length: usize) -> String {
    format!("--columns \"{}\"", name_of(length))
}
