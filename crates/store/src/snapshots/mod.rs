//! Snapshots: a whole map in one file.
//!
//! ```text
//! offset  bytes
//!      0  8      magic "MROL-MAP"
//!      8  4      format version, u32 little-endian: 8
//!     12  4      CRC-32C of the version, from version 3 on, and of everything from offset 16, u32 little-endian
//!     16  8      bytes of the body before compression, u64 little-endian
//!     24  8      from version 4 on: head of the map's journal when the file was written, the last revision that may
//!                have been acknowledged, u64 little-endian
//!     32  16     from version 4 on: uuid of the map, as in the body
//!     48  4      from version 8 on: bytes n of the list of parts, u32 little-endian; 0 of a map file outside of a
//!                map's folder
//!     52  4      from version 8 on: CRC-32C of the list of parts, u32 little-endian
//!     56  n      the list of parts that the map's viewpoints lie in: `UsedViewpointParts` of
//!                proto/mrol/store/v1/snapshot.proto, see `viewpoint_parts`
//! 56 + n  rest   the body: a zstd frame of the message `Snapshot` of that file; from 48 on up to version 7, from 24 on
//!                up to version 3
//! ```
//!
//! The list of parts stands before the body, so that finding out which parts are needed reads only the start of the
//! file.
//!
//! `snapshot` is the map, `encoding` and `decoding` make bytes of it and it of bytes; `header`, `body` (which is read)
//! and `writing` (by which a body is written) are parts of the file.

mod body;
mod decoding;
mod encoding;
mod fields;
mod header;
mod limits;
mod snapshot;
#[cfg(test)]
mod tests;
mod viewpoints;
mod writing;

pub use header::{FORMAT_VERSION, body_bytes};
pub(crate) use header::{HEADER_BYTES, bytes_with_parts, complete, head_of, parts_in_start, uuid_in};
pub use limits::{MapFileError, MapFileLimits};
pub use snapshot::Snapshot;
