//! What the header of a LAS or LAZ file claims, checked against the file.
//!
//! The decompressor of LAZ takes memory by what chunks and records claim, and trusts its own description of a point.
//! Each claim is compared with the bytes that are there before the decompressor sees the file.

use std::io::{self, Read, Seek, SeekFrom};

use las::raw;

use super::error::SurveyError;
use super::las_units;

/// Bits of the format of points that say that they are compressed.
const COMPRESSED: u8 = 0b1100_0000;
/// Largest step of coordinates, and how far they are shifted at most, meters: beyond the coordinates of the earth.
const SCALE_MAX: f64 = 1000.0;
const OFFSET_MAX: f64 = 1e9;
/// Where an extended record says its length, and how long its head is.
const EXTENDED_LENGTH_AT: u64 = 20;
const EXTENDED_HEAD_BYTES: u64 = 60;
/// The record that describes compressed points.
const LASZIP_USER: &[u8] = b"laszip encoded\0";
const LASZIP_RECORD: u16 = 22_204;
/// Where that record says how many items a point has.
const ITEMS_AT: usize = 32;
const ITEM_BYTES: usize = 6;
/// Points of a chunk, where each chunk says its own number.
const CHUNK_POINTS_VARY: u32 = u32::MAX;
/// Bytes before the first chunk: where the table of chunks lies.
const TABLE_OFFSET_BYTES: u64 = 8;

/// Checks all claims of a file of `length` bytes.
///
/// # Errors
/// Names the claim that the file cannot hold.
pub(super) fn check(file: &mut (impl Read + Seek), length: u64) -> Result<(), SurveyError> {
    file.seek(SeekFrom::Start(0))?;
    let header = raw::Header::read_from(&mut *file)?;
    let (offset, record) =
        (u64::from(header.offset_to_point_data), u64::from(header.point_data_record_length));
    check_transform(&header)?;
    if offset > length {
        return Err(SurveyError::claim(format!("its points begin at byte {offset}"), length));
    }
    let legacy = u64::from(header.number_of_point_records);
    let large = header.large_file.map_or(0, |large| large.number_of_point_records);
    let points = if legacy > 0 { legacy } else { large };
    let bytes = points.checked_mul(record).and_then(|bytes| bytes.checked_add(offset));
    let is_compressed = header.point_data_record_format & COMPRESSED != 0;
    // Compressed points take fewer bytes, but the sum is made all the same.
    let limit = if is_compressed { i64::MAX.cast_unsigned() } else { length };
    if record == 0 || bytes.is_none_or(|bytes| bytes > limit) {
        return Err(SurveyError::claim(
            format!("its header names {points} points of {record} bytes"),
            length,
        ));
    }
    // Of points that are not compressed it is plain how many there are.
    let first_extended = header.evlr.map_or(length, |evlr| evlr.start_of_first_evlr.min(length));
    if points == 0 && !is_compressed && first_extended.saturating_sub(offset) >= record {
        let bytes = first_extended - offset;
        return Err(damaged(format!(
            "its header names no points, and {bytes} bytes of points follow: the program that wrote it did not end well"
        )));
    }
    las_units::check(file, u64::from(header.header_size), header.number_of_variable_length_records)?;
    if let Some(evlr) = header.evlr {
        check_extended(file, evlr.start_of_first_evlr, length)?;
    }
    if is_compressed && points > 0 {
        let records = header.number_of_variable_length_records;
        let laszip = Laszip::find(file, u64::from(header.header_size), records)?;
        laszip.check(header.point_data_record_length)?;
        check_chunks(file, &laszip, Range { offset, length, points, record })?;
    }
    Ok(())
}

/// What coordinates are multiplied with, and what is added to them.
fn check_transform(header: &raw::Header) -> Result<(), SurveyError> {
    let axes = [
        ("x", header.x_scale_factor, header.x_offset),
        ("y", header.y_scale_factor, header.y_offset),
        ("z", header.z_scale_factor, header.z_offset),
    ];
    for (axis, scale, offset) in axes {
        if scale.is_nan() || scale <= 0.0 || scale > SCALE_MAX {
            return Err(damaged(format!(
                "its header scales {axis} by {scale}, which must be above 0 and at most {SCALE_MAX}"
            )));
        }
        if offset.is_nan() || offset.abs() > OFFSET_MAX {
            return Err(damaged(format!(
                "its header shifts {axis} by {offset}, which must be at most {OFFSET_MAX} either way"
            )));
        }
    }
    Ok(())
}

