//! Decisions: what becomes of a scan that was located.

use super::error::MappingError;
use super::located_scan::LocatedScan;
use super::scan::Scan;
use super::scan_mapper::ScanMapper;
use crate::map::ScanRecord;
use crate::util::StopSignal;

/// What becomes of a scan.
#[derive(Debug)]
pub enum Decision {
    /// It does not fit, and nothing is inserted.
    Refused(LocatedScan),
    /// It shows what its robot's last scan showed, from the same pose, so it is accepted and not inserted.
    Stationary(LocatedScan),
    /// It is inserted.
    Insert {
        /// Where it was found.
        located: LocatedScan,
        /// What it adds to the map and carves out of it.
        record: Box<ScanRecord>,
        /// The revision of the map at which `record` carves. If the map is at a later one when the scan is inserted,
        /// [`Carving::cut`](super::Carving::cut) says what is still to be carved.
        carved_at: u64,
    },
}

impl ScanMapper<'_> {
    /// Decides what becomes of a scan that was [located](Self::locate) and, if its robot was lost, [looked
    /// for](Self::recover). Changes nothing in the map; notes where the scan was found and whether it fits.
    ///
    /// # Errors
    /// No point lies within the map's range, or `stop` said so.
    pub fn decide(
        &self,
        scan: &Scan<'_>,
        located: LocatedScan,
        stop: StopSignal<'_>,
    ) -> Result<Decision, MappingError> {
        let located = self.told(scan, located);
        self.sightings.note(scan, &located);
        if !located.is_accepted() && !scan.force {
            return Ok(Decision::Refused(located));
        }
        let mut record = self.record(scan, &located, stop)?;
        let carving = self.carve(scan, &located, &record, stop)?;
        record.carved = carving.voxels;
        if self.note_stationary(scan, &record) {
            return Ok(Decision::Stationary(located));
        }
        Ok(Decision::Insert { located, record: Box::new(record), carved_at: carving.revision })
    }
}
