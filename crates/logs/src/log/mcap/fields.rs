//! The fields of a record: little-endian numbers, and texts with their length before them.

use crate::log::error::DamageKind;

/// The fields of a record.
pub(super) struct Fields<'a> {
    rest: &'a [u8],
    record: &'static str,
}

impl<'a> Fields<'a> {
    /// The fields of a record of this name.
    pub(super) fn new(record: &'static str, body: &'a [u8]) -> Self {
        Self { rest: body, record }
    }

    pub(super) fn u16(&mut self) -> Result<u16, DamageKind> {
        self.array().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Result<u32, DamageKind> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64, DamageKind> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn text(&mut self) -> Result<&'a str, DamageKind> {
        let len = self.u32()? as usize;
        let (text, rest) = self.rest.split_at_checked(len).ok_or(DamageKind::Format(self.record))?;
        self.rest = rest;
        std::str::from_utf8(text).map_err(|_| DamageKind::Format(self.record))
    }

    /// What comes behind the fields that were read.
    pub(super) fn rest(self) -> &'a [u8] {
        self.rest
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], DamageKind> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or(DamageKind::Format(self.record))?;
        self.rest = rest;
        Ok(*bytes)
    }
}
