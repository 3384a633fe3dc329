//! What an array of numpy says of itself before its numbers.
//!
//! The header is read here: the libraries for it parse all of Python's literals, and take a dozen crates for that.

use super::error::quoted;

/// What such an array begins with.
const MAGIC: &[u8] = b"\x93NUMPY";

/// The header of an array of numpy, as a `.npy` file begins with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArrayHeader {
    element: Element,
    is_by_columns: bool,
    shape: Vec<usize>,
}

/// Why bytes are no array of numbers.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ArrayHeaderError(String);

/// How an element is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Element {
    /// `f`, `i` or `u`.
    kind: u8,
    bytes: usize,
    is_big_endian: bool,
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

impl ArrayHeader {
    /// The header that `bytes` begin with, and the bytes behind it, which are the array's numbers.
    ///
    /// # Errors
    /// When the bytes are no array of numpy, or one of anything but real numbers.
    pub fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), ArrayHeaderError> {
        let no_array = |why: &str| ArrayHeaderError(format!("no array of numpy: {why}"));
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
            ArrayHeaderError(format!(
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
        Ok((Self { element, is_by_columns, shape }, data))
    }

    /// The lengths of the array along its axes.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// True where the first index of an element runs fastest, false where the last one does.
    pub fn is_by_columns(&self) -> bool {
        self.is_by_columns
    }

    /// Bytes of an element.
    pub fn element_bytes(&self) -> usize {
        self.element.bytes
    }

    /// The number that the bytes of one element are, rounded where an f64 does not hold it.
    pub fn number(&self, bytes: &[u8]) -> f64 {
        self.element.number(bytes)
    }
}
