//! The header of a map file, see [`super`].

use uuid::Uuid;

use crate::codec::Unreadable;
use crate::compression::checksum_after;
use mrol_map::util::StopSignal;

/// Format version that this build writes; it reads this one and all earlier ones. Version 1 has the voxels as masks of
/// 64 bytes, and neither withdrawn scans nor requests. Up to version 2 moments have no forms; up to version 3 the
/// header has neither head nor uuid; up to version 4 scans have no session, and those that were undone are not stored;
/// up to version 5 no deletion was taken back; up to version 6 there are no keep-outs, and all maps have filters and
/// moments; up to version 7 there are no viewpoints.
pub const FORMAT_VERSION: u32 = 8;

const MAGIC: &[u8; 8] = b"MROL-MAP";
/// Bytes of the header up to version 3, from version 4 on, and from version 8 on.
const HEADER_BYTES_1: usize = 24;
const HEADER_BYTES_4: usize = 48;
pub(crate) const HEADER_BYTES: usize = 56;
pub(super) const VERSION: std::ops::Range<usize> = 8..12;
const CHECKED_FROM: usize = 16;
const BODY_BYTES_AT: usize = 16;
const HEAD_AT: usize = 24;
const UUID_AT: usize = 32;
const PARTS_AT: usize = 48;

/// What is in a file behind its header, when its checksum is right.
pub(super) struct Frames<'b> {
    /// What it says of the parts that its viewpoints lie in.
    pub(super) parts: &'b [u8],
    /// The compressed body.
    pub(super) body: &'b [u8],
    /// Bytes of the body before compression.
    pub(super) body_bytes: u64,
}

/// The header of a file with a body of so many bytes, up to where its parts come.
pub(super) fn begun(body_bytes: usize, head: u64, uuid: Uuid) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES + body_bytes / 2);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&FORMAT_VERSION.to_le_bytes());
    bytes.extend_from_slice(&[0; 4]);
    bytes.extend_from_slice(&(body_bytes as u64).to_le_bytes());
    bytes.extend_from_slice(&head.to_le_bytes());
    bytes.extend_from_slice(uuid.as_bytes());
    bytes.extend_from_slice(&parts_lock(&[]));
    bytes
}

/// Length and checksum of what a file says of its parts.
fn parts_lock(parts: &[u8]) -> [u8; HEADER_BYTES - PARTS_AT] {
    let (length, checksum) = (parts.len() as u32, crc32c::crc32c(parts));
    std::array::from_fn(|i| [length, checksum][i / 4].to_le_bytes()[i % 4])
}

/// Checks the header and the checksum of a file.
pub(super) fn checked_frames<'b>(bytes: &'b [u8], stop: StopSignal<'_>) -> Result<Frames<'b>, Unreadable> {
    let too_short = || format!("{} bytes are too few for a map file's header", bytes.len());
    let header = bytes.get(..HEADER_BYTES_1).ok_or_else(too_short)?;
    if &header[..8] != MAGIC {
        return Err("not a map file: it does not begin with MROL-MAP".into());
    }
    let version = u32_at(header, VERSION.start);
    if version == 0 || version > FORMAT_VERSION {
        return Err(format!(
            "format version {version}, this build reads 1 to {FORMAT_VERSION}: use a newer one"
        ));
    }
    let (parts, body) = match version {
        1..4 => (&[][..], bytes.get(HEADER_BYTES_1..).ok_or_else(too_short)?),
        4..8 => (&[][..], bytes.get(HEADER_BYTES_4..).ok_or_else(too_short)?),
        _ => split_parts(bytes).ok_or_else(too_short)?,
    };
    let (stored, computed) = (u32_at(header, 12), checksum(bytes, version, stop));
    if stored != computed {
        return Err(format!("checksum {computed:08x} from offset {CHECKED_FROM} on, {stored:08x} expected"));
    }
    Ok(Frames { parts, body, body_bytes: u64_at(header, BODY_BYTES_AT) })
}

/// What a file of the present version says of its parts, and its compressed body; none where it is too short.
fn split_parts(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (header, rest) = bytes.split_at_checked(HEADER_BYTES)?;
    rest.split_at_checked(u32_at(header, PARTS_AT) as usize)
}

/// The journal's head in the map file `bytes`, which must be complete; none up to version 3.
pub(crate) fn head_of(bytes: &[u8]) -> Option<u64> {
    Some(u64_at(header_4(bytes)?, HEAD_AT))
}

/// Writes the head of the journal, and what the file says of its parts, into the map file `bytes`, which says nothing
/// of parts before.
pub(crate) fn complete(bytes: &mut Vec<u8>, head: u64, parts: &[u8]) {
    bytes[HEAD_AT..UUID_AT].copy_from_slice(&head.to_le_bytes());
    bytes[PARTS_AT..HEADER_BYTES].copy_from_slice(&parts_lock(parts));
    bytes.splice(HEADER_BYTES..HEADER_BYTES, parts.iter().copied());
    set_checksum(bytes, StopSignal::NEVER);
}

/// Bytes from the start of a file that hold what it says of its parts, by its header; none of a file that says nothing.
pub(crate) fn bytes_with_parts(header: &[u8]) -> Option<usize> {
    let header = header.get(..HEADER_BYTES).filter(|header| u32_at(header, VERSION.start) >= 8)?;
    let length = u32_at(header, PARTS_AT) as usize;
    (length > 0).then_some(HEADER_BYTES + length)
}

/// What a file says of its parts, read from its start alone; none where that is damaged.
pub(crate) fn parts_in_start(start: &[u8]) -> Option<&[u8]> {
    let (parts, _) = split_parts(start)?;
    (start[PARTS_AT..HEADER_BYTES] == parts_lock(parts)).then_some(parts)
}

/// The uuid in the header of a map file, which may be damaged; none up to version 3.
pub(crate) fn uuid_in(header: &[u8]) -> Option<Uuid> {
    Uuid::from_slice(&header_4(header)?[UUID_AT..PARTS_AT]).ok()
}

/// The header of a file from version 4 on.
fn header_4(bytes: &[u8]) -> Option<&[u8]> {
    bytes.get(..HEADER_BYTES_4).filter(|header| u32_at(header, VERSION.start) >= 4)
}

/// Bytes of the body of the map file `bytes` before compression.
pub fn body_bytes(bytes: &[u8]) -> u64 {
    bytes.get(..HEADER_BYTES_1).map_or(0, |header| u64_at(header, BODY_BYTES_AT))
}

pub(super) fn set_checksum(bytes: &mut [u8], stop: StopSignal<'_>) {
    let checksum = checksum(bytes, FORMAT_VERSION, stop);
    bytes[12..CHECKED_FROM].copy_from_slice(&checksum.to_le_bytes());
}

fn checksum(bytes: &[u8], version: u32, stop: StopSignal<'_>) -> u32 {
    let of_version = if version < 3 { 0 } else { crc32c::crc32c(&bytes[VERSION]) };
    checksum_after(of_version, &bytes[CHECKED_FROM..], stop)
}

fn u64_at(bytes: &[u8], offset: usize) -> u64 {
    u64::from(u32_at(bytes, offset)) | u64::from(u32_at(bytes, offset + 4)) << 32
}

fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[offset + i]))
}
