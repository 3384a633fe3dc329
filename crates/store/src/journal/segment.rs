//! Segments: files of the journal, with frames of consecutive revisions.
//!
//! ```text
//! offset  bytes
//!      0  8      magic "MROL-JNL"
//!      8  4      format version, u32 little-endian: 7
//!     12  4      CRC-32C of bytes 16 to 64, u32 little-endian
//!     16  16     uuid of the map
//!     32  8      revision of the first frame, u64 little-endian
//!     40  8      the journal's head when the segment was begun, the last revision that is durable before it, u64
//!                little-endian; zero up to version 2
//!     48  16     zero
//!     64  rest   frames, see `frame.rs`
//! ```
//!
//! Its name, `journal-REVISION.log`, repeats the first revision in 20 digits, so that names sort as revisions do.

use std::path::Path;

use uuid::Uuid;

use super::frame::{self, Frame};
use crate::error::StoreError;
use mrol_map::map::REVISION_MAX;

/// Format version that this build writes; it reads this one and all earlier ones. In version 1 moments have no forms;
/// up to version 2 segments have no head; up to version 3 scans have no session; up to version 4 no undo
/// put voxels back, and no scan carved; up to version 5 there are no keep-outs; up to version 6 no scan left a
/// viewpoint.
pub const JOURNAL_VERSION: u32 = 7;
const MAGIC: &[u8; 8] = b"MROL-JNL";
const CHECKED_FROM: usize = 16;
const UUID_BYTES: usize = 16;
const HEAD: usize = 40;
pub(crate) const HEADER_BYTES: usize = 64;

/// The file name of the segment that begins with revision `first`.
pub(super) fn file_name(first: u64) -> String {
    format!("journal-{first:020}.log")
}

/// The first revision of a segment, from its file name; none where it is not a segment's.
pub(crate) fn first_revision(name: &str) -> Option<u64> {
    let first = name.strip_prefix("journal-")?.strip_suffix(".log")?.parse().ok()?;
    (first <= REVISION_MAX && file_name(first) == name).then_some(first)
}

/// The header of a segment that begins with revision `first`, where `first - 1` is durable.
pub(super) fn header(map: Uuid, first: u64) -> Vec<u8> {
    let head = first.saturating_sub(1);
    let checked = [&map.as_bytes()[..], &first.to_le_bytes(), &head.to_le_bytes(), &[0; 16]].concat();
    let (version, checksum) = (JOURNAL_VERSION.to_le_bytes(), crc32c::crc32c(&checked).to_le_bytes());
    [&MAGIC[..], &version, &checksum, &checked].concat()
}

/// Where and why a segment cannot be read any further.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Break {
    /// The first byte that is wrong.
    pub(crate) offset: usize,
    /// The revision that should stand there.
    pub(crate) revision: u64,
    /// The largest revision that a frame behind it has.
    pub(crate) last_behind: Option<u64>,
    pub(crate) reason: String,
    /// True when a crash while it was written explains the damage: nothing that is known to have been durable is lost.
    pub(crate) torn: bool,
    /// Uuid of the other map that the segment belongs to, if so.
    pub(crate) foreign: Option<Uuid>,
}

/// Reader of a segment's frames; the segment's bytes are passed to each step.
#[derive(Debug)]
pub(super) struct Frames {
    map: Uuid,
    offset: usize,
    revision: u64,
}

impl Frames {
    /// Reads the header of the segment `bytes` of the map `map`, whose name says that it begins with revision `first`.
    pub(super) fn of(bytes: &[u8], map: Uuid, first: u64) -> Result<Self, Break> {
        let frames = Self { map, offset: HEADER_BYTES, revision: first };
        let blank = bytes.iter().all(|&byte| byte == 0);
        let expected = header(map, first);
        let Some((header, _)) = bytes.split_at_checked(HEADER_BYTES) else {
            let reason = format!("a segment's header of {HEADER_BYTES} bytes is cut short");
            return Err(frames.broken(bytes, 0, reason, blank || expected.starts_with(bytes)));
        };
        match check_header(header, &expected) {
            Ok(()) => Ok(frames),
            Err(reason) => {
                let foreign = owner(header).filter(|&owner| owner != map);
                Err(Break { foreign, ..frames.broken(bytes, 0, reason, blank) })
            }
        }
    }

