//! How messages are written and read: as prost does, of lists no longer than they may be.
//!
//! An element of a list may take no more than two bytes on the wire, and a hundred and more once it is decoded. So the
//! elements of all lists are counted first, in the bytes: of a message that has too many nothing is made. Numbers are
//! not counted, as they take in memory what they take on the wire.

mod bounded_codec;
mod elements;
mod most;
#[cfg(test)]
mod tests;
mod too_many;

pub use bounded_codec::{BoundedDecoder, Codec};
pub use most::{IGNORED_MAX, LINKS_MAX};
