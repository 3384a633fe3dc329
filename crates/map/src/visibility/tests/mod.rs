//! Tests of visibility.

mod gaps;
mod images;
mod scenes;
