//! Searches with no guess: whether they find a scan, and what that takes.

use std::time::Instant;

use nalgebra::Vector3;

use super::outcomes::Outcomes;
use super::sets::Trials;
use mrol_map::align::AlignmentSettings;
use mrol_map::align::localize::{
    Gravity, LocalizationError, LocalizationQuery, LocalizationSettings, MAP_DOWN, localize,
};
use mrol_map::geometry::Pose;

/// Candidates that a search compares: a rival is enough to say no.
const CANDIDATES: usize = 2;

/// A kind of search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindOfSearch {
    /// Number of finest search voxels within the scan's range.
    pub resolutions_per_range: f64,
    /// True where it is known which way is down.
    pub knows_down: bool,
}

/// What came of searches.
#[derive(Debug, Clone, Default)]
pub struct Searches {
    /// Found or not, and believed or not, with the time of each.
    pub outcomes: Outcomes,
    /// How many cells of poses each bounded.
    pub cells: Vec<u64>,
}

impl Trials<'_> {
    /// Searches for each scan in the whole map.
    ///
    /// # Errors
    /// As for [`localize`].
    pub fn search(&self, kind: KindOfSearch) -> Result<Searches, LocalizationError> {
        let settings = LocalizationSettings {
            resolutions_per_range: kind.resolutions_per_range,
            ..LocalizationSettings::default()
        };
        let mut searches = Searches::default();
        for (points, truth) in &self.others {
            let gravity = kind.knows_down.then(|| down_at(truth)).flatten();
            let query = LocalizationQuery { gravity, candidates: CANDIDATES, ..LocalizationQuery::default() };
            let start = Instant::now();
            let found = localize(&self.map, points, &query, &settings, &AlignmentSettings::default())?;
            let took = start.elapsed();
            searches.cells.push(found.cells);
            match found.candidates.first() {
                Some(best) => {
                    let told = (&best.map_from_sensor, found.verdict, &*found.reason);
                    searches.outcomes.add_pose(took, told, Some(truth), self.resolution_m);
                }
                None => searches.outcomes.add_nothing(took),
            }
        }
        Ok(searches)
    }
}

/// The direction down of a sensor at `map_from_sensor`, in a map whose z axis points up.
fn down_at(map_from_sensor: &Pose) -> Option<Gravity> {
    let in_sensor = map_from_sensor.rotation.inverse() * Vector3::from(MAP_DOWN);
    Gravity::new(in_sensor.into(), MAP_DOWN).ok()
}
