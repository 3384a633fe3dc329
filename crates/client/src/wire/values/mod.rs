//! Values that messages share: fields that must be there, arrays of numbers, points, poses, regions and versions.

mod array;
mod field;
mod types;

pub use array::{bitmap_of, bytes_of};
pub(super) use array::{numbers_of, voxels_of, words_of};
pub use field::{InField, required};
pub use types::uuid_from;
pub(super) use types::{count_from, lookup_from, request_id_from, text_of};
