//! Headers of `.ply` files.

use std::collections::HashSet;
use std::fmt::{self, Display};

use ply_rs_bw::ply::{Encoding, ScalarType};

use crate::scan::reader::error::{Problem, quoted};
use crate::scan::reader::lines::{Lines, text_of};
use crate::scan::reader::supported::HEADER_BYTES_MAX;

/// What a header declares.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
}

/// An element, and its properties in order.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
    line: usize,
}

/// A property, under any name: programs give their own ones those of units and dimensions.
#[derive(Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
    line: usize,
}

/// The type of a property.
#[derive(Debug)]
pub(super) enum Kind {
    Scalar(Type),
    /// Types of the length and of the values.
    List(Type, Type),
}

/// The type of a value.
#[derive(Debug)]
pub(super) enum Type {
    Known(ScalarType),
    /// One of that many bytes that is only skipped.
    Wide(usize),
    /// One that nothing is known of but its name: in text it can be skipped.
    Unknown(String),
}

impl Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Known(scalar) => write!(f, "{scalar:?}"),
            Self::Wide(bytes) => write!(f, "a number of {bytes} bytes"),
            Self::Unknown(name) => write!(f, "{}", quoted(name)),
        }
    }
}

impl Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scalar(scalar) => write!(f, "{scalar}"),
            Self::List(length, value) => write!(f, "a list of {value} with a length of {length}"),
        }
    }
}

impl Type {
    fn named(name: &str) -> Self {
        Self::Known(match name {
            "char" | "int8" => ScalarType::Char,
            "uchar" | "uint8" => ScalarType::UChar,
            "short" | "int16" => ScalarType::Short,
            "ushort" | "uint16" => ScalarType::UShort,
            "int" | "int32" => ScalarType::Int,
            "uint" | "uint32" => ScalarType::UInt,
            "float" | "float32" => ScalarType::Float,
            "double" | "float64" => ScalarType::Double,
            "half" | "float16" => return Self::Wide(2),
            "int64" | "uint64" => return Self::Wide(8),
            _ => return Self::Unknown(name.to_owned()),
        })
    }
}

impl Header {
    /// The header of a file, and the lines after it.
    pub(super) fn take(bytes: &[u8]) -> Result<(Self, Lines<'_>), Problem> {
        let mut lines = Lines::of(bytes);
        match lines.next() {
            Some((_, b"ply")) => {}
            Some((line, text)) => {
                return Err(Problem::at_line(line, format!("not a ply header: {}", quoted(&text_of(text)))));
            }
            None => return Err(Problem::new("not a ply header: the file is empty")),
        }
        let (mut encoding, mut elements) = (None, Vec::new());
        while let Some((line, text)) = lines.next() {
            if bytes.len() - lines.rest().len() > HEADER_BYTES_MAX {
                break;
            }
            let text = text_of(text);
            let at_line = |problem: String| Problem::at_line(line, problem);
            match text.split_once([' ', '\t']).unwrap_or((&text, "")) {
                ("" | "comment" | "obj_info", _) => {}
                ("format", words) => encoding = Some(named_encoding(words).map_err(at_line)?),
                ("element", words) => elements.push(Element::of(line, words).map_err(at_line)?),
                ("property", words) => {
                    let property = Property::of(line, words).map_err(at_line)?;
                    let element: Option<&mut Element> = elements.last_mut();
                    let element =
                        element.ok_or_else(|| at_line("a property before any element".to_owned()))?;
                    element.properties.push(property);
                }
                ("end_header", _) => {
                    let encoding =
                        encoding.ok_or_else(|| Problem::new("not a ply header: it has no format line"))?;
                    return Self { encoding, elements }.checked().map(|header| (header, lines));
                }
                _ => {
                    let problem = "is none of format, element, property, comment, obj_info, end_header";
                    return Err(at_line(format!("{} {problem}", quoted(&text))));
                }
            }
        }
        Err(Problem::new("not a ply header: it has no line end_header"))
    }

    /// Refuses what would misplace all that follows.
    fn checked(self) -> Result<Self, Problem> {
        let mut names = HashSet::new();
        for Element { name, line, .. } in &self.elements {
            if !names.insert(name.as_str()) {
                return Err(Problem::at_line(*line, format!("element {} is declared twice", quoted(name))));
            }
        }
        Ok(self)
    }
}

fn named_encoding(words: &str) -> Result<Encoding, String> {
    let name = words.split_ascii_whitespace().next().unwrap_or_default();
    match name {
        "ascii" => Ok(Encoding::Ascii),
        "binary_little_endian" => Ok(Encoding::BinaryLittleEndian),
        "binary_big_endian" => Ok(Encoding::BinaryBigEndian),
        _ => {
            Err(format!("format {} is none of ascii, binary_little_endian, binary_big_endian", quoted(name)))
        }
    }
}

impl Element {
    /// The element of a line `element NAME COUNT`.
    fn of(line: usize, words: &str) -> Result<Self, String> {
        let (name, count) = words.trim().rsplit_once([' ', '\t']).unwrap_or((words.trim(), ""));
        let count = count.parse().map_err(|_| {
            format!("\"element {name} {count}\" has no number from 0 on: {} is not one", quoted(count))
        })?;
        Ok(Self { name: name.trim().to_owned(), count, properties: Vec::new(), line })
    }
}

impl Property {
    /// The property of a line `property TYPE NAME` or `property list TYPE TYPE NAME`.
    fn of(line: usize, words: &str) -> Result<Self, String> {
        let mut rest = words;
        let mut next = || {
            let (word, after) = rest.trim_start().split_once([' ', '\t'])?;
            rest = after;
            Some(word)
        };
        let missing = || format!("\"property {words}\" has no type and name");
        let kind = match next().ok_or_else(missing)? {
            "list" => {
                let [length, value] = [next(), next()].map(|word| word.ok_or_else(missing).map(Type::named));
                Kind::List(length?, value?)
            }
            scalar => Kind::Scalar(Type::named(scalar)),
        };
        match rest.trim() {
            "" => Err(missing()),
            name => Ok(Self { name: name.to_owned(), kind, line }),
        }
    }

    /// A problem of this property, with its line.
    pub(super) fn problem(&self, problem: impl std::fmt::Display) -> Problem {
        Problem::at_line(self.line, format!("property {}: {problem}", quoted(&self.name)))
    }
}
