//! What the columns of a row of numbers hold.

use std::str::FromStr;

use super::axis::axes;
use super::error::quoted;

/// Most columns of a row.
const COLUMNS_MAX: usize = 64;

/// How many columns a row of numbers has, and which hold x, y and z: `"x y z i"` is a row of four.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns {
    pub(super) axes: [usize; 3],
    pub(super) count: usize,
}

/// A text that names no columns.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("columns must name x, y and z once each, 64 names at most, such as \"x y z i\", got {0}")]
pub struct ColumnsError(String);

impl Columns {
    /// Rows of x y z and so many more numbers.
    pub(super) const fn xyz_and(more: usize) -> Self {
        Self { axes: [0, 1, 2], count: 3 + more }
    }
}

impl FromStr for Columns {
    type Err = ColumnsError;

    fn from_str(text: &str) -> Result<Self, ColumnsError> {
        let names: Vec<&str> = text.split([' ', ',']).filter(|name| !name.is_empty()).collect();
        let found = axes(&names).ok().filter(|_| names.len() <= COLUMNS_MAX);
        found.map(|axes| Self { axes, count: names.len() }).ok_or_else(|| ColumnsError(quoted(text)))
    }
}
