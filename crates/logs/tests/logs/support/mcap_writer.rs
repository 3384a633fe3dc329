//! A writer of MCAP without chunks and without a summary, as a recorder on a small computer may be set to.

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// A log in memory.
pub(crate) struct McapWriter {
    bytes: Vec<u8>,
    channels: u16,
}

impl Default for McapWriter {
    fn default() -> Self {
        let mut log = Self { bytes: MAGIC.to_vec(), channels: 0 };
        log.record(1, &[text("ros2"), text("mrol tests")].concat());
        log
    }
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

impl McapWriter {
    /// A record of this operation code.
    pub(crate) fn record(&mut self, code: u8, body: &[u8]) {
        self.bytes.push(code);
        self.bytes.extend((body.len() as u64).to_le_bytes());
        self.bytes.extend(body);
    }

    /// A topic of messages in CDR; returns the number of its channel.
    pub(crate) fn topic(&mut self, name: &str, type_name: &str) -> u16 {
        self.channels += 1;
        let id = self.channels.to_le_bytes();
        self.record(3, &[&id[..], &text(type_name), &text("ros2msg"), &text("")].concat());
        self.record(4, &[&id[..], &id[..], &text(name), &text("cdr"), &0u32.to_le_bytes()].concat());
        self.channels
    }

    /// A message that was recorded at a time.
    pub(crate) fn message(&mut self, channel: u16, log_time_ns: u64, data: &[u8]) {
        let time = log_time_ns.to_le_bytes();
        let body = [&channel.to_le_bytes()[..], &0u32.to_le_bytes(), &time, &time, data].concat();
        self.record(5, &body);
    }

    /// The log, closed as it should be.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.record(15, &0u32.to_le_bytes());
        self.record(2, &[0; 20]);
        self.bytes.extend(MAGIC);
        self.bytes
    }

    /// The log, as a recorder leaves it that is killed.
    pub(crate) fn kill(self) -> Vec<u8> {
        self.bytes
    }
}