/// The length of the first extended record, for which the reader makes room.
fn check_extended(file: &mut (impl Read + Seek), start: u64, length: u64) -> Result<(), SurveyError> {
    let claim = |bytes: u64| {
        SurveyError::claim(format!("an extended record of {bytes} bytes at byte {start}"), length)
    };
    let head_end =
        start.checked_add(EXTENDED_HEAD_BYTES).filter(|end| *end <= length).ok_or_else(|| claim(0))?;
    file.seek(SeekFrom::Start(start + EXTENDED_LENGTH_AT))?;
    let bytes = u64::from_le_bytes(array(file)?);
    match bytes <= length - head_end {
        true => Ok(()),
        false => Err(claim(bytes)),
    }
}

/// How points are compressed.
struct Laszip {
    compressor: u16,
    chunk_points: u32,
    /// Type, size and version of each item of a point.
    items: Vec<[u16; 3]>,
}

impl Laszip {
    /// That of the first `records` variable length records behind the header.
    fn find(file: &mut (impl Read + Seek), header_bytes: u64, records: u32) -> Result<Self, SurveyError> {
        file.seek(SeekFrom::Start(header_bytes))?;
        for _ in 0..records {
            let record = raw::Vlr::read_from(&mut *file, false)?;
            if record.record_id == LASZIP_RECORD && record.user_id.starts_with(LASZIP_USER) {
                return Self::of(&record.data).ok_or_else(|| damaged("its laszip record is cut short"));
            }
        }
        Err(damaged("its points are compressed, and no laszip record says how"))
    }

    fn of(data: &[u8]) -> Option<Self> {
        let two = |at: usize| Some(u16::from_le_bytes(*data.get(at..)?.first_chunk()?));
        let count = usize::from(two(ITEMS_AT)?);
        let item = |k: usize| {
            let at = ITEMS_AT + 2 + k * ITEM_BYTES;
            Some([two(at)?, two(at + 2)?, two(at + 4)?])
        };
        Some(Self {
            compressor: two(0)?,
            chunk_points: u32::from_le_bytes(*data.get(12..)?.first_chunk()?),
            items: (0..count).map(item).collect::<Option<_>>()?,
        })
    }

    /// Checks that the items make a point of `record` bytes, and are those of the compressor.
    fn check(&self, record: u16) -> Result<(), SurveyError> {
        let fits = |[kind, size, version]: &[u16; 3]| {
            let is_of_version = match self.compressor {
                1 | 2 => matches!((kind, version), (0 | 6..=9, 1 | 2)),
                3 => matches!((kind, version), (10..=14, 3 | 4)),
                _ => false,
            };
            is_of_version
                && match kind {
                    6 => *size == 20,
                    7 | 12 => *size == 8,
                    8 | 11 => *size == 6,
                    9 | 13 => *size == 29,
                    10 => *size == 30,
                    _ => *size > 0,
                }
        };
        let first = self.items.first().map(|[kind, ..]| *kind);
        let size: u32 = self.items.iter().map(|[_, size, _]| u32::from(*size)).sum();
        let is_known = matches!(first, Some(6 | 10)) && self.items.iter().all(fits) && self.chunk_points > 0;
        match is_known && size == u32::from(record) {
            true => Ok(()),
            false => Err(damaged(format!(
                "its laszip record describes points of {size} bytes by compressor {}, and its header has points of \
                 {record} bytes: it is damaged, or of a version that is not known",
                self.compressor
            ))),
        }
    }

    fn is_layered(&self) -> bool {
        self.compressor == 3
    }

    /// Layers of a chunk, each of which says its size.
    fn layers(&self) -> u64 {
        let of_item = |[kind, size, _]: &[u16; 3]| match kind {
            10 => 9,
            12 => 2,
            14 => u64::from(*size),
            _ => 1,
        };
        self.items.iter().map(of_item).sum()
    }
}

