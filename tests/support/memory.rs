//! What a process has in memory, as the system counts it.

use std::fs;

/// The memory of a process.
pub(crate) struct Memory {
    folder: String,
}

impl Memory {
    pub(crate) fn of(process: u32) -> Self {
        Self { folder: format!("/proc/{process}") }
    }

    /// Bytes that are resident now.
    pub(crate) fn resident(&self) -> usize {
        self.bytes("VmRSS:")
    }

    /// The most that were since [`Memory::forget_peak`].
    pub(crate) fn peak(&self) -> usize {
        self.bytes("VmHWM:")
    }

    /// The peak is what is resident now.
    pub(crate) fn forget_peak(&self) {
        fs::write(format!("{}/clear_refs", self.folder), "5").unwrap();
    }

    /// Threads that there are now.
    pub(crate) fn threads(&self) -> usize {
        self.status("Threads:").parse().unwrap()
    }

    fn bytes(&self, name: &str) -> usize {
        self.status(name).strip_suffix(" kB").unwrap().parse::<usize>().unwrap() << 10
    }

    fn status(&self, name: &str) -> String {
        let status = fs::read_to_string(format!("{}/status", self.folder)).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix(name)).unwrap();
        line.trim().to_owned()
    }
}
