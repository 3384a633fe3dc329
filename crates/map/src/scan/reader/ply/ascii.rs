//! Ascii elements of `.ply` files, one a line.
//!
//! They are not left to ply-rs-bw, whose grammar refuses `nan`, `inf`, `.5` and `5.`.

use ply_rs_bw::ply::{ElementDef, Header, PropertyDef, PropertyType};

use super::vertex::{before_vertex, check_element};
use crate::geometry::Point;
use crate::scan::reader::axis::axis;
use crate::scan::reader::error::Problem;
use crate::scan::reader::text::{lines, number};

/// How the tokens of an ascii property are read.
enum Column {
    Axis(usize),
    Other,
    List,
}

/// The points of an ascii payload, whose first line has the number `first_line`.
pub(super) fn points(
    header: &Header,
    vertex: &ElementDef,
    payload: &[u8],
    first_line: usize,
) -> Result<Vec<Point>, Problem> {
    for element in before_vertex(header).chain([vertex]) {
        // The last line need not end.
        check_element(element, header.encoding, payload.len() + 1)?;
    }
    let before: usize = before_vertex(header).map(|element| element.count).sum();
    let columns = columns(vertex);
    let lines = lines(payload, first_line).skip(before).take(vertex.count);
    let point = |(line, text): (usize, &str)| {
        ascii_point(&columns, text).map_err(|problem| Problem::at_line(line, problem))
    };
    let points: Vec<Point> = lines.map(|line| line.and_then(point)).collect::<Result<_, _>>()?;
    if points.len() < vertex.count {
        return Err(Problem::new(format!(
            "truncated: {} of {} \"vertex\" elements",
            points.len(),
            vertex.count
        )));
    }
    Ok(points)
}

fn columns(vertex: &ElementDef) -> Vec<Column> {
    let column = |(name, property): (&String, &PropertyDef)| match property.data_type {
        PropertyType::List(..) => Column::List,
        PropertyType::Scalar(_) => axis(name).map_or(Column::Other, Column::Axis),
    };
    vertex.properties.iter().map(column).collect()
}

fn ascii_point(columns: &[Column], text: &str) -> Result<Point, String> {
    let mut tokens = text.split_ascii_whitespace();
    let mut xyz = [f32::NAN; 3];
    for column in columns {
        let token = tokens.next().ok_or_else(|| format!("fewer values than {} properties", columns.len()))?;
        match column {
            Column::Axis(axis) => xyz[*axis] = number(token)?,
            Column::Other => {}
            Column::List => skip_list(&mut tokens, number(token)?),
        }
    }
    Ok(xyz.into())
}

fn skip_list<'a>(tokens: &mut impl Iterator<Item = &'a str>, length: usize) {
    if let Some(last) = length.checked_sub(1) {
        tokens.nth(last);
    }
}
