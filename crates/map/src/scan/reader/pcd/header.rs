//! Headers of `.pcd` files.

use std::collections::HashMap;

use crate::scan::reader::axis::{AxisProblem, axes};
use crate::scan::reader::error::{Problem, quoted};
use crate::scan::reader::lines::{Lines, text_of};
use crate::scan::reader::supported::HEADER_BYTES_MAX;

/// How the points follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DataKind {
    Ascii,
    Binary,
    BinaryCompressed,
}

impl DataKind {
    /// Its name in a header.
    pub(super) fn as_str(self) -> &'static str {
        match self {
            Self::Ascii => "ascii",
            Self::Binary => "binary",
            Self::BinaryCompressed => "binary_compressed",
        }
    }

    fn named(name: &str) -> Option<Self> {
        let all = [Self::Ascii, Self::Binary, Self::BinaryCompressed];
        all.into_iter().find(|kind| name.eq_ignore_ascii_case(kind.as_str()))
    }
}

/// A field of every point.
#[derive(Debug)]
pub(super) struct Field {
    /// The coordinate that it holds, 0 to 2.
    pub(super) axis: Option<usize>,
    /// Bytes of one of its values.
    pub(super) size: u64,
    /// How many values it has; none where 0, a padding that takes no bytes.
    pub(super) count: u64,
}

/// What a header declares.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    pub(super) points: u64,
    pub(super) data: DataKind,
}

impl Header {
    /// The header of a file, and the lines after it.
    pub(super) fn take(bytes: &[u8]) -> Result<(Self, Lines<'_>), Problem> {
        let mut lines = Lines::of(bytes);
        let mut entries = Entries::default();
        while let Some((number, line)) = lines.next() {
            if bytes.len() - lines.rest().len() > HEADER_BYTES_MAX {
                break;
            }
            let text = text_of(line);
            let mut words = text.split('#').next().unwrap_or_default().split_ascii_whitespace();
            let Some(name) = words.next() else { continue };
            let name = match name.to_ascii_uppercase() {
                name if name == "COLUMNS" => "FIELDS".to_owned(),
                name => name,
            };
            let is_last = name == "DATA";
            entries.0.insert(name, Entry { line: number, values: words.map(str::to_owned).collect() });
            if is_last {
                return Ok((Self::of(&entries)?, lines));
            }
        }
        Err(Problem::new("not a pcd header: it has no DATA line"))
    }

    fn of(entries: &Entries) -> Result<Self, Problem> {
        let names = entries.needed("FIELDS")?;
        let sizes = entries.numbers("SIZE", names)?.ok_or_else(|| missing("SIZE"))?;
        let types = entries.of_fields("TYPE", names)?.ok_or_else(|| missing("TYPE"))?;
        let counts = entries.numbers("COUNT", names)?.unwrap_or_else(|| vec![1; names.values.len()]);
        let mut fields: Vec<Field> =
            sizes.iter().zip(&counts).map(|(&size, &count)| Field { axis: None, size, count }).collect();
        let words: Vec<&str> = names.values.iter().map(String::as_str).collect();
        let axes = axes(&words).map_err(|problem| match problem {
            AxisProblem::Missing(name) => {
                Problem::at_line(names.line, format!("no field {name} in the header"))
            }
            AxisProblem::Twice(name) => {
                Problem::at_line(names.line, format!("field {name} is declared twice"))
            }
        })?;
        for (axis, place) in axes.into_iter().enumerate() {
            let (Field { size, count, .. }, of_type) = (&fields[place], &types.values[place]);
            if !of_type.eq_ignore_ascii_case("F") || !matches!((size, count), (4 | 8, 1)) {
                return Err(Problem::new(format!(
                    "field {} is {count} of type {of_type} and size {size}, one of type F and size 4 or 8 is needed",
                    words[place]
                )));
            }
            fields[place].axis = Some(axis);
        }
        Ok(Self { fields, points: entries.points()?, data: entries.data()? })
    }
}

/// The lines of a header by their names.
#[derive(Default)]
struct Entries(HashMap<String, Entry>);

struct Entry {
    line: usize,
    values: Vec<String>,
}

impl Entry {
    fn parse<T: std::str::FromStr>(&self, name: &str, value: &str) -> Result<T, Problem> {
        value.parse().map_err(|_| {
            Problem::at_line(self.line, format!("{name} {} is not a number from 0 on", quoted(value)))
        })
    }
}

fn missing(name: &str) -> Problem {
    Problem::new(format!("not a pcd header: it has no {name} line"))
}

impl Entries {
    fn needed(&self, name: &str) -> Result<&Entry, Problem> {
        self.0.get(name).ok_or_else(|| missing(name))
    }

    /// An entry with a value for each field, if the header has it.
    fn of_fields(&self, name: &str, fields: &Entry) -> Result<Option<&Entry>, Problem> {
        let Some(entry) = self.0.get(name) else { return Ok(None) };
        let (have, need) = (entry.values.len(), fields.values.len());
        match have == need {
            true => Ok(Some(entry)),
            false => Err(Problem::at_line(entry.line, format!("{name} has {have} values, FIELDS {need}"))),
        }
    }

    /// A number for each field, if the header has the entry.
    fn numbers(&self, name: &str, fields: &Entry) -> Result<Option<Vec<u64>>, Problem> {
        let Some(entry) = self.of_fields(name, fields)? else { return Ok(None) };
        entry.values.iter().map(|value| entry.parse(name, value)).collect::<Result<_, _>>().map(Some)
    }

    /// The first value of an entry, a number, if the header has it.
    fn number(&self, name: &str) -> Result<Option<u64>, Problem> {
        let Some(entry) = self.0.get(name) else { return Ok(None) };
        let value = entry.values.first().map_or("", String::as_str);
        entry.parse(name, value).map(Some)
    }

    /// How many points follow: POINTS, or else WIDTH times HEIGHT.
    fn points(&self) -> Result<u64, Problem> {
        let (points, width, height) = (self.number("POINTS")?, self.number("WIDTH")?, self.number("HEIGHT")?);
        match (points, width) {
            (Some(points), _) => Ok(points),
            (None, Some(width)) => Ok(width.saturating_mul(height.unwrap_or(1))),
            (None, None) => Err(Problem::new("not a pcd header: it has neither POINTS nor WIDTH")),
        }
    }

    fn data(&self) -> Result<DataKind, Problem> {
        let entry = self.needed("DATA")?;
        let name = entry.values.first().map_or("", String::as_str);
        DataKind::named(name).ok_or_else(|| {
            let problem = format!("DATA {} is none of ascii, binary, binary_compressed", quoted(name));
            Problem::at_line(entry.line, problem)
        })
    }
}
