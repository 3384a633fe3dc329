//! The whole loop (paper III-B): a scan is located, judged, recorded and inserted.

use std::time::{Duration, Instant};

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
        let located = self.told(scan, located);
        self.sightings.note(scan, &located);
        if !located.is_accepted() && !scan.force {
            return Ok(ScanOutcome { located, committed: None, insert_time: Duration::ZERO });
        }
        let start = Instant::now();
        let mut record = self.record(scan, &located, stop)?;
        let carving = self.carve(scan, &located, &record, stop)?;
        record.carved.clone_from(&carving.voxels);
        let is_new = !self.note_stationary(scan, &record);
        let committed = is_new.then(|| {
            let committer = self.map.committer();
            record.carved = carving.at(self.map.revision());
            committer.insert_scan(record)
        });
        Ok(ScanOutcome { located, committed, insert_time: start.elapsed() })
    }
}
