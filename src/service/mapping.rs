//! How a scan enters a map: align, quantise, propose (paper III).

use std::sync::Arc;

use super::committing::{Prepared, Proposal, Step, Turn, record_of};
use super::hosted_map::HostedMap;
use super::{ErrorCode, ScanAnswer, ScanRequest, ServiceError, ServiceSettings};
use crate::align::{Alignment, Guess, Verdict, align, judge_at};
use crate::geometry::{Point, Pose, rotation_xyzw, translation_m};
use crate::map::{Change, Committed, RobotName, ScanRecord, TrajectoryPose};
use crate::voxel::VoxelSet;

/// A scan reduced to the points that can be somewhere.
struct UsableScan<'a> {
    request: &'a ScanRequest,
    points: Vec<Point>,
    not_finite: usize,
    digest: u64,
}

/// Where a scan goes, and what that was decided on.
struct Placement {
    alignment: Alignment,
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
    ) -> Result<Step<ScanAnswer>, ServiceError> {
        self.check_writable()?;
        let scan = UsableScan::of(request)?;
        if let Some(answer) = self.replay(&scan)? {
            return Ok(Step::Answered(answer));
        }
        self.check_room(settings)?;
        let placement = self.place(&scan, settings)?;
        if placement.alignment.verdict != Verdict::Accepted {
            return Ok(Step::Answered(self.answer(&scan, placement.alignment)));
        }
        let (voxels, out_of_range) = self.quantise(&scan, &placement.alignment.map_from_sensor)?;
        let pose = pose_of(&scan, placement.alignment, out_of_range);
        let change = Change::Insertion(ScanRecord { pose: pose.clone(), voxels });
        let record = self.folder.as_ref().map(|_| record_of(&change)).transpose()?;
        let prepared = Prepared { change, record, if_empty: placement.as_first, turn };
        let outcome = self.committing.propose(Proposal::Prepared(prepared.into()));
        let map = Arc::clone(self);
        Ok(Step::Proposed(outcome, Box::new(move |committed| map.committed(pose, committed))))
    }

    /// What to say of a scan that was committed.
    fn committed(&self, pose: TrajectoryPose, committed: Committed) -> ScanAnswer {
        let Committed { revision, voxels: new_voxels } = committed;
        self.answer_of(&TrajectoryPose { revision, new_voxels, ..pose }, false)
    }

    /// Says what [`HostedMap::propose_scan`] would; changes nothing.
    pub(super) fn align_scan(
        &self,
        request: &ScanRequest,
        settings: &ServiceSettings,
    ) -> Result<ScanAnswer, ServiceError> {
        let scan = UsableScan::of(request)?;
        let placement = self.place(&scan, settings)?;
        Ok(self.answer(&scan, placement.alignment))
    }

    /// The first answer again, where this scan was accepted before.
    fn replay(&self, scan: &UsableScan<'_>) -> Result<Option<ScanAnswer>, ServiceError> {
        let Some(scan_id) = scan.request.scan_id else {
            return Ok(None);
        };
        let trajectory = self.map.trajectory();
        let Some(pose) = trajectory.find(&scan.request.robot, scan_id) else {
            return Ok(None);
        };
        if pose.digest == scan.digest {
            return Ok(Some(self.answer_of(pose, true)));
        }
        let message = format!(
            "scan_id {scan_id} of robot {} was accepted at revision {} with other content: number new scans anew",
            pose.robot, pose.revision
        );
        Err(ServiceError::new(ErrorCode::Conflict, "scan_id_taken", message))
    }

    /// Decides where the scan goes.
    fn place(&self, scan: &UsableScan<'_>, settings: &ServiceSettings) -> Result<Placement, ServiceError> {
        let request = scan.request;
        let first = self.map.is_empty();
        let guess = self.resolve(&request.guess, &request.robot, first)?;
        let alignment = if first {
            trusted(guess, vec![0.0; self.map.settings().levels as usize])
        } else if request.at_guess {
            let judged = judge_at(&self.map, &scan.points, &guess, &settings.alignment);
            trusted(guess, judged.level_overlaps)
        } else {
            align(&self.map, &scan.points, &guess, &settings.alignment)
        };
        Ok(Placement { alignment, as_first: first && !request.at_guess })
    }

    /// The pose that a guess stands for.
    fn resolve(&self, guess: &Guess, robot: &RobotName, first: bool) -> Result<Pose, ServiceError> {
        let last = || self.map.trajectory().last_of(robot).map(|pose| pose.map_from_sensor);
        let last_or_origin = || match last() {
            Some(pose) => Ok(pose),
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
        }
    }

    /// The voxels that the scan touches, and how many of its points are beyond the map's range.
    fn quantise(
        &self,
        scan: &UsableScan<'_>,
        map_from_sensor: &Pose,
    ) -> Result<(VoxelSet, usize), ServiceError> {
        let (voxels, out_of_range) =
            VoxelSet::of_points(&scan.points, &self.map.lattice().from_points(map_from_sensor));
        if voxels.is_empty() {
            let (min_m, end_m) = self.map.lattice().range_m();
            let message = format!("no point of the scan lies within the map's range of {min_m} to {end_m} m");
            return Err(ServiceError::invalid("scan_out_of_range", message));
        }
        Ok((voxels, out_of_range))
    }

    fn check_room(&self, settings: &ServiceSettings) -> Result<(), ServiceError> {
        let (voxels, most) = (self.map.voxels(0), settings.limits.voxels_per_map_max);
        if voxels < most {
            return Ok(());
        }
        let message = format!("map {} has {voxels} voxels, voxels_per_map_max is {most}", self.name);
        Err(ServiceError::new(ErrorCode::ResourceExhausted, "map_full", message))
    }

    /// What to say of a scan that is in the map.
    fn answer_of(&self, pose: &TrajectoryPose, replayed: bool) -> ScanAnswer {
        ScanAnswer {
            verdict: Verdict::Accepted,
            map_from_sensor: pose.map_from_sensor,
            level_overlaps: pose.level_overlaps.clone(),
            iterations: pose.iterations,
            points_skipped: pose.points_skipped,
            new_voxels: pose.new_voxels,
            state: self.state(pose.revision),
            replayed,
        }
    }

    /// What to say of a scan that was not added.
    fn answer(&self, scan: &UsableScan<'_>, alignment: Alignment) -> ScanAnswer {
        ScanAnswer {
            verdict: alignment.verdict,
            map_from_sensor: alignment.map_from_sensor,
            level_overlaps: alignment.level_overlaps,
            iterations: alignment.iterations,
            points_skipped: scan.not_finite,
            new_voxels: 0,
            state: self.state(self.map.revision()),
            replayed: false,
        }
    }
}

