//! The whole loop (paper III-B): a scan is located, judged, recorded and inserted.

use std::time::Instant;

use super::carving::Carving;
use super::decision::Decision;
use super::error::MappingError;
use super::located_scan::ScanOutcome;
use super::scan::Scan;
use super::scan_mapper::ScanMapper;
use crate::util::StopSignal;

impl ScanMapper<'_> {
    /// Maps one scan: aligns it to the map from its guess and, where it fits, adds all its points (paper III-B).
    ///
    /// A scan that does not fit is an answer and no error: the map is as it was.
    ///
    /// # Errors
    /// The guess needs a pose that is not there, no point lies within the map's range, or `stop` said so; the map is as
    /// it was.
    pub fn map_scan(&self, scan: &Scan<'_>, stop: StopSignal<'_>) -> Result<ScanOutcome, MappingError> {
        let located = self.locate(scan, stop)?;
        let located = self.recover(scan, located, stop)?;
        let located = match located.is_accepted() {
            true => located,
            false => self.search_at_once(scan, located, stop),
        };
        let start = Instant::now();
        let (located, committed) = match self.decide(scan, located, stop)? {
            Decision::Refused(located) | Decision::Stationary(located) => (located, None),
            Decision::Insert { located, mut record, carved_at } => {
                let committer = self.map.committer();
                let carving = Carving { voxels: std::mem::take(&mut record.carved), revision: carved_at };
                record.carved = carving.at(self.map.revision());
                (located, Some(committer.insert_scan(*record)))
            }
        };
        Ok(ScanOutcome { located, committed, insert_time: start.elapsed() })
    }
}
