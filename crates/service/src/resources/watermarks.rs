//! Watermarks: where disk or memory is nearly full, changes are refused until there is room again.
//!
//! Each gauge has two marks, so that a value that trembles about one of them does not open and shut the door at each
//! look. Reads, alignments and searches go on meanwhile.

use super::gauges::{MemoryReading, Readings};
use super::shortage::Shortage;
use crate::error::{Reason, ServiceError};
use crate::limits::Marks;
use mrol_map::sync::{Rank, RwLock};

/// What there is too little of, by the marks and the readings so far.
#[derive(Debug)]
pub(super) struct Watermarks {
    marks: Marks,
    now: RwLock<Shortages>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Shortages {
    disk: Option<Shortage>,
    memory: Option<Shortage>,
}

impl Watermarks {
    pub(super) fn new(marks: Marks) -> Self {
        Self { marks, now: RwLock::new(Rank::Brief, Shortages::default()) }
    }

    /// Takes note of readings. Of what nothing was read, all stays as it was.
    pub(super) fn note(&self, readings: &Readings) {
        let mut now = self.now.write();
        if let Some(free) = readings.disk_free_bytes {
            let disk = self.marks.disk(free, now.disk.is_some());
            log_change(Reason::DiskFull, now.disk, disk);
            now.disk = disk;
        }
        if let Some(memory) = readings.memory {
            let memory = self.marks.memory(memory, now.memory.is_some());
            log_change(Reason::MemoryFull, now.memory, memory);
            now.memory = memory;
        }
    }

    pub(super) fn shortages(&self) -> Vec<Shortage> {
        let Shortages { disk, memory } = *self.now.read();
        disk.into_iter().chain(memory).collect()
    }

    /// # Errors
    /// `ResourceExhausted` where there is no room for more voxels, in memory or on disk.
    pub(super) fn check_to_grow(&self) -> Result<(), ServiceError> {
        self.shortages().first().map_or(Ok(()), |shortage| Err(shortage.refusal("")))
    }

    /// For changes that give memory back: they need room on the disk alone.
    ///
    /// # Errors
    /// `ResourceExhausted` where there is no room in the journal.
    pub(super) fn check_to_shrink(&self) -> Result<(), ServiceError> {
        let why = " (removals are refused as well, since the journal keeps each of them)";
        self.now.read().disk.map_or(Ok(()), |shortage| Err(shortage.refusal(why)))
    }
}

impl Marks {
    fn disk(&self, free: u64, is_short: bool) -> Option<Shortage> {
        let (low, back) = (self.disk_free_low_bytes, self.disk_free_resume_bytes);
        let least = if is_short { back } else { low };
        (free < least).then_some(Shortage::Disk { free, low, back })
    }