/// Where points lie, and how many there are.
struct Range {
    offset: u64,
    length: u64,
    points: u64,
    /// Bytes of a point.
    record: u64,
}

/// Checks the number of chunks in their table, and the sizes of the layers of each chunk.
fn check_chunks(file: &mut (impl Read + Seek), laszip: &Laszip, range: Range) -> Result<(), SurveyError> {
    let Range { offset, length, points, record } = range;
    let Some(table) = table_place(file, offset, length)? else {
        return match laszip.compressor == 1 {
            true => Ok(()),
            false => Err(damaged("it has no table of chunks: the program that wrote it did not end well")),
        };
    };
    file.seek(SeekFrom::Start(table + 4))?;
    let chunks = u64::from(u32::from_le_bytes(array(file)?));
    // The first point of each chunk is not compressed.
    if chunks.saturating_mul(record) > length {
        return Err(SurveyError::claim(format!("its table names {chunks} chunks"), length));
    }
    let of_table = match laszip.chunk_points {
        // What such a table says is compressed; chunks in layers say it as well.
        CHUNK_POINTS_VARY => laszip.is_layered().then_some(u64::MAX),
        chunk_points => chunks.checked_mul(u64::from(chunk_points)),
    };
    if of_table.is_none_or(|of_table| points > of_table) {
        return Err(damaged(format!(
            "its table of {chunks} chunks has fewer than the {points} points of its header, or no number of them"
        )));
    }
    if laszip.is_layered() { check_layers(file, laszip, &range, chunks) } else { Ok(()) }
}

/// The place of the table of chunks; none where there is none.
fn table_place(file: &mut (impl Read + Seek), offset: u64, length: u64) -> Result<Option<u64>, SurveyError> {
    let is_place = |place: &u64| *place > offset && place.checked_add(8).is_some_and(|end| end <= length);
    file.seek(SeekFrom::Start(offset))?;
    let first = u64::from_le_bytes(array(file)?);
    if first.cast_signed() > offset.cast_signed() {
        // A place that is named and cannot be: the decompressor would go on without.
        return is_place(&first).then_some(Some(first)).ok_or_else(|| {
            SurveyError::claim(format!("its table of chunks is said to lie at byte {first}"), length)
        });
    }
    file.seek(SeekFrom::End(-8))?;
    Ok(Some(u64::from_le_bytes(array(file)?)).filter(is_place))
}

/// Walks from chunk to chunk of points in layers, by the sizes that each says.
fn check_layers(
    file: &mut (impl Read + Seek),
    laszip: &Laszip,
    range: &Range,
    chunks: u64,
) -> Result<(), SurveyError> {
    let Range { offset, length, points, record } = *range;
    let mut place = offset + TABLE_OFFSET_BYTES;
    let mut rest = points;
    for chunk in 0..chunks {
        if rest == 0 {
            break;
        }
        file.seek(SeekFrom::Start(place + record))?;
        let count = u64::from(u32::from_le_bytes(array(file)?));
        let expected = match laszip.chunk_points {
            CHUNK_POINTS_VARY => count.min(rest),
            chunk_points => rest.min(u64::from(chunk_points)),
        };
        if count != expected || count == 0 {
            return Err(damaged(format!(
                "chunk {chunk} says that it has {count} points, {expected} are expected"
            )));
        }
        place += record + 4;
        for _ in 0..laszip.layers() {
            place = place.saturating_add(4 + u64::from(u32::from_le_bytes(array(file)?)));
        }
        if place > length {
            return Err(SurveyError::claim(
                format!("the layers of chunk {chunk} end at byte {place}"),
                length,
            ));
        }
        rest -= count;
    }
    match rest {
        0 => Ok(()),
        rest => Err(damaged(format!("its chunks have {rest} points fewer than the {points} of its header"))),
    }
}

fn damaged(problem: impl Into<String>) -> SurveyError {
    SurveyError::Content(problem.into())
}

fn array<const N: usize>(file: &mut impl Read) -> Result<[u8; N], SurveyError> {
    let mut bytes = [0; N];
    match file.read_exact(&mut bytes) {
        Ok(()) => Ok(bytes),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
            Err(damaged("the file ends before its last point: it was cut off or is damaged"))
        }
        Err(error) => Err(error.into()),
    }
}
