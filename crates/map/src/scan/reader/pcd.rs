//! Points of `.pcd` files: the fields x, y, z.
//!
//! pcd-rs trusts the header: it allocates, and indexes, by the counts it declares. So the header is read and
//! checked against the bytes that follow, before pcd-rs reads the points.

use std::io::{BufRead, ErrorKind};

use pcd_rs::{DataKind, Error, PcdDeserialize, PcdMeta, Reader, Schema, ValueKind};

use super::axis::axis;
use super::count::check_count;
use super::error::Problem;
use super::supported::{FILE_BYTES_MAX, HEADER_BYTES_MAX};
use super::text::number;
use crate::geometry::Point;

/// Fewest bytes of one ascii value: a digit and a separator.
const ASCII_VALUE_BYTES_MIN: u64 = 2;
/// Bytes of the two sizes that come before compressed data.
const SIZES_BYTES: usize = 8;
/// Most bytes that one byte of LZF data can stand for: 3 bytes repeat 264.
const LZF_RATIO_MAX: u64 = 88;

/// The points of a `.pcd` file. Its viewpoint is ignored: the pose of a scan is given with the scan.
pub(super) fn points(bytes: &[u8]) -> Result<Vec<Point>, Problem> {
    let start = &bytes[..bytes.len().min(HEADER_BYTES_MAX)];
    let mut rest = start;
    let meta = PcdMeta::from_reader(&mut rest)
        .map_err(|error| Problem::new(format!("not a pcd header: {error}")))?;
    check_fields(&meta.field_defs)?;
    check_size(&meta, &bytes[start.len() - rest.len()..])?;
    let records = Reader::<Record, _>::from_reader(bytes).map_err(|e| Problem::new(e.to_string()))?;
    let point = |(i, record): (usize, pcd_rs::Result<Record>)| match record {
        Ok(record) => Ok(Point::from(record.0)),
        Err(error) => Err(Problem::new(format!("point {i} of {}: {}", meta.num_points, message(error)))),
    };
    records.enumerate().map(point).collect()
}

fn check_fields(fields: &Schema) -> Result<(), Problem> {
    for name in ["x", "y", "z"] {
        let field = fields.iter().find(|field| field.name == name);
        let field = field.ok_or_else(|| Problem::new(format!("no field {name} in the header")))?;
        if !matches!((field.kind, field.count), (ValueKind::F32 | ValueKind::F64, 1)) {
            return Err(Problem::new(format!(
                "field {name} is {} of {:?}, one of type F and size 4 or 8 is needed",
                field.count, field.kind
            )));
        }
    }
    Ok(())
}

/// Checks what the header declares against `data`, the bytes after it.
fn check_size(meta: &PcdMeta, data: &[u8]) -> Result<(), Problem> {
    let value_bytes = |kind: ValueKind| match meta.data {
        DataKind::Ascii => ASCII_VALUE_BYTES_MIN,
        DataKind::Binary | DataKind::BinaryCompressed => kind.byte_size() as u64,
    };
    let record_bytes = meta
        .field_defs
        .iter()
        .try_fold(0u64, |sum, field| sum.checked_add(value_bytes(field.kind).checked_mul(field.count)?))
        .ok_or_else(|| Problem::new("the header declares fields of more than 2^64 bytes"))?;
    match meta.data {
        // The last line need not end.
        DataKind::Ascii => check_count("points", meta.num_points, record_bytes, data.len() + 1),
        DataKind::Binary => check_count("points", meta.num_points, record_bytes, data.len()),
        DataKind::BinaryCompressed => check_compressed(meta.num_points, record_bytes, data),
    }
}

fn check_compressed(points: u64, record_bytes: u64, data: &[u8]) -> Result<(), Problem> {
    let Some((sizes, data)) = data.split_at_checked(SIZES_BYTES) else {
        return Err(Problem::new("truncated: the sizes of the compressed data are missing"));
    };
    let size =
        |at: usize| u64::from(u32::from_le_bytes([sizes[at], sizes[at + 1], sizes[at + 2], sizes[at + 3]]));
    let (compressed, whole) = (size(0), size(4));
    if compressed > data.len() as u64 {
        return Err(Problem::new(format!(
            "truncated: {compressed} bytes of compressed data are declared, {} follow",
            data.len()
        )));
    }
    let possible = whole <= FILE_BYTES_MAX.min(compressed * LZF_RATIO_MAX);
    if !possible || points.checked_mul(record_bytes) != Some(whole) {
        return Err(Problem::new(format!(
            "{compressed} bytes of compressed data that become {whole} cannot hold {points} points of \
             {record_bytes} bytes: the header is wrong"
        )));
    }
    check_count("points", points, record_bytes, whole as usize)
}

/// A point while it is read; fields other than x, y, z are skipped.
struct Record([f32; 3]);

impl PcdDeserialize for Record {
    /// Returns true: a file may have other fields than these three.
    fn is_dynamic() -> bool {
        true
    }

    fn read_spec() -> Vec<(Option<String>, ValueKind, Option<usize>)> {
        Vec::new()
    }

    fn read_chunk<R: BufRead>(reader: &mut R, fields: &Schema) -> pcd_rs::Result<Self> {
        let mut xyz = [f32::NAN; 3];
        for field in fields {
            match (axis(&field.name), field.kind) {
                (Some(axis), ValueKind::F32) => xyz[axis] = f32::from_le_bytes(read_array(reader)?),
                (Some(axis), ValueKind::F64) => xyz[axis] = f64::from_le_bytes(read_array(reader)?) as f32,
                (_, kind) => skip(reader, kind.byte_size() * field.count as usize)?,
            }
        }
        Ok(Self(xyz))
    }

    fn read_line<R: BufRead>(reader: &mut R, fields: &Schema) -> pcd_rs::Result<Self> {
        let mut line = String::new();
        if reader.read_line(&mut line)? == 0 {
            return Err(truncated());
        }
        let mut tokens = line.split_ascii_whitespace();
        let mut xyz = [f32::NAN; 3];
        for field in fields {
            let token = tokens.nth(field.count as usize - 1);
            let token = token.ok_or_else(|| invalid("fewer values than the fields need".to_owned()))?;
            if let Some(axis) = axis(&field.name) {
                xyz[axis] = number(token).map_err(invalid)?;
            }
        }
        Ok(Self(xyz))
    }
}

fn invalid(desc: String) -> Error {
    Error::InvalidArgumentError { desc }
}

fn message(error: Error) -> String {
    match error {
        Error::InvalidArgumentError { desc } => desc,
        other => other.to_string(),
    }
}

fn truncated() -> Error {
    std::io::Error::from(ErrorKind::UnexpectedEof).into()
}

fn read_array<const N: usize>(reader: &mut impl BufRead) -> pcd_rs::Result<[u8; N]> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn skip(reader: &mut impl BufRead, mut bytes: usize) -> pcd_rs::Result<()> {
    while bytes > 0 {
        let have = reader.fill_buf()?.len().min(bytes);
        if have == 0 {
            return Err(truncated());
        }
        reader.consume(have);
        bytes -= have;
    }
    Ok(())
}
