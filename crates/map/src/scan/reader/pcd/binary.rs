//! Binary points of `.pcd` files, compressed or not.

use std::fmt::Write;
use std::io::{BufRead, ErrorKind, Read};

use pcd_rs::{Error, PcdDeserialize, Reader, Schema, ValueKind};

use super::header::{DataKind, Field, Header};
use crate::scan::reader::coordinates::Coordinates;
use crate::scan::reader::count::check_count;
use crate::scan::reader::error::Problem;
use crate::scan::reader::supported::FILE_BYTES_MAX;

/// Bytes of the two sizes that come before compressed data.
const SIZES_BYTES: usize = 8;
/// Most bytes that one byte of LZF data can stand for: 3 bytes repeat 264.
const LZF_RATIO_MAX: u64 = 88;
/// Names of the coordinates' fields in the header that pcd-rs reads.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Name of a field that is skipped.
const SKIPPED: &str = "_";

/// The points in the bytes after the header.
pub(super) fn points<C: Coordinates>(header: &Header, data: &[u8]) -> Result<Vec<C>, Problem> {
    check_size(header, data)?;
    let plain = plain_header(header);
    let reader = Reader::<Record<C>, _>::from_reader(plain.as_bytes().chain(data));
    let records = reader.map_err(|error| Problem::new(format!("points of the fields x y z: {error}")))?;
    let point = |(i, record): (usize, pcd_rs::Result<Record<C>>)| {
        record
            .map(|record| record.0)
            .map_err(|error| Problem::new(format!("point {i} of {}: {error}", header.points)))
    };
    records.enumerate().map(point).collect()
}

/// A header of the same points: what is not a coordinate is so many bytes, and nothing where it takes none.
fn plain_header(header: &Header) -> String {
    let mut lines = ["FIELDS", "SIZE", "TYPE", "COUNT"].map(str::to_owned);
    for &Field { axis, size, count } in header.fields.iter().filter(|field| field.size * field.count > 0) {
        let (name, size, kind, count) = match axis {
            Some(axis) => (AXES[axis], size, "F", 1),
            None => (SKIPPED, 1, "U", size * count),
        };
        let values = [name.to_owned(), size.to_string(), kind.to_owned(), count.to_string()];
        for (line, value) in lines.iter_mut().zip(values) {
            // Writing to a string does not fail.
            let _ = write!(line, " {value}");
        }
    }
    let (points, data) = (header.points, header.data.as_str());
    let fields = lines.join("\n");
    format!("VERSION 0.7\n{fields}\nWIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA {data}\n")
}

/// Checks what the header declares against `data`, the bytes after it.
fn check_size(header: &Header, data: &[u8]) -> Result<(), Problem> {
    let bytes = |sum: u64, field: &Field| sum.checked_add(field.size.checked_mul(field.count)?);
    let record_bytes = header
        .fields
        .iter()
        .try_fold(0u64, bytes)
        .ok_or_else(|| Problem::new("the header declares fields of more than 2^64 bytes"))?;
    match header.data {
        DataKind::BinaryCompressed => check_compressed(header.points, record_bytes, data),
        _ => check_count("points", header.points, record_bytes, data.len()),
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
struct Record<C>(C);

impl<C: Coordinates> PcdDeserialize for Record<C> {
    /// Returns true: a file may have other fields than these three.
    fn is_dynamic() -> bool {
        true
    }

    fn read_spec() -> Vec<(Option<String>, ValueKind, Option<usize>)> {
        Vec::new()
    }

    fn read_chunk<R: BufRead>(reader: &mut R, fields: &Schema) -> pcd_rs::Result<Self> {
        let mut xyz = [f64::NAN; 3];
        for field in fields {
            let axis = AXES.iter().position(|name| *name == field.name);
            match (axis, field.kind) {
                (Some(axis), ValueKind::F32) => {
                    xyz[axis] = f64::from(f32::from_le_bytes(read_array(reader)?));
                }
                (Some(axis), ValueKind::F64) => xyz[axis] = f64::from_le_bytes(read_array(reader)?),
                (_, kind) => skip(reader, kind.byte_size() * field.count as usize)?,
            }
        }
        Ok(Self(C::of_doubles(xyz)))
    }

    fn read_line<R: BufRead>(_: &mut R, _: &Schema) -> pcd_rs::Result<Self> {
        Err(Error::InvalidArgumentError { desc: "points as text are not read here".to_owned() })
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
