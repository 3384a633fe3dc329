//! Frames: how a record is stored in a segment.
//!
//! ```text
//! offset  bytes
//!      0  4      bytes of the payload, u32 (all numbers are little-endian)
//!      4  4      bytes of the record before compression, u32
//!      8  8      its revision, u64
//!     16  8      the last revision that was durable when this frame was written, u64
//!     24  4      CRC-32C of the payload, u32
//!     28  4      CRC-32C of the map's uuid and bytes 0 to 28, u32
//!     32  n      the payload: a zstd frame of a `Change` of proto/mrol/store/v1/records.proto
//! 32 + n  1-32   bytes of 0xff, so that the frame ends at a multiple of 32
//! ```
//!
//! The header has a checksum of its own, so that a length is believed before the payload is there. The uuid in it
//! keeps another map's frames out. What was durable when a frame was written is how a reader knows that an unreadable
//! frame before it had been acknowledged. A frame begins and ends with bytes that are not zero and never begins or ends
//! in the middle of 32 bytes, so that no part of it that lies in one sector is all zero, unless that sector was never
//! written.

use uuid::Uuid;

use super::mention::StoredRecord;
use super::record::{self, Record};
use crate::codec::Unreadable;
use mrol_map::map::Change;

const HEADER_BYTES: usize = 32;
const CHECKED_BYTES: usize = 28;
const ALIGNMENT: usize = 32;
const PADDING: u8 = 0xff;
/// Size of a disk's sector, bytes: what a crash left unwritten is at least one sector, or all up to the file's end.
const SECTOR_BYTES: usize = 512;

/// A frame whose checksums are right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Frame<'a> {
    pub(super) revision: u64,
    payload: &'a [u8],
    /// Bytes of the record before compression.
    bytes: u32,
}

/// Why a frame cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct BadFrame {
    pub(super) reason: String,
    /// True when the frame looks as if it had never been written completely.
    pub(super) torn: bool,
}

/// Appends a record's frame to `bytes`.
pub(super) fn write(record: &Record, revision: u64, durable: u64, map: Uuid, bytes: &mut Vec<u8>) {
    let start = bytes.len();
    bytes.extend_from_slice(&(record.payload.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&record.bytes.to_le_bytes());
    bytes.extend_from_slice(&revision.to_le_bytes());
    bytes.extend_from_slice(&durable.to_le_bytes());
    bytes.extend_from_slice(&record.checksum.to_le_bytes());
    let checksum = header_checksum(&bytes[start..], map);
    bytes.extend_from_slice(&checksum.to_le_bytes());
    bytes.extend_from_slice(&record.payload);
    bytes.resize(start + length_of(record.payload.len()), PADDING);
}

/// Bytes of a frame with a payload of `payload` bytes.
pub(super) fn length_of(payload: usize) -> usize {
    (HEADER_BYTES + payload + 1).next_multiple_of(ALIGNMENT)
}

/// Reads the frame at `offset` of a segment's `bytes`; none at their end.
pub(super) fn read(bytes: &[u8], offset: usize, map: Uuid) -> Result<Option<Frame<'_>>, BadFrame> {
    let rest = &bytes[offset..];
    if rest.is_empty() {
        return Ok(None);
    }
    let bad = |reason: String, end: usize| {
        let torn = end > bytes.len() || has_unwritten_sector(bytes, offset, end);
        Err(BadFrame { reason, torn })
    };
    let Some((header, rest)) = rest.split_at_checked(HEADER_BYTES) else {
        return bad(format!("a header of {HEADER_BYTES} bytes is cut short"), offset + HEADER_BYTES);
    };
    let Some(header) = Header::read(header, map) else {
        return bad("the header's checksum is wrong".into(), offset + HEADER_BYTES);
    };
    let length = header.payload_bytes as usize;
    let end = offset + length_of(length);
    let Some((payload, padding)) = rest.get(..end - offset - HEADER_BYTES).map(|rest| rest.split_at(length))
    else {
        return bad(format!("a record of {length} bytes is cut short"), end);
    };
    if crc32c::crc32c(payload) != header.checksum {
        return bad("the record's checksum is wrong".into(), end);
    }
    if padding.iter().any(|&byte| byte != PADDING) {
        return bad("the record's padding is wrong".into(), end);
    }
    Ok(Some(Frame { revision: header.revision, payload, bytes: header.bytes }))
}

/// Contents of a frame header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Newest {
    pub(super) revision: u64,
    pub(super) durable: u64,
}

