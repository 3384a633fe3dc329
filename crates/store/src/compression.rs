//! Compression and checksum of a map file, with a check of the stop signal after each piece.

use std::io::{self, Read, Write};

use mrol_map::util::StopSignal;

/// Compression level of zstd: the fastest, since gaps and octrees leave little to compress.
const ZSTD_LEVEL: i32 = 1;
/// Bytes of a body between two checks of the stop signal: a few milliseconds.
const BYTES_PER_STOP_CHECK: usize = 1 << 20;
/// Largest window of a frame, as a power of two: 8 MiB, for which memory is reserved. Own frames use 512 KiB.
const WINDOW_LOG_MAX: u32 = 23;
/// Bytes of memory that decompression takes besides the body.
pub(super) const WINDOW_BYTES: usize = (1 << WINDOW_LOG_MAX) + (1 << 19);

/// Appends a zstd frame of `body` to `bytes`; incomplete once stopped.
///
/// # Errors
/// When there is no memory.
pub(super) fn compress_onto(bytes: Vec<u8>, body: &[u8], stop: StopSignal<'_>) -> io::Result<Vec<u8>> {
    let mut frame = zstd::Encoder::new(bytes, ZSTD_LEVEL)?;
    if stop.is_stopped() {
        return Ok(Vec::new());
    }
    frame.set_pledged_src_size(Some(body.len() as u64))?;
    for piece in stop.pieces(body, BYTES_PER_STOP_CHECK) {
        stop.give_way();
        frame.write_all(piece)?;
    }
    if stop.is_stopped() {
        return Ok(Vec::new());
    }
    frame.finish()
}

/// Decompresses a zstd frame of at most `length` bytes; incomplete once stopped.
///
/// # Errors
/// When it is not a zstd frame, is damaged, holds more, or needs a larger window than own frames do.
pub(super) fn decompress(frame: &[u8], length: usize, stop: StopSignal<'_>) -> io::Result<Vec<u8>> {
    let mut body = Vec::with_capacity(length);
    let mut unread = zstd::Decoder::with_buffer(frame)?;
    unread.window_log_max(WINDOW_LOG_MAX)?;
    while !stop.is_stopped() {
        stop.give_way();
        let piece = BYTES_PER_STOP_CHECK.min(length - body.len());
        // One byte more than allowed, to detect a frame that holds more.
        let read = unread.by_ref().take(piece.max(1) as u64).read_to_end(&mut body)?;
        if body.len() > length {
            return Err(io::Error::other(format!("it holds more than {length} bytes")));
        }
        if read == 0 {
            break;
        }
    }
    Ok(body)
}

/// The CRC-32C of `bytes`, continued from `before`; incomplete once stopped.
pub(super) fn checksum_after(before: u32, bytes: &[u8], stop: StopSignal<'_>) -> u32 {
    stop.pieces(bytes, 16 * BYTES_PER_STOP_CHECK).fold(before, crc32c::crc32c_append)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    fn body(length: usize) -> Vec<u8> {
        (0..length as u64).map(|i| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 60) as u8).collect()
    }

    #[test]
    fn bodies_survive_with_looks_in_proportion_to_their_length() {
        for length in [0, 1, BYTES_PER_STOP_CHECK - 1, BYTES_PER_STOP_CHECK, 5 * BYTES_PER_STOP_CHECK + 7] {
            let (body, looks) = (body(length), Cell::new(0));
            let count = || looks.replace(looks.get() + 1) == usize::MAX;
            let stop = StopSignal::when(&count);
            let frame = compress_onto(b"before".to_vec(), &body, stop).unwrap();
            assert!(length / looks.replace(0) <= BYTES_PER_STOP_CHECK);
            assert_eq!(frame[..6], b"before"[..]);
            assert!(decompress(&frame[6..], length, stop).unwrap() == body);
            assert!(length / looks.replace(0) <= BYTES_PER_STOP_CHECK);
            assert_eq!(zstd::bulk::decompress(&frame[6..], length).unwrap().len(), length);
            assert_eq!(checksum_after(7, &body, stop), crc32c::crc32c_append(7, &body));
        }
    }

    #[test]
    fn what_was_compressed_at_once_is_read_and_what_is_too_long_is_not() {
        let body = body(3 << 20);
        let frame = zstd::bulk::compress(&body, ZSTD_LEVEL).unwrap();
        assert!(decompress(&frame, body.len(), StopSignal::NEVER).unwrap() == body);
        for most in [0, 1, BYTES_PER_STOP_CHECK, body.len() - 1] {
            assert!(decompress(&frame, most, StopSignal::NEVER).is_err(), "{most}");
        }
        assert!(decompress(&frame[..frame.len() - 1], body.len(), StopSignal::NEVER).is_err());
    }
}
