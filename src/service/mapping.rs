//! How a scan enters a map: align, quantise, propose (paper III).

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::committing::{Prepared, Proposal, Step, Turn, record_of};
use super::growth::growth_bytes;
use super::hosted_map::{HostedMap, bitmap};
use super::room::Room;
use super::trajectory::check_not_forgotten;
use super::usable_scan::UsableScan;
use super::{
    ErrorCode, Foreground, ScanAnswer, ScanRequest, ServiceError, ServiceSettings, StandingSettings,
    check_not_stopped,
};
use crate::align::{Alignment, AlignmentSettings, Guess, Verdict, align_until, judge_until};
use crate::geometry::{Point, Pose, extrapolate, pose_difference};
use crate::map::{Change, Committed, Lookup, ScanRecord, TrajectoryPose};
use crate::util::StopSignal;

/// Where a scan goes, and what that was decided on.
struct Placement {
    alignment: Alignment,
    align_time: Duration,
    /// It went to its guess because the map was empty: another may have come first meanwhile.
    as_first: bool,
}

impl HostedMap {
    /// Aligns the scan, and where it fits sets it on its way into the map.
    pub(super) fn propose_scan(
        self: &Arc<Self>,
        request: &ScanRequest,
        turn: Turn,
        settings: &ServiceSettings,
        room: &Room,
        stop: StopSignal<'_>,
    ) -> Result<Step<ScanAnswer>, ServiceError> {
        self.check_writable()?;
        let scan = UsableScan::of(request, settings)?;
        if let Some(answer) = self.replay(&scan)? {
            return Ok(Step::Answered(answer));
        }
        self.check_voxels(settings)?;
        self.check_robots(&request.robot, &settings.limits)?;
        room.check_to_grow()?;
        let placement = self.place(&scan, settings, stop)?;
        let answer = self.answer(&scan, &placement);
        if !answer.accepted && !request.force {
            return Ok(Step::Answered(answer));
        }
        let scan_record = self.record(&scan, &placement.alignment)?;
        check_not_stopped(stop)?;
        if !request.at_guess && self.is_standing(&scan_record, &settings.standing) {
            return Ok(Step::Answered(ScanAnswer { accepted: true, standing: true, ..answer }));
        }
        let ScanRecord { voxels, moments, .. } = &scan_record;
        let moments = moments.as_slice().len();
        let promise = room.promise(growth_bytes(self.map.settings(), voxels, moments))?;
        let points_skipped = scan_record.pose.points_skipped;
        let change = Change::Insertion(scan_record);
        let record = self.folder.as_ref().map(|_| record_of(&change)).transpose()?;
        let prepared = Prepared { change, record, if_empty: placement.as_first, turn, promise };
        let outcome = self.committing.propose(Proposal::Prepared(prepared.into()))?;
        let map = Arc::clone(self);
        let answer = ScanAnswer { points_skipped, ..answer };
        Ok(Step::Proposed(outcome, Box::new(move |committed| map.committed(answer, committed))))
    }

    /// What to say of a scan that was committed.
    fn committed(&self, answer: ScanAnswer, committed: Committed) -> ScanAnswer {
        let Committed { revision, voxels: new_voxels } = committed;
        ScanAnswer { accepted: true, new_voxels, state: self.state(revision), ..answer }
    }

    /// True of a scan that shows again what the robot's last one showed, from where that was taken.
    fn is_standing(&self, record: &ScanRecord, settings: &StandingSettings) -> bool {
        let trajectory = self.map.trajectory();
        let Some(last) = trajectory.last_of(&record.pose.robot) else {
            return false;
        };
        let (metres, degrees) = pose_difference(&last.map_from_sensor, &record.pose.map_from_sensor);
        drop(trajectory);
        metres <= settings.distance * self.map.lattice().resolution_m(0)
            && degrees <= settings.rotation_deg
            && self.map.view().absent(&record.voxels) as f64
                <= settings.new_voxels * record.voxels.len() as f64
    }

    /// Says what [`HostedMap::propose_scan`] would; changes nothing.
    pub(super) fn align_scan(
        &self,
        request: &ScanRequest,
        settings: &ServiceSettings,
        stop: StopSignal<'_>,
    ) -> Result<ScanAnswer, ServiceError> {
        request.foreground_level.map_or(Ok(()), |level| self.check_level(level))?;
        let scan = UsableScan::of(request, settings)?;
        let placement = self.place(&scan, settings, stop)?;
        let foreground = request
            .foreground_level
            .map(|level| self.foreground(&scan, &placement.alignment.map_from_sensor, level));
        Ok(ScanAnswer { foreground, ..self.answer(&scan, &placement) })
    }

