//! Surveys: LAS and LAZ of the ASPRS, E57 of the ASTM, in double precision and part by part.
//!
//! ```text
//! las_reader     points of .las and .laz           las_writer     centers of voxels to them
//!   las_claims   what their headers claim, checked against the file before anything is read by it
//!   las_units    the units that they name            failing_late   a file whose failures are told once it is whole
//! e57_reader     scans of .e57, with their poses   e57_writer     centers of voxels to it
//!   e57_claims   what its XML asks of a parser
//! lacking        the same names in a program without the feature `surveys`
//! ```

#[cfg(feature = "surveys")]
mod e57_claims;
#[cfg(feature = "surveys")]
mod e57_reader;
mod e57_scan;
#[cfg(feature = "surveys")]
mod e57_writer;
mod error;
#[cfg(feature = "surveys")]
mod failing_late;
#[cfg(not(feature = "surveys"))]
mod lacking;
#[cfg(feature = "surveys")]
mod las_claims;
mod las_kind;
#[cfg(feature = "surveys")]
mod las_reader;
#[cfg(feature = "surveys")]
mod las_units;
#[cfg(feature = "surveys")]
mod las_writer;

#[cfg(feature = "surveys")]
pub use e57_reader::{E57Points, E57Reader};
pub use e57_scan::E57Scan;
#[cfg(feature = "surveys")]
pub use e57_writer::write_e57;
pub use error::SurveyError;
#[cfg(not(feature = "surveys"))]
pub use lacking::{E57Points, E57Reader, LasReader, write_e57, write_las};
pub use las_kind::LasKind;
#[cfg(feature = "surveys")]
pub use las_reader::LasReader;
#[cfg(feature = "surveys")]
pub use las_writer::write_las;
