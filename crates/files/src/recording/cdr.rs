//! Numbers and texts in CDR, the encoding of ROS 2 (OMG DDS-XTypes, plain CDR version 1), little-endian.

/// Bytes of the encapsulation header, from whose end values are aligned.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// The bytes of a message, written value by value.
#[derive(Debug)]
pub(super) struct CdrWriter {
    bytes: Vec<u8>,
}

impl CdrWriter {
    /// A message without a value so far, with room for so many bytes.
    pub(super) fn with_room(bytes: usize) -> Self {
        let mut writer = Self { bytes: Vec::with_capacity(HEADER.len() + bytes) };
        writer.bytes.extend(HEADER);
        writer
    }

    /// The message.
    pub(super) fn finish(self) -> Vec<u8> {
        self.bytes
    }

    /// A number, at the next multiple of its size.
    fn number<const N: usize>(&mut self, little: [u8; N]) {
        let behind = (self.bytes.len() - HEADER.len()) % N;
        if behind > 0 {
            self.bytes.extend(&[0; 8][..N - behind]);
        }
        self.bytes.extend(little);
    }

    pub(super) fn u8(&mut self, number: u8) {
        self.bytes.push(number);
    }

    pub(super) fn i32(&mut self, number: i32) {
        self.number(number.to_le_bytes());
    }

    pub(super) fn u32(&mut self, number: u32) {
        self.number(number.to_le_bytes());
    }

    pub(super) fn f32(&mut self, number: f32) {
        self.number(number.to_le_bytes());
    }

    pub(super) fn f64(&mut self, number: f64) {
        self.number(number.to_le_bytes());
    }

    pub(super) fn string(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// The number of elements of a list, before them: no list here has as many as 2^32, since a map has fewer voxels.
    pub(super) fn count(&mut self, elements: usize) {
        self.u32(u32::try_from(elements).unwrap_or(u32::MAX));
    }

    /// A list of bytes.
    pub(super) fn octets(&mut self, octets: impl ExactSizeIterator<Item = u8>) {
        self.count(octets.len());
        self.bytes.extend(octets);
    }
}
