//! A writer of CDR.

/// A writer of CDR, of either byte order.
pub(crate) struct CdrWriter {
    bytes: Vec<u8>,
    is_big: bool,
}

/// Bytes of the encapsulation header, from whose end values are aligned.
const HEADER: usize = 4;

impl CdrWriter {
    pub(crate) fn new(is_big: bool) -> Self {
        Self { bytes: vec![0, u8::from(!is_big), 0, 0], is_big }
    }

    pub(crate) fn finish(self) -> Vec<u8> {
        self.bytes
    }

    fn number<const N: usize>(&mut self, mut little: [u8; N]) {
        while !(self.bytes.len() - HEADER).is_multiple_of(N) {
            self.bytes.push(0);
        }
        if self.is_big {
            little.reverse();
        }
        self.bytes.extend(little);
    }

    pub(crate) fn u8(&mut self, number: u8) {
        self.bytes.push(number);
    }

    pub(crate) fn u32(&mut self, number: u32) {
        self.number(number.to_le_bytes());
    }

    pub(crate) fn u64(&mut self, number: u64) {
        self.number(number.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, number: f32) {
        self.number(number.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, number: f64) {
        self.number(number.to_le_bytes());
    }

    pub(crate) fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// A list of bytes.
    pub(crate) fn octets(&mut self, octets: &[u8]) {
        self.u32(octets.len() as u32);
        self.bytes.extend(octets);
    }

    pub(crate) fn header(&mut self, stamp_ns: i64, frame: &str) {
        let seconds = stamp_ns.div_euclid(1_000_000_000);
        self.number((seconds as i32).to_le_bytes());
        self.u32((stamp_ns - seconds * 1_000_000_000) as u32);
        self.string(frame);
    }
}