    pub(super) fn memory(&self, memory: MemoryReading, is_short: bool) -> Option<Shortage> {
        let in_use = memory.resident_bytes;
        let high = self.memory_high_bytes.unwrap_or(memory.allowed_bytes / 100 * 85);
        let back = self.memory_resume_bytes.unwrap_or(high / 100 * 94);
        let most = if is_short { back } else { high };
        (in_use > most).then_some(Shortage::Memory { in_use, high, back })
    }
}

fn log_change(reason: Reason, before: Option<Shortage>, now: Option<Shortage>) {
    match (before, now) {
        (None, Some(shortage)) => tracing::error!(%reason, "{shortage}"),
        (Some(_), None) => tracing::info!(%reason, "there is room again, changes are taken"),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: u64 = 1 << 20;

    fn disk(free_mib: u64) -> Readings {
        Readings { disk_free_bytes: Some(free_mib * MIB), ..Readings::default() }
    }

    fn memory(resident_mib: u64, allowed_mib: u64) -> Readings {
        let (resident_bytes, allowed_bytes) = (resident_mib * MIB, allowed_mib * MIB);
        Readings { memory: Some(MemoryReading { resident_bytes, allowed_bytes }), ..Readings::default() }
    }

    /// Whether growth is refused after each of the readings.
    fn refused_after(watermarks: &Watermarks, readings: impl IntoIterator<Item = Readings>) -> Vec<bool> {
        let refused = |reading| {
            watermarks.note(&reading);
            watermarks.check_to_grow().is_err()
        };
        readings.into_iter().map(refused).collect()
    }

    #[test]
    fn nothing_is_refused_before_anything_was_measured() {
        let watermarks = Watermarks::new(Marks::default());
        assert!(watermarks.check_to_grow().is_ok() && watermarks.check_to_shrink().is_ok());
        assert_eq!(watermarks.shortages(), []);
    }

    #[test]
    fn a_disk_is_full_below_the_low_mark_and_until_the_back_mark() {
        let watermarks = Watermarks::new(Marks::default());
        let free = [300, 256, 255, 256, 511, 300, 512, 300, 256, 0].map(disk);
        let refused = [false, false, true, true, true, true, false, false, false, true];
        assert_eq!(refused_after(&watermarks, free), refused);
    }

    #[test]
    fn memory_is_full_above_the_high_mark_and_until_the_back_mark() {
        let (high, back) = (Some(100 * MIB), Some(80 * MIB));
        let marks = Marks { memory_high_bytes: high, memory_resume_bytes: back, ..Marks::default() };
        let watermarks = Watermarks::new(marks);
        let resident = [90, 100, 101, 100, 81, 80, 100].map(|mib| memory(mib, 1000));
        assert_eq!(refused_after(&watermarks, resident), [false, false, true, true, true, false, false]);
    }

    #[test]
    fn the_marks_of_memory_follow_what_the_process_may_use() {
        let watermarks = Watermarks::new(Marks::default());
        let readings = [(850, 1000), (851, 1000), (800, 1000), (799, 1000), (799, 900), (799, 2000)];
        let refused = [false, true, true, false, true, false];
        assert_eq!(
            refused_after(&watermarks, readings.map(|(resident, all)| memory(resident, all))),
            refused
        );
    }

    #[test]
    fn a_gauge_that_cannot_be_read_changes_nothing() {
        let watermarks = Watermarks::new(Marks::default());
        let readings = [Readings::default(), disk(1), Readings::default(), memory(1, 1000), disk(600)];
        assert_eq!(refused_after(&watermarks, readings), [false, true, true, true, false]);
    }

    #[test]
    fn a_mark_of_nothing_refuses_nothing() {
        let watermarks = Watermarks::new(Marks { disk_free_low_bytes: 0, ..Marks::default() });
        assert_eq!(refused_after(&watermarks, [disk(0)]), [false]);
    }

    #[test]
    fn a_refusal_says_what_was_measured_the_marks_and_what_to_do() {
        let watermarks = Watermarks::new(Marks::default());
        watermarks.note(&disk(100));
        let error = watermarks.check_to_grow().unwrap_err();
        assert_eq!(error.reason, Reason::DiskFull);
        for part in ["100 MiB", "disk_free_low_mib, 256", "disk_free_resume_mib, 512", "make room"] {
            assert!(error.message.contains(part), "{part} is not in {}", error.message);
        }
        let error = watermarks.check_to_shrink().unwrap_err();
        assert_eq!(error.reason, Reason::DiskFull);
        assert!(error.message.contains("journal"), "{}", error.message);
    }

    #[test]
    fn what_gives_memory_resume_is_taken_while_memory_is_full() {
        let watermarks = Watermarks::new(Marks::default());
        watermarks.note(&memory(990, 1000));
        let error = watermarks.check_to_grow().unwrap_err();
        assert_eq!(error.reason, Reason::MemoryFull);
        for part in ["990 MiB", "memory_high_mib, 850", "memory_resume_mib, 79", "delete a map"] {
            assert!(error.message.contains(part), "{part} is not in {}", error.message);
        }
        assert!(watermarks.check_to_shrink().is_ok());
    }
}
