//! The motion between two scans, by aligning one to the other.

use crate::align::{
    AlignmentSettings, PoseCovariance, PosePrior, Rival, Verdict, agrees_both_ways, align_until,
};
use crate::geometry::{Point, Pose};
use crate::map::{MapSettings, MappedScan, MultiResolutionMap, RobotName, ScanRecord, ViewpointRecord};
use crate::util::StopSignal;
use crate::visibility::{IMAGE_BYTES_MAX, RangeImage, Sweep};

/// What is further away is seen up to here, meters.
const RANGE_MAX_M: f32 = 60.0;

/// Where the sensor was at the scan `now` in the frame of the sensor at the scan `before`: before_from_now. None where
/// the one does not align to the other.
///
/// Both are points in the sensor frame, meters. The scan `before` is a map of its own, with the levels of `settings`;
/// the guess is that the sensor stood still. `expected` says how far off that may be; without it nothing is known. The
/// result is only a guess, which the map has to confirm.
pub(super) fn motion_between(
    before: &[Point],
    now: &[Point],
    expected: Option<PoseCovariance>,
    settings: &MapSettings,
    alignment: &AlignmentSettings,
    stop: StopSignal<'_>,
) -> Option<Pose> {
    let map = MultiResolutionMap::new(*settings).ok()?;
    let robot = RobotName::new("before").ok()?;
    let taken_at = MappedScan::new(robot, Pose::identity());
    let image = RangeImage::of_points(before, Sweep::standing(RANGE_MAX_M), IMAGE_BYTES_MAX);
    let viewpoint = image.map(|image| ViewpointRecord { image, displaced: Vec::new() });
    let record = ScanRecord::of_points(taken_at, before, map.lattice());
    map.committer().insert_scan(ScanRecord { viewpoint, ..record });
    let prior = PosePrior { expected, may_have_turned: false, ..Pose::identity().into() };
    let found = align_until(&map, now, &prior, alignment, stop);
    // Nobody says that the sensor stood still: that it may have, or has moved far, is no doubt about what was found.
    let may_have_stood = |rivals: &[Rival]| matches!(rivals, [rival] if rival.map_from_sensor == prior.guess);
    let is_found = match found.verdict {
        Verdict::Accepted => true,
        Verdict::Ambiguous => may_have_stood(&found.rivals),
        Verdict::Contradicted => found.agreement.as_ref().is_some_and(agrees_both_ways),
        Verdict::LowOverlap | Verdict::Undetermined => false,
    };
    (is_found && !stop.is_stopped()).then_some(found.map_from_sensor)
}
