//! The budget of disk and memory that changes are made within.
//!
//! The watermarks see what is there. What was let in and is not there yet is reserved, and counts as if it were: many
//! scans at once do not pass a mark together that each of them keeps.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::gauges::{Gauges, MemoryReading, Readings};
use super::shortage::{RETRY_AFTER, Shortage};
use super::watermarks::Watermarks;
use crate::error::{Reason, ServiceError};
use crate::limits::Marks;

/// Percentage of what the process may have in memory up to which some is reserved for a while.
const LENT_PERCENT: u64 = 95;

/// What there is of disk and memory, and what of it is reserved. Without gauges there is room for everything.
#[derive(Debug)]
pub(crate) struct ResourceBudget {
    gauges: Option<Arc<dyn Gauges>>,
    watermarks: Watermarks,
    marks: Marks,
    promised_bytes: Arc<AtomicU64>,
}

/// Memory for what is not there yet, or not for long. To drop it gives it back.
#[derive(Debug)]
pub(crate) struct Reservation {
    bytes: u64,
    promised_bytes: Arc<AtomicU64>,
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.promised_bytes.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

impl ResourceBudget {
    pub(crate) fn new(gauges: Option<Arc<dyn Gauges>>, marks: Marks) -> Self {
        let watermarks = Watermarks::new(marks.clone());
        Self { gauges, watermarks, marks, promised_bytes: Arc::default() }
    }

    /// Looks at all gauges. May block.
    pub(crate) fn look(&self) -> Readings {
        let readings = Readings { disk_free_bytes: self.disk_free_bytes(), memory: self.memory() };
        self.watermarks
            .note(&Readings { memory: readings.memory.map(|it| self.with_reserved(it)), ..readings });
        readings
    }

    /// What there was too little of at the last look.
    pub(crate) fn shortages(&self) -> Vec<Shortage> {
        self.watermarks.shortages()
    }

    /// # Errors
    /// `ResourceExhausted` where at the last look there was no room for more voxels, in memory or on disk.
    pub(crate) fn check_to_grow(&self) -> Result<(), ServiceError> {
        self.watermarks.check_to_grow()
    }

    /// For changes that give memory back: they need room on the disk alone.
    ///
    /// # Errors
    /// `ResourceExhausted` where at the last look there was no room in the journal.
    pub(crate) fn check_to_shrink(&self) -> Result<(), ServiceError> {
        self.watermarks.check_to_shrink()
    }

    /// Memory by which a map is to grow, as it is now.
    ///
    /// # Errors
    /// `ResourceExhausted` where there is no room for it below the mark, or none on the disk.
    pub(crate) fn reserve_growth(&self, bytes: u64) -> Result<Reservation, ServiceError> {
        let reservation = self.count(bytes);
        let memory = self.memory().map(|it| self.with_reserved(it));
        self.watermarks.note(&Readings { memory, ..Readings::default() });
        self.watermarks.check_to_grow().map(|()| reservation)
    }

    /// Memory for a part of what is built bit by bit, and may be far too much. It is refused where a scan would be;
    /// others do not notice.
    ///
    /// # Errors
    /// `ResourceExhausted` where there is no room for it below the mark.
    pub(crate) fn reserve(&self, bytes: u64) -> Result<Reservation, ServiceError> {
        let reservation = self.count(bytes);
        let memory = self.memory().map(|it| self.with_reserved(it));
        let shortage = memory.and_then(|memory| self.marks.memory(memory, false));
        shortage.map_or(Ok(reservation), |shortage| Err(shortage.refusal("")))
    }

    /// Memory for a while, for `whom`. It may lie above the marks: what shrinks a map and what saves it needs some as
    /// well.
    ///
    /// # Errors
    /// `ResourceExhausted` where the process would have more than it may.
    pub(crate) fn reserve_transient(&self, bytes: u64, whom: &str) -> Result<Reservation, ServiceError> {
        let reservation = self.count(bytes);
        match self.memory().map(|it| self.with_reserved(it)) {
            Some(MemoryReading { resident_bytes, allowed_bytes })
                if resident_bytes > allowed_bytes / 100 * LENT_PERCENT =>
            {
                let message = format!(
                    "{whom} takes {} MiB of memory for a while: with what is in use that would be {} MiB, more than \
                     {LENT_PERCENT} % of the {} MiB that the server may have; delete a map, or give the server more memory",
                    bytes >> 20,
                    resident_bytes >> 20,
                    allowed_bytes >> 20
                );
                let error = ServiceError::new(Reason::MemoryFull, message);
                Err(error.retry_after(RETRY_AFTER))
            }
            _ => Ok(reservation),
        }
    }