/// What the trajectory keeps of a scan, but for what its commit tells.
fn pose_of(scan: &UsableScan<'_>, alignment: Alignment, out_of_range: usize) -> TrajectoryPose {
    TrajectoryPose {
        robot: scan.request.robot.clone(),
        scan_id: scan.request.scan_id,
        timestamp_ns: scan.request.timestamp_ns,
        map_from_sensor: alignment.map_from_sensor,
        revision: 0,
        level_overlaps: alignment.level_overlaps,
        iterations: alignment.iterations,
        points_skipped: scan.not_finite + out_of_range,
        new_voxels: 0,
        digest: scan.digest,
    }
}

/// An alignment that nobody had to find: the caller's word, or the first scan of the map.
fn trusted(map_from_sensor: Pose, level_overlaps: Vec<f64>) -> Alignment {
    Alignment { map_from_sensor, verdict: Verdict::Accepted, level_overlaps, iterations: 0, lookups: 0 }
}

impl<'a> UsableScan<'a> {
    /// Sorts out "no return".
    ///
    /// # Errors
    /// When no point is left, or one had to be left out of a strict request.
    fn of(request: &'a ScanRequest) -> Result<Self, ServiceError> {
        let all = request.points.as_slice();
        let points: Vec<Point> = all.iter().copied().filter(|point| point.is_finite()).collect();
        let not_finite = all.len() - points.len();
        if request.strict && not_finite > 0 {
            let place = all.iter().position(|point| !point.is_finite()).unwrap_or_default();
            let message = format!("strict: points[{place}] is not finite, and {not_finite} points are not");
            return Err(ServiceError::invalid("point_not_finite", message));
        }
        if points.is_empty() {
            let message = format!("none of the scan's {not_finite} points is finite: nothing but no-returns");
            return Err(ServiceError::invalid("no_returns", message));
        }
        Ok(Self { request, points, not_finite, digest: digest(request) })
    }
}

/// Tells one request from another under the same id: points, guess, and whether to align.
fn digest(request: &ScanRequest) -> u64 {
    let guess = match &request.guess {
        Guess::Last => Vec::new(),
        Guess::Pose(pose) | Guess::Motion(pose) => {
            [&translation_m(pose)[..], &rotation_xyzw(pose)[..]].concat()
        }
    };
    let kind = [u8::from(request.at_guess), u8::from(matches!(request.guess, Guess::Motion(_)))];
    let checksum = crc32c::crc32c(bytemuck::cast_slice(request.points.as_slice()));
    let checksum = crc32c::crc32c_append(checksum, bytemuck::cast_slice(&guess));
    let checksum = crc32c::crc32c_append(checksum, &kind);
    (request.points.len() as u64) << 32 | u64::from(checksum)
}
