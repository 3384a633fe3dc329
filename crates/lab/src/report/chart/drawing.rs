//! Sizes and colors that all plots share, and the outcome of drawing.

use std::path::Path;

use plotters::prelude::*;

use crate::report::error::ReportError;

pub(super) type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Width and height of one plot, pixels; panels are side by side.
pub(super) const SIZE_PX: (u32, u32) = (900, 480);

pub(super) const TITLE_PX: i32 = 18;

pub(super) const LABEL_PX: i32 = 14;

pub(super) const MARGIN_PX: i32 = 12;

/// Colors that can be told apart with a color vision deficiency and in print.
pub(super) const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    BLACK,
    RGBColor(86, 180, 233),
];

pub(super) fn drawn(path: &Path, outcome: Outcome<()>) -> Result<(), ReportError> {
    outcome.map_err(|error| ReportError::Draw { path: path.to_owned(), reason: error.to_string() })
}
