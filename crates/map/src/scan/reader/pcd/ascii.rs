//! Points of `.pcd` files as text, one a line.

use super::header::{Field, Header};
use crate::scan::reader::coordinates::Coordinates;
use crate::scan::reader::count::check_count;
use crate::scan::reader::error::Problem;
use crate::scan::reader::lines::{Lines, content};
use crate::scan::reader::text::number;

/// Fewest bytes of one value: a digit and a separator.
const VALUE_BYTES_MIN: u64 = 2;

/// The points in the lines after the header.
pub(super) fn points<C: Coordinates>(header: &Header, lines: Lines<'_>) -> Result<Vec<C>, Problem> {
    let values = header.fields.iter().try_fold(0u64, |sum, field| sum.checked_add(field.count));
    let bytes = values.and_then(|values| values.checked_mul(VALUE_BYTES_MIN));
    let bytes = bytes.ok_or_else(|| Problem::new("the header declares fields of more than 2^64 bytes"))?;
    // The last line need not end.
    check_count("points", header.points, bytes, lines.rest().len() + 1)?;
    let declared = header.points;
    let numbered = content(lines).take(declared as usize).enumerate();
    let read = numbered.map(|(i, (line, text))| {
        let point = point(&header.fields, &text);
        let problem = |problem| Problem::at_line(line, format!("point {i} of {declared}: {problem}"));
        point.map(C::of_doubles).map_err(problem)
    });
    let points: Vec<C> = read.collect::<Result<_, _>>()?;
    match points.len() as u64 == declared {
        true => Ok(points),
        false => Err(Problem::new(format!("truncated: POINTS declares {declared}, {} follow", points.len()))),
    }
}

fn point(fields: &[Field], text: &str) -> Result<[f64; 3], String> {
    let mut tokens = text.split_ascii_whitespace();
    let mut xyz = [f64::NAN; 3];
    for field in fields {
        let Some(last) = field.count.checked_sub(1) else { continue };
        let token = tokens.nth(last as usize).ok_or("fewer values than the fields need")?;
        if let Some(axis) = field.axis {
            xyz[axis] = number(token)?;
        }
    }
    Ok(xyz)
}