    /// The points of the scan in no occupied voxel of `level`.
    fn foreground(&self, scan: &UsableScan<'_>, map_from_sensor: &Pose, level: u32) -> Foreground {
        let all = scan.request.points.as_slice();
        let mut words = vec![0; all.len().div_ceil(64)];
        let quantise = self.map.lattice().from_points(map_from_sensor);
        let long_read = self.map.long_read();
        long_read.view().query(all, &quantise, level, Lookup::Exact, &mut words);
        drop(long_read);
        for (word, points) in words.iter_mut().zip(all.chunks(64)) {
            let counts = |(i, &point): (usize, &Point)| u64::from(scan.counts(point)) << i;
            *word = !*word & points.iter().enumerate().map(counts).sum::<u64>();
        }
        let points = words.iter().map(|word| word.count_ones() as usize).sum();
        Foreground { bitmap: bitmap(words, all.len()), points }
    }

    /// True of a scan whose id was not accepted before, so that it may add something. Does not wait: while the
    /// trajectory changes it says false, and who then aligns the scan finds out.
    pub(super) fn is_new(&self, request: &ScanRequest) -> bool {
        let Some(trajectory) = self.map.try_trajectory() else {
            return false;
        };
        let robot = &request.robot;
        let accepted = |id| trajectory.find(robot, id).is_some() || trajectory.has_forgotten(robot, id);
        !request.scan_id.is_some_and(accepted)
    }

    /// The first answer again, where this scan was accepted before.
    fn replay(&self, scan: &UsableScan<'_>) -> Result<Option<ScanAnswer>, ServiceError> {
        let Some(scan_id) = scan.request.scan_id else {
            return Ok(None);
        };
        let trajectory = self.map.trajectory();
        let Some(pose) = trajectory.find(&scan.request.robot, scan_id) else {
            return check_not_forgotten(&trajectory, &scan.request.robot, scan_id).map(|()| None);
        };
        if pose.digest == scan.digest {
            return Ok(Some(self.answer_again(pose)));
        }
        let message = format!(
            "scan_id {scan_id} of robot {} was accepted at revision {} with other content: number new scans anew",
            pose.robot, pose.revision
        );
        Err(ServiceError::new(ErrorCode::Conflict, "scan_id_taken", message))
    }

    /// Decides where the scan goes.
    fn place(
        &self,
        scan: &UsableScan<'_>,
        settings: &ServiceSettings,
        stop: StopSignal<'_>,
    ) -> Result<Placement, ServiceError> {
        let request = scan.request;
        let start = Instant::now();
        let method = request.method.unwrap_or(settings.alignment.method);
        let settings = AlignmentSettings { method, ..settings.alignment };
        let first = self.map.is_empty();
        let guess = self.resolve(request, first)?;
        let alignment = if first {
            Alignment::trusted(guess, self.map.settings().levels, &scan.points)
        } else if request.at_guess {
            judge_until(&self.map, &scan.points, &guess, &settings, stop).on_the_callers_word()
        } else {
            align_until(&self.map, &scan.points, &guess, &settings, stop)
        };
        check_not_stopped(stop)?;
        Ok(Placement { alignment, align_time: start.elapsed(), as_first: first && !request.at_guess })
    }

    /// The pose that a guess stands for.
    fn resolve(&self, request: &ScanRequest, first: bool) -> Result<Pose, ServiceError> {
        let ScanRequest { guess, robot, timestamp_ns, .. } = request;
        let trajectory = self.map.trajectory();
        let last_or_origin = || match trajectory.last_of(robot) {
            Some(pose) => Ok(pose.map_from_sensor),
            None if first => Ok(Pose::identity()),
            None => {
                let message = format!(
                    "guess required: robot {robot} has no accepted scan in map {}, which is not empty",
                    self.name
                );
                Err(ServiceError::new(ErrorCode::FailedPrecondition, "guess_required", message))
            }
        };
        match guess {
            Guess::Pose(map_from_sensor) => Ok(*map_from_sensor),
            Guess::Last => last_or_origin(),
            Guess::Motion(last_from_sensor) => Ok(last_or_origin()? * last_from_sensor),
            Guess::ConstantVelocity => match trajectory.last_two_of(robot) {
                Some((last, before)) => Ok(constant_velocity(before, last, *timestamp_ns)),
                None => last_or_origin(),
            },
        }
    }

