//! MCAP, the format in which ROS 2 records: <https://mcap.dev/spec>.
//!
//! A file is read from its begin to its end, so that it needs no summary and may be cut off. A chunk is decompressed
//! and compared with its checksum before any message of it is used; what it claims about its size allocates nothing.

mod chunk;
mod fields;
mod reader;

pub use chunk::CHUNK_BYTES_MAX;
pub use reader::McapReader;
