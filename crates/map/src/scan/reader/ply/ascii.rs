//! Ascii elements of `.ply` files, one a line.

use super::header::{Element, Header, Kind};
use super::vertex::{Vertex, before_vertex};
use crate::scan::reader::coordinates::Coordinates;
use crate::scan::reader::count::check_count;
use crate::scan::reader::error::{Problem, quoted};
use crate::scan::reader::lines::{Lines, content};
use crate::scan::reader::text::number;

/// Fewest bytes of one value: a digit and a separator.
const VALUE_BYTES_MIN: u64 = 2;

/// How the tokens of a property are read.
enum Column {
    Axis(usize),
    Other,
    List,
}

/// The points in the lines after the header.
pub(super) fn points<C: Coordinates>(
    header: &Header,
    vertex: &Vertex<'_>,
    lines: Lines<'_>,
) -> Result<Vec<C>, Problem> {
    let mut before = 0usize;
    for element in before_vertex(header) {
        check(element, &lines)?;
        before += element.count;
    }
    check(vertex.element, &lines)?;
    let (columns, count) = (columns(vertex), vertex.element.count);
    let entries = content(lines).skip(before).take(count);
    let point = |(line, text): (usize, std::borrow::Cow<'_, str>)| {
        point(&columns, &text).map(C::of_doubles).map_err(|problem| Problem::at_line(line, problem))
    };
    let points: Vec<C> = entries.map(point).collect::<Result<_, _>>()?;
    match points.len() == count {
        true => Ok(points),
        false => Err(Problem::new(format!("truncated: {} of {count} \"vertex\" elements", points.len()))),
    }
}

/// Checks the count of an element against the bytes in which it lies.
fn check(element: &Element, lines: &Lines<'_>) -> Result<(), Problem> {
    let bytes = element.properties.len() as u64 * VALUE_BYTES_MIN;
    // The last line need not end.
    let have = lines.rest().len() + 1;
    check_count(&format!("{} elements", quoted(&element.name)), element.count as u64, bytes, have)
}

fn columns(vertex: &Vertex<'_>) -> Vec<Column> {
    let properties = vertex.element.properties.iter().enumerate();
    let column = |(place, property): (usize, &super::header::Property)| match property.kind {
        Kind::List(..) => Column::List,
        Kind::Scalar(_) => vertex.axis(place).map_or(Column::Other, Column::Axis),
    };
    properties.map(column).collect()
}

fn point(columns: &[Column], text: &str) -> Result<[f64; 3], String> {
    let mut tokens = text.split_ascii_whitespace();
    let mut xyz = [f64::NAN; 3];
    for column in columns {
        let token = tokens.next().ok_or_else(|| format!("fewer values than {} properties", columns.len()))?;
        match column {
            Column::Axis(axis) => xyz[*axis] = number(token)?,
            Column::Other => {}
            Column::List => skip_list(&mut tokens, number(token)?),
        }
    }
    Ok(xyz)
}

fn skip_list<'a>(tokens: &mut impl Iterator<Item = &'a str>, length: usize) {
    if let Some(last) = length.checked_sub(1) {
        tokens.nth(last);
    }
}