    /// What the scan does to the map where it was found to be.
    fn record(&self, scan: &UsableScan<'_>, alignment: &Alignment) -> Result<ScanRecord, ServiceError> {
        let pose = TrajectoryPose {
            robot: scan.request.robot.clone(),
            scan_id: scan.request.scan_id,
            timestamp_ns: scan.request.timestamp_ns,
            map_from_sensor: alignment.map_from_sensor,
            revision: 0,
            level_overlaps: alignment.level_overlaps.clone(),
            iterations: alignment.iterations,
            points_skipped: scan.skipped,
            new_voxels: 0,
            digest: scan.digest,
        };
        let record = ScanRecord::of_points(pose, &scan.points, self.map.lattice());
        if record.voxels.is_empty() {
            let (min_m, end_m) = self.map.lattice().range_m();
            let message = format!("no point of the scan lies within the map's range of {min_m} to {end_m} m");
            return Err(ServiceError::invalid("scan_out_of_range", message));
        }
        Ok(record)
    }

    fn check_voxels(&self, settings: &ServiceSettings) -> Result<(), ServiceError> {
        let (voxels, most) = (self.map.voxels(0), settings.limits.voxels_per_map_max);
        if voxels < most {
            return Ok(());
        }
        let message = format!("map {} has {voxels} voxels, voxels_per_map_max is {most}", self.name);
        Err(ServiceError::new(ErrorCode::ResourceExhausted, "map_full", message))
    }

    /// The answer to a scan that was accepted before; what was only of its alignment's moment is not kept.
    fn answer_again(&self, pose: &TrajectoryPose) -> ScanAnswer {
        ScanAnswer {
            accepted: true,
            verdict: Verdict::Accepted,
            reason: format!("accepted before, at revision {}", pose.revision),
            map_from_sensor: pose.map_from_sensor,
            level_overlaps: pose.level_overlaps.clone(),
            inliers: 0.0,
            fitness: 0.0,
            information: None,
            undetermined: Vec::new(),
            iterations: pose.iterations,
            align_time: Duration::ZERO,
            points_skipped: pose.points_skipped,
            new_voxels: pose.new_voxels,
            foreground: None,
            state: self.state(pose.revision),
            replayed: true,
            standing: false,
        }
    }

    /// What to say of a scan that was not added.
    fn answer(&self, scan: &UsableScan<'_>, placement: &Placement) -> ScanAnswer {
        let alignment = &placement.alignment;
        ScanAnswer {
            accepted: alignment.verdict == Verdict::Accepted,
            verdict: alignment.verdict,
            reason: alignment.reason.clone(),
            map_from_sensor: alignment.map_from_sensor,
            level_overlaps: alignment.level_overlaps.clone(),
            inliers: alignment.inliers,
            fitness: alignment.fitness,
            information: Some(alignment.information.rows()),
            undetermined: alignment.undetermined.clone(),
            iterations: alignment.iterations,
            align_time: placement.align_time,
            points_skipped: scan.skipped,
            new_voxels: 0,
            foreground: None,
            state: self.state(self.map.revision()),
            replayed: false,
            standing: false,
        }
    }
}

/// Where a robot is that goes on as it went from `before` to `last`.
fn constant_velocity(before: &TrajectoryPose, last: &TrajectoryPose, timestamp_ns: Option<i64>) -> Pose {
    let share = match [before.timestamp_ns, last.timestamp_ns, timestamp_ns] {
        // Of timestamps as far apart as the numbers go, the difference is no i64.
        [Some(t0), Some(t1), Some(t2)] if t1 > t0 && t2 > t1 => {
            t2.abs_diff(t1) as f64 / t1.abs_diff(t0) as f64
        }
        _ => 1.0,
    };
    extrapolate(&before.map_from_sensor, &last.map_from_sensor, share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::RobotName;

    fn at(x: f64, timestamp_ns: i64) -> TrajectoryPose {
        let pose = TrajectoryPose::new(RobotName::new("r").unwrap(), Pose::translation(x, 0.0, 0.0));
        TrajectoryPose { timestamp_ns: Some(timestamp_ns), ..pose }
    }

    #[test]
    fn a_motion_goes_on_in_proportion_to_the_time_whatever_the_timestamps() {
        let x = |before, last, now| {
            constant_velocity(&at(0.0, before), &at(1.0, last), Some(now)).translation.vector.x
        };
        assert_eq!(x(0, 2, 3), 1.5);
        assert!((x(i64::MIN, 0, i64::MAX) - 2.0).abs() < 1e-9);
        assert_eq!(x(i64::MIN, i64::MAX - 1, i64::MAX), 1.0);
        assert_eq!(x(i64::MIN, i64::MIN + 1, i64::MAX), 1.0 + crate::geometry::EXTRAPOLATION_SHARE_MAX);
        assert_eq!(x(i64::MAX, i64::MIN, i64::MAX), 2.0, "a clock that went back tells no share");
    }
}
