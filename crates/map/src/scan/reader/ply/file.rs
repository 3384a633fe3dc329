//! A `.ply` file: its header, and the points that follow.

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{Encoding, Header};

use super::vertex::vertex;
use super::{ascii, binary};
use crate::geometry::Point;
use crate::scan::reader::error::{Problem, quoted};
use crate::scan::reader::supported::HEADER_BYTES_MAX;

/// The points of a `.ply` file.
pub(in crate::scan::reader) fn points(bytes: &[u8]) -> Result<Vec<Point>, Problem> {
    let (header, payload, first_line) = header(bytes)?;
    let vertex = vertex(&header)?;
    if header.encoding == Encoding::Ascii {
        ascii::points(&header, vertex, payload, first_line)
    } else {
        binary::points(&header, vertex, payload)
    }
}

/// The header, the bytes after it, and the number of the first line after it.
fn header(bytes: &[u8]) -> Result<(Header, &[u8], usize), Problem> {
    let start = &bytes[..bytes.len().min(HEADER_BYTES_MAX)];
    let mut reader = Reader::new(start);
    let header = Parser::<binary::Vertex>::new()
        .read_header(&mut reader)
        .map_err(|error| header_problem(start, &error))?;
    let first_line = reader.line();
    let header_bytes = start.len() - reader.into_inner().len();
    check_names(&header, &start[..header_bytes])?;
    Ok((header, &bytes[header_bytes..], first_line))
}

fn header_problem(start: &[u8], error: &ParseError) -> Problem {
    let text = error.to_string();
    let summary = text.lines().next().unwrap_or_default();
    let Some(number) = error.line() else {
        return Problem::new(format!("not a ply header: {summary}"));
    };
    let summary = summary.trim_start_matches(&format!("Line {number}: "));
    let line = start.split(|byte| *byte == b'\n').nth(number - 1).unwrap_or_default();
    let line = quoted(&String::from_utf8_lossy(line));
    Problem::at_line(number, format!("not a ply header: {summary} {line}"))
}

/// Refuses a name given twice: the parser keeps only one of them, and would misplace all that follows.
fn check_names(header: &Header, header_bytes: &[u8]) -> Result<(), Problem> {
    let written = |keyword: &[u8]| {
        header_bytes.split(|byte| *byte == b'\n').filter(|line| line.starts_with(keyword)).count()
    };
    let properties: usize = header.elements.values().map(|element| element.properties.len()).sum();
    if header.elements.len() != written(b"element") || properties != written(b"property") {
        return Err(Problem::new("the header declares an element or property name twice"));
    }
    Ok(())
}
