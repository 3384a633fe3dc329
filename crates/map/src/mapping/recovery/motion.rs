//! The motion between two scans, by aligning one to the other.

use crate::align::{AlignmentSettings, FreeSpaceSettings, Verdict, align_until};
use crate::geometry::{Point, Pose};
use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord};
use crate::util::StopSignal;

/// Where the sensor was at the scan `now` in the frame of the sensor at the scan `before`: before_from_now. None where the
/// one does not align to the other.
///
/// Both are points in the sensor frame, meters. The scan `before` is a map of its own, with the levels of `settings`; the
/// sensor is thought to have stood still.
pub(super) fn motion_between(
    before: &[Point],
    now: &[Point],
    settings: &MapSettings,
    alignment: &AlignmentSettings,
    stop: StopSignal<'_>,
) -> Option<Pose> {
    let map = MultiResolutionMap::new(*settings).ok()?;
    let robot = RobotName::new("before").ok()?;
    let taken_at = MappedScan::new(robot, Pose::identity());
    map.committer().insert_scan(ScanRecord::of_points(taken_at, before, map.lattice()));
    // One scan says little of free space, and what moved meanwhile is in both.
    let free_space = FreeSpaceSettings { rays: 0, ..alignment.free_space };
    let alignment = &AlignmentSettings { free_space, ..*alignment };
    let found = align_until(&map, now, &Pose::identity().into(), alignment, stop);
    (found.verdict == Verdict::Accepted && !stop.is_stopped()).then_some(found.map_from_sensor)
}
