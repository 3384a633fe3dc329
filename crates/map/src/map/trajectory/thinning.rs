//! Which old poses are kept.
//!
//! Poses that no undo reaches any more are thinned: of those of one robot, each is kept that was taken where, and
//! looking where, none that is kept was taken, or long after the last one that is kept. The rest go. So a robot that
//! drives through the same hall for years leaves one pose a place and direction, and one a minute.
//!
//! The last two of a robot before what undo reaches stay whatever they show, so that the undo of all that came later
//! leaves its last pose and its velocity. They are judged when they are the last two no more.
//!
//! Each pose is judged once, in the order of revisions, by those before it alone. So it does not matter when and how
//! often thinning is done: up to the same revision it comes to the same poses. A server that starts again from an old
//! snapshot thins what the one before it had thinned; thinning is no change of the map, has no revision and no record
//! in the journal.

use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::sync::Arc;

use hashbrown::HashSet;

use super::scan::MappedScan;
use crate::geometry::Pose;
use crate::util::Keyword;

/// Which poses are kept once no undo reaches them any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum KeptPoses {
    /// Those that lie apart by [`TrajectorySpacing`].
    #[default]
    Spaced,
    /// Every pose, which takes memory and space in each snapshot for as long as the map is used.
    All,
}

impl Keyword for KeptPoses {
    const ALL: &'static [Self] = &[Self::Spaced, Self::All];

    fn as_str(self) -> &'static str {
        match self {
            Self::Spaced => "spaced",
            Self::All => "all",
        }
    }
}

/// How far poses of one robot lie apart that are kept for good.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrajectorySpacing {
    /// Whether poses are thinned at all.
    pub keep: KeptPoses,
    /// Side of the cells of which each keeps a pose, meters. 0.5.
    pub distance_m: f64,
    /// Steps of roll, pitch and yaw of which each keeps a pose in each cell, degrees. 10.
    pub rotation_deg: f64,
    /// After so long a pose is kept wherever it was taken, seconds by the robot's own clock; of scans without a time,
    /// none is kept for this. 60.
    pub seconds: f64,
}

impl Default for TrajectorySpacing {
    fn default() -> Self {
        Self { keep: KeptPoses::Spaced, distance_m: 0.5, rotation_deg: 10.0, seconds: 60.0 }
    }
}

/// What the kept poses of one robot show.
#[derive(Debug, Clone, Default)]
pub(super) struct Seen {
    /// Digests of cells: one that another one is taken for costs a pose.
    cells: Arc<HashSet<u64>>,
    last_ns: Option<i64>,
    /// All poses up to this revision are judged.
    pub(super) judged: u64,
}

impl Seen {
    /// True when the next pose is to be kept.
    pub(super) fn keeps(&mut self, pose: &MappedScan, spacing: &TrajectorySpacing) -> bool {
        self.judged = pose.revision;
        let cell = cell_of(&pose.map_from_sensor, spacing);
        let is_later = match (self.last_ns, pose.timestamp_ns) {
            (Some(last), Some(now)) => now.saturating_sub(last) as f64 >= spacing.seconds * 1e9,
            _ => false,
        };
        if self.cells.contains(&cell) && !is_later {
            return false;
        }
        Arc::make_mut(&mut self.cells).insert(cell);
        self.last_ns = pose.timestamp_ns.or(self.last_ns);
        true
    }

    pub(super) fn bytes(&self) -> usize {
        self.cells.allocation_size()
    }
}

/// The cell of a pose, the same on every machine and at every start.
fn cell_of(pose: &Pose, spacing: &TrajectorySpacing) -> u64 {
    let [x, y, z] = pose.translation.vector.into();
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let place = [x, y, z].map(|c: f64| (c / spacing.distance_m).round() as i64);
    let direction = [roll, pitch, yaw].map(|a| (a.to_degrees() / spacing.rotation_deg).round() as i64);
    BuildHasherDefault::<DefaultHasher>::default().hash_one((place, direction))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::name::RobotName;

    fn pose(x: f64, yaw_deg: f64, seconds: Option<i64>) -> MappedScan {
        let map_from_sensor =
            Pose::new([x, 0.0, 0.0].into(), nalgebra::Vector3::new(0.0, 0.0, yaw_deg.to_radians()));
        MappedScan {
            timestamp_ns: seconds.map(|s| s * 1_000_000_000),
            ..MappedScan::new(RobotName::new("r").unwrap(), map_from_sensor)
        }
    }

    #[test]
    fn a_pose_is_kept_for_its_place_its_direction_or_its_time() {
        let mut seen = Seen::default();
        let mut keeps = |x, yaw, s| seen.keeps(&pose(x, yaw, s), &TrajectorySpacing::default());
        assert!(keeps(0.0, 0.0, Some(0)));
        assert!(!keeps(0.2, 3.0, Some(1)));
        assert!(keeps(0.4, 3.0, Some(2)));
        assert!(keeps(0.4, 12.0, Some(3)));
        assert!(!keeps(0.0, 0.0, Some(62)));
        assert!(keeps(0.0, 0.0, Some(63)));
        assert!(!keeps(0.0, 0.0, None));
        assert!(!keeps(0.0, 0.0, Some(i64::MIN / 1_000_000_000)));
    }
}
