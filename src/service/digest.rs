//! What tells one request from another under the same id.

/// A checksum of what was asked for, with its length.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Digest {
    checksum: u32,
    bytes: u32,
}

impl Digest {
    pub(super) fn bytes(self, bytes: &[u8]) -> Self {
        let length = self.bytes.wrapping_add(bytes.len() as u32);
        Self { checksum: crc32c::crc32c_append(self.checksum, bytes), bytes: length }
    }

    pub(super) fn number(self, number: u64) -> Self {
        self.bytes(&number.to_le_bytes())
    }

    pub(super) fn numbers(self, numbers: &[f64]) -> Self {
        numbers.iter().fold(self, |digest, number| digest.number(number.to_bits()))
    }

    pub(super) fn finish(self) -> u64 {
        u64::from(self.bytes) << 32 | u64::from(self.checksum)
    }
}
