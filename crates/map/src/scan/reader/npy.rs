//! Points in `.npy` files of numpy: one array of numbers, with a row a point.
//!
//! The header is read here: the libraries for it parse all of Python's literals, and take a dozen crates for that.

use super::columns::Columns;
use super::coordinates::Coordinates;
use super::count::check_count;
use super::error::{Problem, quoted};

/// What such a file begins with.
const MAGIC: &[u8] = b"\x93NUMPY";
/// Columns of an array of which nobody says what they hold: of one with more each column may be a point.
const COLUMNS_MAX: usize = 16;

/// How an element is stored.
#[derive(Clone, Copy)]
struct Element {
    /// `f`, `i` or `u`.
    kind: u8,
    bytes: usize,
    is_big_endian: bool,
}

/// What the header says.
struct Header<'a> {
    element: Element,
    is_by_columns: bool,
    shape: Vec<usize>,
    data: &'a [u8],
}

/// The points of an array of shape (..., 3), or with more columns.
///
/// # Errors
/// Where it is no such array, or is cut short.
pub(super) fn points<C: Coordinates>(bytes: &[u8], named: Option<Columns>) -> Result<Vec<C>, Problem> {
    let Header { element, is_by_columns, shape, data } = Header::of(bytes)?;
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
    check_count("points", rows, (width * element.bytes) as u64, data.len())?;
    let rows = rows as usize;
    let number = |at: usize| element.number(&data[at * element.bytes..(at + 1) * element.bytes]);
    let place = |row: usize, column: usize| {
        if is_by_columns { place_by_columns(row, column, outer, rows) } else { row * width + column }
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

impl Element {
    fn of(descr: &str) -> Option<Self> {
        let [order, kind, digits @ ..] = descr.as_bytes() else { return None };
        let bytes = std::str::from_utf8(digits).ok()?.parse().ok()?;
        let is_known = match kind {
            b'f' => matches!(bytes, 4 | 8),
            b'i' | b'u' => matches!(bytes, 1 | 2 | 4 | 8),
            _ => false,
        };
        let is_known = is_known && matches!(order, b'<' | b'>' | b'|');
        is_known.then_some(Self { kind: *kind, bytes, is_big_endian: *order == b'>' })
    }

    fn number(self, bytes: &[u8]) -> f64 {
        // Eight bytes, the least first; those of a negative integer are extended.
        let mut word = [0u8; 8];
        for (i, &byte) in bytes.iter().enumerate() {
            word[if self.is_big_endian { bytes.len() - 1 - i } else { i }] = byte;
        }
        let bits = u64::from_le_bytes(word);
        match (self.kind, self.bytes) {
            (b'f', 4) => f64::from(f32::from_bits(bits as u32)),
            (b'f', _) => f64::from_bits(bits),
            (b'u', _) => bits as f64,
            (_, bytes) => {
                let unused = 64 - 8 * bytes as u32;
                ((bits << unused).cast_signed() >> unused) as f64
            }
        }
    }
}

impl<'a> Header<'a> {
    fn of(bytes: &'a [u8]) -> Result<Self, Problem> {
        let no_array = |why: &str| Problem::new(format!("no array of numpy: {why}"));
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| no_array("it begins otherwise"))?;
        let short = || no_array("its header is cut short");
        let (&[major, _], rest) = rest.split_first_chunk().ok_or_else(short)?;
        let (length, rest) = match major {
            1 => rest.split_first_chunk().map(|(length, rest)| (u16::from_le_bytes(*length) as usize, rest)),
            2 | 3 => {
                rest.split_first_chunk().map(|(length, rest)| (u32::from_le_bytes(*length) as usize, rest))
            }
            _ => return Err(no_array(&format!("format {major}, 1 to 3 are known"))),
        }
        .ok_or_else(short)?;
        let (header, data) = rest.split_at_checked(length).ok_or_else(short)?;
        let header = std::str::from_utf8(header).map_err(|_| no_array("its header is no text"))?;
        let value = |key: &str| {
            let at = header.find(&format!("'{key}':")).ok_or_else(|| no_array(&format!("no {key}")))?;
            Ok(header[at + key.len() + 3..].trim_start())
        };
        let descr = value("descr")?;
        let known = descr.strip_prefix('\'').and_then(|rest| Element::of(rest.split('\'').next()?));
        let element = known.ok_or_else(|| {
            let got = quoted(descr.split(", 'fortran").next().unwrap_or(descr));
            Problem::new(format!(
                "an array of {got}, where numbers x y z are needed: numpy.column_stack makes one"
            ))
        })?;
        let is_by_columns = value("fortran_order")?.starts_with("True");
        let shape = value("shape")?;
        let inside = shape.strip_prefix('(').and_then(|rest| rest.split(')').next());
        let numbers = inside.ok_or_else(|| no_array("its shape is none"))?.split(',').map(str::trim);
        let shape: Result<Vec<usize>, _> =
            numbers.filter(|number| !number.is_empty()).map(str::parse).collect();
        let shape = shape.map_err(|_| no_array("its shape is none"))?;
        Ok(Self { element, is_by_columns, shape, data })
    }
}
