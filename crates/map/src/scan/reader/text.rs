//! Points in lines of text.

use super::error::{Problem, quoted};
use crate::geometry::Point;

/// The points of an `.xyz` file: x y z are the first three columns.
pub(super) fn points(bytes: &[u8]) -> Result<Vec<Point>, Problem> {
    let mut points = Vec::new();
    for line in lines(bytes, 1) {
        let (line, text) = line?;
        points.push(point(text).map_err(|problem| Problem::at_line(line, problem))?);
    }
    Ok(points)
}

/// Lines that are neither blank nor a comment, with their numbers; the first line of `bytes` has the number `first`.
pub(in crate::scan) fn lines(
    bytes: &[u8],
    first: usize,
) -> impl Iterator<Item = Result<(usize, &str), Problem>> {
    let numbered = bytes.split(|byte| *byte == b'\n').enumerate();
    numbered.map(move |(i, line)| (first + i, line.trim_ascii())).filter(is_content).map(|(number, line)| {
        let text = std::str::from_utf8(line);
        text.map(|text| (number, text)).map_err(|_| Problem::at_line(number, "not text but binary data"))
    })
}

fn is_content((_, line): &(usize, &[u8])) -> bool {
    !line.is_empty() && line[0] != b'#'
}

/// Parses `token` as a number; `nan` and `inf` are accepted.
pub(in crate::scan) fn number<T: std::str::FromStr>(token: &str) -> Result<T, String> {
    token.parse().map_err(|_| format!("{} is not a number (a comment starts with #)", quoted(token)))
}

fn point(text: &str) -> Result<Point, String> {
    // A comma separates even after nothing: an empty cell is an error, not a shifted column.
    if text.contains(',') { xyz(text.split(',').map(str::trim)) } else { xyz(text.split_ascii_whitespace()) }
}

fn xyz<'a>(mut cells: impl Iterator<Item = &'a str>) -> Result<Point, String> {
    let mut xyz = [0.0; 3];
    for (have, coordinate) in xyz.iter_mut().enumerate() {
        let cell = cells.next().ok_or_else(|| format!("{have} columns, x y z are needed"))?;
        *coordinate = number(cell)?;
    }
    Ok(xyz.into())
}
