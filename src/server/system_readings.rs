//! What the system says of disk and memory.

use std::fs;
use std::path::{Path, PathBuf};

use rustix::fs::statvfs;

use mrol_service::{Gauges, MemoryReading};

/// Where control groups are told.
const CONTROL_GROUPS: &str = "/sys/fs/cgroup";

/// The disk of a data folder and the memory of this process. Memory is measured on Linux only.
#[derive(Debug)]
pub(super) struct SystemGauges {
    pub(super) data_dir: Option<PathBuf>,
}

impl Gauges for SystemGauges {
    /// Bytes that somebody who is not root may still write.
    fn disk_free_bytes(&self) -> Option<u64> {
        let disk = statvfs(self.data_dir.as_ref()?);
        let disk =
            disk.inspect_err(|error| tracing::debug!(%error, "the room on the disk is unknown")).ok()?;
        Some(disk.f_bavail.saturating_mul(disk.f_frsize))
    }

    fn memory(&self) -> Option<MemoryReading> {
        let resident_bytes = kib("/proc/self/status", "VmRSS:")? << 10;
        let system_bytes = kib("/proc/meminfo", "MemTotal:")? << 10;
        let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
        let group_bytes = control_group_bytes(&groups, Path::new(CONTROL_GROUPS)).unwrap_or(u64::MAX);
        Some(MemoryReading { resident_bytes, allowed_bytes: system_bytes.min(group_bytes) })
    }
}

/// The number after `name` in a file whose lines are `name number kB`.
fn kib(file: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let number = text.lines().find_map(|line| line.strip_prefix(name))?;
    number.trim().trim_end_matches("kB").trim_end().parse().ok()
}

/// The least that the control groups of a process, or one above them, allow; nothing where none has a limit. A line of
/// `groups` is `number:controllers:/group`, and of version 2 `0::/group`.
fn control_group_bytes(groups: &str, root: &Path) -> Option<u64> {
    let limit = |line: &str| {
        let (controllers, group) = line.split_once(':')?.1.split_once(':')?;
        let (root, file) = match controllers {
            "" => (root.to_owned(), "memory.max"),
            _ if controllers.split(',').any(|name| name == "memory") => {
                (root.join("memory"), "memory.limit_in_bytes")
            }
            _ => return None,
        };
        least_within(&root, group.trim_start_matches('/'), file)
    };
    groups.lines().filter_map(limit).min()
}

/// The least number that `file` holds in `group` or above it. In a container the groups above its own are not there.
fn least_within(root: &Path, group: &str, file: &str) -> Option<u64> {
    let folder = root.join(group);
    let within = folder.ancestors().take_while(|folder| folder.starts_with(root));
    // A group without a limit says `max`.
    within.filter_map(|folder| fs::read_to_string(folder.join(file)).ok()?.trim().parse().ok()).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_a_disk_and_one_that_is_not_there_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let of = |data_dir| SystemGauges { data_dir }.disk_free_bytes();
        assert!(of(Some(folder.path().to_owned())).is_some());
        assert_eq!(of(Some(folder.path().join("none"))), None);
        assert_eq!(of(None), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_that_is_written_is_resident() {
        const MORE: usize = 64 << 20;
        let memory = || SystemGauges { data_dir: None }.memory().unwrap();
        let before = memory();
        let written = std::hint::black_box(vec![1_u8; MORE]);
        let after = memory();
        // Other tests of this process may give some back meanwhile.
        assert!(
            after.resident_bytes > before.resident_bytes + written.len() as u64 / 2,
            "{before:?} {after:?}"
        );
        assert!(after.allowed_bytes > after.resident_bytes);
    }

    #[test]
    fn the_least_limit_of_a_group_and_those_above_it_counts() {
        let root = tempfile::tempdir().unwrap();
        let write = |file: &str, text: &str| {
            let file = root.path().join(file);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, text).unwrap();
        };
        write("a/memory.max", "300\n");
        write("a/b/memory.max", "max\n");
        write("memory/c/memory.limit_in_bytes", "200\n");
        write("memory/memory.limit_in_bytes", "9223372036854771712\n");
        write("cpu/c/memory.limit_in_bytes", "1\n");
        let bytes = |groups| control_group_bytes(groups, root.path());
        assert_eq!(bytes("0::/a/b\n"), Some(300));
        assert_eq!(bytes("2:cpu:/c\n1:hugetlb,memory:/c\n0::/\n"), Some(200));
        assert_eq!(bytes("1:memory:/c/d\n0::/a\n"), Some(200));
        assert_eq!(bytes("0::/none\n"), None);
        // A container sees its own group as the root, and the host's name of it.
        assert_eq!(bytes("1:memory:/host/name\n"), Some(9_223_372_036_854_771_712));
    }
}
