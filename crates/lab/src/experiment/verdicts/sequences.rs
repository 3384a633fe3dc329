//! Sequences: the scans of a set one after the other, each aligned to the map that those before it made.

use super::outcomes::Outcomes;
use super::sets::Set;
use mrol::console::error::CliError;
use mrol::offline::Mapper;
use mrol_map::align::{AlignmentSettings, ray_agreement};
use mrol_map::map::MapSettings;
use mrol_map::mapping::Guess;

/// Levels of a sequence's map, as many as `mrol map` makes.
const LEVELS: u32 = 6;

/// What came of the scans of a sequence, without the first one.
#[derive(Debug, Default)]
pub struct SequenceOutcomes {
    /// Scans at whose true pose rays agree enough on both sides to tell a pose.
    pub with_evidence: Outcomes,
    /// The others: the scan shows little of what was seen, or little of it was.
    pub without_evidence: Outcomes,
}

impl Set {
    /// Maps the scans in their order, the first one at its true pose, each other one from the pose before it; a robot
    /// that is lost is looked for. `evidence_min` is the least share of points of each side that agree at the true pose
    /// of a scan that tells.
    ///
    /// # Errors
    /// When settings of the map are out of range, or a scan lies beyond the map's range.
    pub fn in_order(
        &self,
        settings: &AlignmentSettings,
        evidence_min: f64,
    ) -> Result<SequenceOutcomes, CliError> {
        let map = MapSettings::new(self.resolution_m, LEVELS);
        let mut mapper = Mapper::new(map, *settings, Guess::Last)?.recovering(true);
        let mut outcomes = SequenceOutcomes::default();
        for (k, (points, truth)) in self.scans.iter().enumerate() {
            let is_first = k == 0;
            let evidence = ray_agreement(mapper.map(), points, truth, settings).evidence();
            let mapped = mapper.add(k, points, is_first.then_some(*truth)).map_err(CliError::failed)?;
            let of_scan = match evidence >= evidence_min {
                true => &mut outcomes.with_evidence,
                false => &mut outcomes.without_evidence,
            };
            if !is_first {
                of_scan.add(&(mapped.alignment, mapped.align_time), Some(truth), self.resolution_m);
            }
        }
        Ok(outcomes)
    }
}