    /// Reads the next frame; none at the segment's end.
    pub(super) fn next<'a>(&mut self, bytes: &'a [u8]) -> Result<Option<Frame<'a>>, Break> {
        match frame::read(bytes, self.offset, self.map) {
            Ok(Some(frame)) if frame.revision == self.revision => {
                self.offset += frame.len();
                self.revision += 1;
                Ok(Some(frame))
            }
            Ok(Some(frame)) => {
                let reason = format!("revision {} where {} should be", frame.revision, self.revision);
                Err(self.broken(bytes, self.offset, reason, false))
            }
            Ok(None) => Ok(None),
            Err(bad) => Err(self.broken(bytes, self.offset, bad.reason, bad.torn)),
        }
    }

    /// Number of bytes that were read.
    pub(super) fn offset(&self) -> usize {
        self.offset
    }

    /// The revision of the next frame.
    pub(super) fn next_revision(&self) -> u64 {
        self.revision
    }

    /// The break at `offset`. It counts as torn by a crash only where no later frame says that it was durable.
    fn broken(&self, bytes: &[u8], offset: usize, reason: String, torn: bool) -> Break {
        let behind = frame::newest_behind(bytes, offset + 1, self.map);
        let was_durable = behind.is_some_and(|newest| newest.durable >= self.revision);
        let (revision, torn) = (self.revision, torn && !was_durable);
        let last_behind = behind.map(|newest| newest.revision);
        Break { offset, revision, last_behind, reason, torn, foreign: None }
    }
}

fn check_header(header: &[u8], expected: &[u8]) -> Result<(), String> {
    if header[..8] != MAGIC[..] {
        return Err("not a journal: it does not begin with MROL-JNL".into());
    }
    let version = u32::from_le_bytes(std::array::from_fn(|i| header[8 + i]));
    if version == 0 || version > JOURNAL_VERSION {
        return Err(format!(
            "format version {version}, this build reads 1 to {JOURNAL_VERSION}: use a newer one"
        ));
    }
    let stored = u32::from_le_bytes(std::array::from_fn(|i| header[12 + i]));
    if crc32c::crc32c(&header[CHECKED_FROM..]) != stored {
        return Err("the segment's header has a wrong checksum".into());
    }
    // Up to version 2 segments have no head.
    let has_head = version >= 3 || header[HEAD..].iter().any(|&byte| byte != 0);
    let end = if has_head { HEADER_BYTES } else { HEAD };
    if header[CHECKED_FROM..end] != expected[CHECKED_FROM..end] {
        return Err(
            "another map's, or renamed: uuid or first revision differ from the snapshot and the name".into(),
        );
    }
    Ok(())
}

/// The uuid in a segment's `header`; none where the header is damaged.
pub(crate) fn owner(header: &[u8]) -> Option<Uuid> {
    let header = header.get(..HEADER_BYTES).filter(|header| header[..8] == MAGIC[..])?;
    let stored = u32::from_le_bytes(std::array::from_fn(|i| header[12 + i]));
    let is_whole = crc32c::crc32c(&header[CHECKED_FROM..]) == stored;
    let uuid = Uuid::from_slice(&header[CHECKED_FROM..CHECKED_FROM + UUID_BYTES]).ok();
    uuid.filter(|_| is_whole)
}

impl Break {
    /// The error of this break, for the segment at `path` of the map `map`.
    pub(super) fn of(self, path: &Path, map: Uuid) -> StoreError {
        if let Some(found) = self.foreign {
            return StoreError::Foreign { path: path.to_owned(), found, expected: map };
        }
        StoreError::at(path, self.offset, self.revision, self.reason)
    }
}
