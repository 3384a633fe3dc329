//! Reading scans from files, by extension.
//!
//! A file is read whole before it is parsed, so that every count it declares can be checked against the bytes
//! that are there, before anything is allocated for it.

mod array_header;
mod axis;
mod bare;
mod columns;
mod coordinates;
mod count;
mod error;
mod files;
mod format;
mod lines;
mod natural;
mod npy;
mod pcd;
mod ply;
mod row_length;
mod supported;
#[cfg(test)]
mod tests;
mod text;
mod uos;

pub use array_header::{ArrayHeader, ArrayHeaderError};
pub use columns::{Columns, ColumnsError};
pub(super) use error::Problem;
pub use error::ReadError;
pub(super) use files::read_file;
pub use files::{
    parse_points, read_exact_points, read_exact_points_by, read_points, scan_files, scan_files_of,
};
pub(super) use lines::content_lines;
pub use natural::compare_names;
pub(super) use text::number;
pub(super) use uos::robot_from_uos;
