//! The frames of map files and journals, made by the description of their bytes alone (`crates/store/src/snapshots`,
//! `crates/store/src/journal/segment.rs` and `frame.rs`): what is inside them reaches the decoders with right
//! checksums.

use uuid::Uuid;

const SEGMENT_HEADER_BYTES: usize = 64;
const FRAME_HEADER_BYTES: usize = 32;
const FRAME_ALIGNMENT: usize = 32;

/// A map file of version 3 around a body.
pub(super) fn map_file(body: &[u8]) -> Vec<u8> {
    let compressed = zstd::bulk::compress(body, 1).expect("memory");
    let (version, checked) =
        (3u32.to_le_bytes(), [&(body.len() as u64).to_le_bytes()[..], &compressed].concat());
    let checksum = crc32c::crc32c_append(crc32c::crc32c(&version), &checked).to_le_bytes();
    [b"MROL-MAP", &version[..], &checksum, &checked].concat()
}

/// A segment that begins with revision `first`, around records.
pub(super) fn segment(map: Uuid, first: u64, records: &[&[u8]]) -> Vec<u8> {
    let checked = [&map.as_bytes()[..], &first.to_le_bytes(), &[0; 24]].concat();
    let checksum = crc32c::crc32c(&checked).to_le_bytes();
    let mut segment = [&b"MROL-JNL"[..], &2u32.to_le_bytes(), &checksum, &checked].concat();
    for (revision, record) in (first..).zip(records) {
        segment.extend(frame(map, revision, record));
    }
    segment
}

fn frame(map: Uuid, revision: u64, record: &[u8]) -> Vec<u8> {
    let payload = zstd::bulk::compress(record, 1).expect("memory");
    let lengths = [payload.len() as u32, record.len() as u32].map(u32::to_le_bytes).concat();
    let revisions = [revision, revision - 1].map(u64::to_le_bytes).concat();
    let mut frame = [&lengths[..], &revisions, &[0; 8], &payload].concat();
    frame.resize((frame.len() + 1).next_multiple_of(FRAME_ALIGNMENT), 0xff);
    seal(map, &mut frame);
    frame
}

/// Makes the checksums of the frame at the front of `bytes` right, whatever stands in it.
pub(super) fn seal(map: Uuid, bytes: &mut [u8]) {
    let Some((header, rest)) = bytes.split_at_mut_checked(FRAME_HEADER_BYTES) else { return };
    let length = u32::from_le_bytes(std::array::from_fn(|i| header[i])) as usize;
    let payload = &rest[..length.min(rest.len())];
    header[24..28].copy_from_slice(&crc32c::crc32c(payload).to_le_bytes());
    let checksum = crc32c::crc32c_append(crc32c::crc32c(map.as_bytes()), &header[..28]);
    header[28..32].copy_from_slice(&checksum.to_le_bytes());
}

/// Where the frames of a segment begin, and where the last one ends; none where it does not end with a frame.
pub(super) fn boundaries(segment: &[u8]) -> Option<Vec<usize>> {
    let (mut boundaries, mut at) = (Vec::new(), SEGMENT_HEADER_BYTES);
    loop {
        boundaries.push(at);
        let rest = segment.get(at..)?;
        let Some(length) = rest.first_chunk() else { return rest.is_empty().then_some(boundaries) };
        let payload = u32::from_le_bytes(*length) as usize;
        at += (FRAME_HEADER_BYTES + payload + 1).next_multiple_of(FRAME_ALIGNMENT);
    }
}
