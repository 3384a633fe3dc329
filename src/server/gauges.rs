//! What the system says of disk and memory.

use std::fs;
use std::path::{Path, PathBuf};

use rustix::fs::statvfs;

use crate::service::{Gauges, MemoryReading, Readings};

/// Where control groups (version 2) are told.
const CONTROL_GROUPS: &str = "/sys/fs/cgroup";

/// The disk of a data folder and the memory of this process. Memory is measured on Linux only.
#[derive(Debug)]
pub(super) struct SystemGauges {
    pub(super) data_dir: Option<PathBuf>,
}

impl Gauges for SystemGauges {
    fn read(&self) -> Readings {
        Readings { disk_free_bytes: self.data_dir.as_deref().and_then(disk_free_bytes), memory: memory() }
    }
}

/// Bytes that somebody who is not root may still write.
fn disk_free_bytes(folder: &Path) -> Option<u64> {
    let disk = statvfs(folder);
    let disk = disk.inspect_err(|error| tracing::debug!(%error, "the room on the disk is unknown")).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

fn memory() -> Option<MemoryReading> {
    let resident_bytes = kib("/proc/self/status", "VmRSS:")? << 10;
    let system_bytes = kib("/proc/meminfo", "MemTotal:")? << 10;
    let allowed_bytes = control_group_bytes().map_or(system_bytes, |bytes| bytes.min(system_bytes));
    Some(MemoryReading { resident_bytes, allowed_bytes })
}

/// The number after `name` in a file whose lines are `name number kB`.
fn kib(file: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let number = text.lines().find_map(|line| line.strip_prefix(name))?;
    number.trim().trim_end_matches("kB").trim_end().parse().ok()
}

/// The least that the control group of this process, or one above it, allows; nothing where none has a limit.
fn control_group_bytes() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let group = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let folder = Path::new(CONTROL_GROUPS).join(group);
    let within = folder.ancestors().take_while(|folder| folder.starts_with(CONTROL_GROUPS));
    // A group without a limit says `max`.
    within.filter_map(|folder| fs::read_to_string(folder.join("memory.max")).ok()?.trim().parse().ok()).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_a_disk_and_one_that_is_not_there_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let free = SystemGauges { data_dir: Some(folder.path().to_owned()) }.read().disk_free_bytes;
        assert!(free.is_some());
        assert_eq!(disk_free_bytes(&folder.path().join("none")), None);
        assert_eq!(SystemGauges { data_dir: None }.read().disk_free_bytes, None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_that_is_written_is_resident() {
        const MORE: usize = 64 << 20;
        let before = memory().unwrap();
        let written = std::hint::black_box(vec![1_u8; MORE]);
        let after = memory().unwrap();
        // Other tests of this process may give some back meanwhile.
        assert!(
            after.resident_bytes > before.resident_bytes + written.len() as u64 / 2,
            "{before:?} {after:?}"
        );
        assert!(after.allowed_bytes > after.resident_bytes);
    }
}
