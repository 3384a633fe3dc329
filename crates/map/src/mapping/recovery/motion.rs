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

#[cfg(test)]
mod tests {
    use super::*;

    /// What a lidar sees in a corridor 3 m wide, which has no end, with people 2 m away at these azimuths: the same
    /// wherever along it the lidar is.
    fn in_corridor(people_deg: &[f32]) -> Vec<Point> {
        let rays = (0..32).flat_map(|ring| (0..720).map(move |column| (ring, column)));
        let seen = |(ring, column): (u8, u16)| {
            let (elevation_deg, azimuth_deg) = (f32::from(ring) - 15.5, f32::from(column) * 0.5 - 180.0);
            let ((up, out), (left, ahead)) =
                (elevation_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
            let direction = [out * ahead, out * left, up];
            let is_person = people_deg.iter().any(|at| (azimuth_deg - at).abs() < 6.0);
            let to_wall = 1.5 / direction[1].abs();
            let to_floor = if up < 0.0 { -1.0 / up } else { f32::INFINITY };
            let range = to_wall.min(to_floor).min(if is_person { 2.0 } else { 25.0 });
            (range < 25.0).then(|| Point::from(direction.map(|part| part * range)))
        };
        rays.filter_map(seen).collect()
    }

    #[test]
    fn a_motion_that_rays_do_not_hold_along_a_corridor_counts_for_nothing() {
        let (settings, alignment) = (MapSettings::new(0.1, 4), AlignmentSettings::default());
        let motion = |before: &[f32], now: &[f32]| {
            let (before, now) = (in_corridor(before), in_corridor(now));
            motion_between(&before, &now, None, &settings, &alignment, StopSignal::NEVER)
        };
        assert_eq!(motion(&[60.0], &[20.0]), None);
        assert_eq!(motion(&[60.0, -160.0, -20.0], &[20.0, 160.0, -60.0]), None);
    }
}