/// The newest frame header from `offset` on, at any position: after damage it is unknown where the next frame begins.
pub(super) fn newest_behind(bytes: &[u8], offset: usize, map: Uuid) -> Option<Newest> {
    let headers = bytes.get(offset..)?.windows(HEADER_BYTES).filter_map(|header| Header::read(header, map));
    headers.map(|Header { revision, durable, .. }| Newest { revision, durable }).max_by_key(|it| it.revision)
}

impl Frame<'_> {
    /// Bytes of the frame.
    pub(super) fn len(&self) -> usize {
        length_of(self.payload.len())
    }

    pub(super) fn change(&self) -> Result<Change, Unreadable> {
        record::change_of(self.payload, self.bytes)
    }

    pub(super) fn stored(&self) -> StoredRecord {
        StoredRecord { payload: self.payload.to_vec(), bytes: self.bytes }
    }
}

struct Header {
    payload_bytes: u32,
    bytes: u32,
    revision: u64,
    durable: u64,
    checksum: u32,
}

impl Header {
    /// Reads a header; none where its checksum is wrong.
    fn read(header: &[u8], map: Uuid) -> Option<Self> {
        let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| header[at + i]));
        let u64_at = |at: usize| u64::from(u32_at(at)) | u64::from(u32_at(at + 4)) << 32;
        (u32_at(CHECKED_BYTES) == header_checksum(&header[..CHECKED_BYTES], map)).then(|| Self {
            payload_bytes: u32_at(0),
            bytes: u32_at(4),
            revision: u64_at(8),
            durable: u64_at(16),
            checksum: u32_at(24),
        })
    }
}

fn header_checksum(header: &[u8], map: Uuid) -> u32 {
    crc32c::crc32c_append(crc32c::crc32c(map.as_bytes()), header)
}

/// True when the part of a sector that the frame at `start..end` fills is all zero.
fn has_unwritten_sector(bytes: &[u8], start: usize, end: usize) -> bool {
    let sectors = start / SECTOR_BYTES..end.div_ceil(SECTOR_BYTES);
    sectors.into_iter().any(|sector| {
        let part = start.max(sector * SECTOR_BYTES)..end.min((sector + 1) * SECTOR_BYTES);
        bytes[part].iter().all(|&byte| byte == 0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::DeletionRecord;
    use mrol_map::voxel::VoxelKey;

    const MAP: Uuid = Uuid::from_u128(7);

    fn record(voxels: i32) -> Record {
        let voxels = (0..voxels).filter_map(|i| VoxelKey::new([i * i % 9973, i % 711, i])).collect();
        Record::of(&Change::Deletion(DeletionRecord { voxels, request: None })).unwrap()
    }

    fn frame(voxels: i32) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(&record(voxels), 5, 4, MAP, &mut bytes);
        bytes
    }

    #[test]
    fn a_frame_is_read_as_it_was_written() {
        let bytes = frame(100);
        let read = read(&bytes, 0, MAP).unwrap().unwrap();
        assert_eq!((read.revision, read.len()), (5, bytes.len()));
        assert_eq!(read.payload, record(100).payload);
        assert_eq!(super::read(&bytes, bytes.len(), MAP), Ok(None));
    }

    #[test]
    fn a_flipped_bit_anywhere_is_damage_and_never_taken_for_a_torn_end() {
        let good = frame(2000);
        assert!(good.len() > 4 * SECTOR_BYTES, "{} bytes", good.len());
        for bit in 0..good.len() * 8 {
            let mut bytes = good.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(!read(&bytes, 0, MAP).unwrap_err().torn, "bit {bit}");
        }
    }

    #[test]
    fn what_was_not_written_to_its_end_is_torn() {
        let good = frame(2000);
        for length in 1..good.len() {
            assert!(read(&good[..length], 0, MAP).unwrap_err().torn, "cut at {length}");
        }
        for sector in 0..good.len() / SECTOR_BYTES {
            let mut bytes = good.clone();
            bytes[sector * SECTOR_BYTES..(sector + 1) * SECTOR_BYTES].fill(0);
            assert!(read(&bytes, 0, MAP).unwrap_err().torn, "sector {sector}");
        }
    }

    #[test]
    fn another_maps_frame_is_none() {
        assert!(read(&frame(3), 0, Uuid::from_u128(8)).is_err());
    }

    #[test]
    fn what_was_durable_is_found_behind_what_cannot_be_read() {
        let bytes = [b"some rubbish".to_vec(), frame(3)].concat();
        assert_eq!(newest_behind(&bytes, 1, MAP), Some(Newest { revision: 5, durable: 4 }));
        assert_eq!(newest_behind(&bytes, 13, MAP), None);
    }
}
