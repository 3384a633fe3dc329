//! The file of a part.
//!
//! ```text
//! offset  bytes
//!      0  8      magic "MROL-VPT"
//!      8  4      format version, u32 little-endian: 1
//!     12  4      CRC-32C of the version and of bytes 16 to 44, u32 little-endian: by this a snapshot knows the part
//!     16  16     uuid of the map
//!     32  8      bytes of the body before compression, u64 little-endian
//!     40  4      CRC-32C of the body from offset 44 on, u32 little-endian
//!     44  rest   the body: a zstd frame of the message `ViewpointPart` of proto/mrol/store/v1/snapshot.proto
//! ```
//!
//! The header has a checksum of its own, so that what it says of the map is believed or not without the body.

use std::io;
use std::sync::Arc;

use prost::Message;
use uuid::Uuid;

use crate::codec::Unreadable;
use crate::compression::{checksum_after, compress_onto, decompress};
use crate::pb;
use mrol_map::map::REVISION_MAX;
use mrol_map::util::StopSignal;
use mrol_map::visibility::Viewpoint;

const VERSION: u32 = 1;
const MAGIC: &[u8; 8] = b"MROL-VPT";
const CHECKED_FROM: usize = 16;
const BODY_CHECKSUM_AT: usize = 40;
pub(crate) const PART_HEADER_BYTES: usize = 44;
/// Most bytes of a part before compression. No memory is taken beyond it.
const PART_BYTES_MAX: u64 = 8 << 30;

/// Viewpoints between two checks of the stop signal: some milliseconds.
const VIEWPOINTS_PER_STOP_CHECK: usize = 16;

/// The file names of the part `number`, and of its copy.
pub(crate) fn part_names(number: u64) -> [String; 2] {
    ["part", "copy"].map(|which| format!("viewpoints-{number:020}.{which}"))
}

/// The number of a part, from its file name or that of its copy; none where it is neither.
pub(crate) fn part_number(name: &str) -> Option<u64> {
    let (number, _) = name.strip_prefix("viewpoints-")?.split_once('.')?;
    let number = number.parse().ok()?;
    // There is at most one for each revision.
    (number <= REVISION_MAX && part_names(number).iter().any(|it| it == name)).then_some(number)
}

/// The map that the part with this header belongs to; none where the header is damaged.
pub(crate) fn owner_of_part(header: &[u8]) -> Option<Uuid> {
    let header = header.get(..PART_HEADER_BYTES).filter(|header| &header[..8] == MAGIC)?;
    if checksum_of(header) != u32_at(header, 12) {
        return None;
    }
    Uuid::from_slice(&header[CHECKED_FROM..32]).ok()
}

/// What is in a part.
#[derive(Debug, Clone)]
pub(crate) struct ViewpointPart {
    /// By the revisions of their scans, ascending.
    pub(crate) viewpoints: Vec<(u64, Arc<Viewpoint>)>,
    /// Checksum of the header, and so of all that it has checksums of; 0 before it is encoded.
    pub(crate) checksum: u32,
}

impl ViewpointPart {
    pub(crate) fn new(viewpoints: Vec<(u64, Arc<Viewpoint>)>) -> Self {
        Self { viewpoints, checksum: 0 }
    }

    /// The bytes of the file of the map `uuid`.
    ///
    /// # Errors
    /// When compression fails, for want of memory.
    pub(crate) fn encode(self, uuid: Uuid) -> io::Result<(Self, Vec<u8>)> {
        let viewpoints = self.viewpoints.iter().map(|(revision, it)| (*revision, &**it).into()).collect();
        let body = pb::ViewpointPart { viewpoints }.encode_to_vec();
        let mut bytes = Vec::with_capacity(PART_HEADER_BYTES + body.len());
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        bytes.extend_from_slice(&[0; 4]);
        bytes.extend_from_slice(uuid.as_bytes());
        bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&[0; 4]);
        let mut bytes = compress_onto(bytes, &body, StopSignal::NEVER)?;
        let of_body = checksum_after(0, &bytes[PART_HEADER_BYTES..], StopSignal::NEVER);
        bytes[BODY_CHECKSUM_AT..PART_HEADER_BYTES].copy_from_slice(&of_body.to_le_bytes());
        let checksum = checksum_of(&bytes);
        bytes[12..CHECKED_FROM].copy_from_slice(&checksum.to_le_bytes());
        Ok((Self { checksum, ..self }, bytes))
    }

    /// The map that a file belongs to, and what is in it; meaningless once stopped.
    ///
    /// # Errors
    /// A description of what is wrong with the bytes.
    pub(crate) fn decode(bytes: &[u8], stop: StopSignal<'_>) -> Result<(Uuid, Self), Unreadable> {
        let Some((header, frame)) = bytes.split_at_checked(PART_HEADER_BYTES) else {
            return Err(format!("{} bytes are too few for the header of a part", bytes.len()));
        };
        if &header[..8] != MAGIC {
            return Err("not a part of a map's viewpoints: it does not begin with MROL-VPT".into());
        }
        let version = u32_at(header, 8);
        if version != VERSION {
            return Err(format!("format version {version}, this build reads {VERSION}: use a newer one"));
        }
        let (stored, checksum) = (u32_at(header, 12), checksum_of(header));
        if stored != checksum {
            return Err(format!("checksum {checksum:08x} of the header, {stored:08x} expected"));
        }
        let (stored, of_body) = (u32_at(header, BODY_CHECKSUM_AT), checksum_after(0, frame, stop));
        if stored != of_body {
            return Err(format!(
                "checksum {of_body:08x} from offset {PART_HEADER_BYTES} on, {stored:08x} expected"
            ));
        }
        let length = u64::from(u32_at(header, 32)) | u64::from(u32_at(header, 36)) << 32;
        if length > PART_BYTES_MAX {
            return Err(format!("a body of {length} bytes, at most {PART_BYTES_MAX} are read"));
        }
        let body = decompress(frame, length as usize, stop)
            .map_err(|e| format!("the body from offset {PART_HEADER_BYTES} on: {e}"))?;
        let message = pb::ViewpointPart::decode(&body[..]).map_err(|e| format!("the body: {e}"))?;
        let uuid = Uuid::from_slice(&header[CHECKED_FROM..32]).map_err(|e| format!("uuid: {e}"))?;
        let viewpoints = stop.paced(message.viewpoints, VIEWPOINTS_PER_STOP_CHECK).map(TryInto::try_into);
        let viewpoints: Vec<(u64, Arc<Viewpoint>)> = viewpoints.collect::<Result<_, Unreadable>>()?;
        match viewpoints.is_sorted_by(|(one, _), (next, _)| one < next) {
            true => Ok((uuid, Self { viewpoints, checksum })),
            false => Err("the revisions of its viewpoints must ascend".into()),
        }
    }
}

/// The checksum of the header that `bytes` begin with.
fn checksum_of(bytes: &[u8]) -> u32 {
    crc32c::crc32c_append(crc32c::crc32c(&bytes[8..12]), &bytes[CHECKED_FROM..PART_HEADER_BYTES])
}

fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[offset + i]))
}
