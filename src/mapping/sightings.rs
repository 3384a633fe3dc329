//! Where robots were seen that stand still.

use std::collections::HashMap;

use crate::geometry::Pose;
use crate::map::{MappedScan, RobotName};
use crate::sync::{Mutex, Rank};

/// Where each robot was last seen standing still, in memory.
///
/// A scan of a robot that stands still is accepted and not kept (see [`StationarySettings`](super::StationarySettings)),
/// so that its trajectory ends where it stopped. The guess for its next scan has to know that it stood: otherwise its
/// last motion would be extrapolated over all the time since.
#[derive(Debug)]
pub struct Sightings(Mutex<HashMap<RobotName, Sighting>>);

/// A robot, seen standing still.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    /// Revision of the robot's last kept scan. Once it has another one, the sighting is void.
    after: u64,
    /// Where the robot was.
    pub(super) map_from_sensor: Pose,
    /// When, nanoseconds since the Unix epoch, where its scan tells.
    pub(super) timestamp_ns: Option<i64>,
}

impl Default for Sightings {
    fn default() -> Self {
        Self(Mutex::new(Rank::Brief, HashMap::new()))
    }
}

impl Sightings {
    /// Notes that a scan of a robot, whose last kept scan is `last`, shows that it stands still.
    pub(super) fn note(&self, last: &MappedScan, map_from_sensor: Pose, timestamp_ns: Option<i64>) {
        let sighting = Sighting { after: last.revision, map_from_sensor, timestamp_ns };
        self.0.lock().insert(last.robot.clone(), sighting);
    }

    /// The last sighting of a robot since its last kept scan, which is `last`.
    pub(super) fn since(&self, last: &MappedScan) -> Option<Sighting> {
        let sighting = self.0.lock().get(&last.robot).copied();
        sighting.filter(|sighting| sighting.after == last.revision)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sighting_counts_until_another_scan_is_kept() {
        let robot = RobotName::new("r").unwrap();
        let kept = |revision| MappedScan { revision, ..MappedScan::new(robot.clone(), Pose::identity()) };
        let sightings = Sightings::default();
        assert_eq!(sightings.since(&kept(3)), None);
        sightings.note(&kept(3), Pose::translation(0.01, 0.0, 0.0), Some(7));
        assert_eq!(sightings.since(&kept(3)).unwrap().timestamp_ns, Some(7));
        assert_eq!(sightings.since(&kept(4)), None);
        // The scan after it was undone: what was seen since the one before it is not known.
        assert_eq!(sightings.since(&kept(2)), None);
    }
}