    /// Bytes that a file may have which changes do not need: what it leaves is enough for the journal. May block.
    pub(crate) fn file_bytes_max(&self) -> u64 {
        let least = self.marks.disk_free_low_bytes;
        self.disk_free_bytes().map_or(u64::MAX, |free| free.saturating_sub(least))
    }

    /// True where so little of the disk is free that nothing should be kept that can be spared. May block.
    pub(crate) fn is_disk_scarce(&self) -> bool {
        let Marks { disk_free_low_bytes, disk_free_resume_bytes, .. } = self.marks;
        disk_free_low_bytes > 0 && self.disk_free_bytes().is_some_and(|free| free < disk_free_resume_bytes)
    }

    fn count(&self, bytes: u64) -> Reservation {
        self.promised_bytes.fetch_add(bytes, Ordering::Relaxed);
        Reservation { bytes, promised_bytes: Arc::clone(&self.promised_bytes) }
    }

    fn with_reserved(&self, memory: MemoryReading) -> MemoryReading {
        let reserved = self.promised_bytes.load(Ordering::Relaxed);
        MemoryReading { resident_bytes: memory.resident_bytes.saturating_add(reserved), ..memory }
    }

    fn disk_free_bytes(&self) -> Option<u64> {
        self.gauges.as_ref()?.disk_free_bytes()
    }

    fn memory(&self) -> Option<MemoryReading> {
        self.gauges.as_ref()?.memory()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: u64 = 1 << 20;

    /// A process with some of its 1000 MiB in use, and a disk.
    #[derive(Debug)]
    struct Fixed {
        resident_mib: u64,
        disk_free_mib: u64,
    }

    impl Gauges for Fixed {
        fn disk_free_bytes(&self) -> Option<u64> {
            Some(self.disk_free_mib * MIB)
        }

        fn memory(&self) -> Option<MemoryReading> {
            Some(MemoryReading { resident_bytes: self.resident_mib * MIB, allowed_bytes: 1000 * MIB })
        }
    }

    fn budget(resident_mib: u64, disk_free_mib: u64) -> ResourceBudget {
        ResourceBudget::new(Some(Arc::new(Fixed { resident_mib, disk_free_mib })), Marks::default())
    }

    #[test]
    fn what_is_promised_counts_as_if_it_were_there_until_it_is() {
        let budget = budget(700, 10_000);
        let (one, other) =
            (budget.reserve_growth(100 * MIB).unwrap(), budget.reserve_growth(50 * MIB).unwrap());
        let refused = budget.reserve_growth(MIB).unwrap_err();
        assert_eq!(refused.reason, Reason::MemoryFull);
        assert!(refused.message.contains("851 MiB"), "{}", refused.message);
        // The marks are 850 and 799 MiB: it takes more than the one that was refused to come back.
        drop(other);
        assert!(budget.reserve_growth(0).is_err());
        drop(one);
        assert!(budget.reserve_growth(0).is_ok());
    }

    #[test]
    fn what_is_reserved_and_refused_keeps_nobody_from_growing() {
        let budget = budget(700, 10_000);
        let refused = budget.reserve(200 * MIB).unwrap_err();
        assert_eq!(refused.reason, Reason::MemoryFull);
        assert!(budget.reserve(100 * MIB).is_ok() && budget.reserve_growth(MIB).is_ok());
    }

    #[test]
    fn what_is_lent_may_lie_above_the_mark_and_not_above_what_there_is() {
        let budget = budget(900, 10_000);
        let reserved = budget.reserve_transient(50 * MIB, "a snapshot").unwrap();
        let refused = budget.reserve_transient(MIB, "a snapshot").unwrap_err();
        assert!(refused.message.contains("a snapshot takes 1 MiB"), "{}", refused.message);
        drop(reserved);
        assert!(budget.reserve_transient(MIB, "a snapshot").is_ok());
    }

    #[test]
    fn a_file_leaves_the_journal_what_is_below_the_mark() {
        assert_eq!(budget(1, 300).file_bytes_max(), 44 * MIB);
        assert_eq!(budget(1, 200).file_bytes_max(), 0);
    }

    #[test]
    fn without_gauges_there_is_room_for_everything() {
        let budget = ResourceBudget::new(None, Marks::default());
        assert_eq!(budget.look(), Readings::default());
        assert!(
            budget.reserve_growth(u64::MAX / 2).is_ok()
                && budget.reserve_transient(u64::MAX / 2, "a search").is_ok()
        );
        assert_eq!(budget.file_bytes_max(), u64::MAX);
    }
}
