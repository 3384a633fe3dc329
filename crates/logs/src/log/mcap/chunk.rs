//! Chunks: records that were compressed together.

use std::io::Read;

use super::fields::Fields;
use crate::log::error::DamageKind;
use mrol_map::util::excerpt;

/// Bytes of a record of the file, and of the content of a chunk, at most. Recorders write chunks of 1 to 16 MiB.
pub const CHUNK_BYTES_MAX: usize = 64 << 20;

/// Binary logarithm of the bytes that zstd looks back at most, 32 MiB: more than any recorder asks for.
const ZSTD_WINDOW_LOG_MAX: u32 = 25;

/// Puts the records of a chunk, decompressed, into `content`; those of chunks of more than `bytes_max` bytes are not
/// read.
///
/// # Errors
/// When it is not as it says, or larger than is read.
pub(super) fn unpack(body: &[u8], content: &mut Vec<u8>, bytes_max: usize) -> Result<(), DamageKind> {
    content.clear();
    let mut fields = Fields::new("chunk", body);
    // The times of its first and last message.
    fields.u64()?;
    fields.u64()?;
    let len = fields.u64()?;
    let claimed = fields.u32()?;
    let compression = fields.text()?;
    let compressed_len = fields.u64()?;
    let rest = fields.rest();
    let compressed = usize::try_from(compressed_len).ok().and_then(|len| rest.get(..len));
    let compressed = compressed.ok_or(DamageKind::Format("chunk"))?;
    if len > bytes_max as u64 {
        return Err(DamageKind::TooLong { bytes: len, max: bytes_max });
    }
    // One byte more than it says shows that there is more.
    let most = len + 1;
    let read = match compression {
        "" => compressed.take(most).read_to_end(content),
        "zstd" => zstd::stream::read::Decoder::with_buffer(compressed).and_then(|mut decoder| {
            decoder.window_log_max(ZSTD_WINDOW_LOG_MAX)?;
            decoder.take(most).read_to_end(content)
        }),
        "lz4" => lz4_flex::frame::FrameDecoder::new(compressed).take(most).read_to_end(content),
        other => return Err(DamageKind::Compression(excerpt(other))),
    };
    read.map_err(|error| DamageKind::Decompression(error.to_string()))?;
    if content.len() as u64 != len {
        let more = if content.len() as u64 > len { "more" } else { "less" };
        return Err(DamageKind::Decompression(format!("it has {more} than the {len} bytes that it says")));
    }
    // 0 is that of a recorder that computes none.
    let found = if claimed == 0 { 0 } else { crc32fast::hash(content) };
    if found == claimed { Ok(()) } else { Err(DamageKind::Checksum { found, claimed }) }
}
