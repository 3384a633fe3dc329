//! How a scan enters a map: align, quantize, submit (paper III).

use std::sync::Arc;
use std::time::Duration;

use super::filtered::FilteredScan;
use crate::commit::{Prepared, RobotLock, Step, Submission, TurnLimits, record_of};
use crate::error::{Reason, ServiceError};
use crate::maps::HostedMap;
use crate::request::{Foreground, ScanAnswer, ScanRequest, bitmap, scan_id_too_old, scan_name};
use crate::resources::{ResourceBudget, growth_bytes, removal_bytes};
use crate::settings::{RobotSettings, ServiceSettings};
use crate::work::check_not_stopped;
use mrol_map::align::Verdict;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{Change, Committed, KnownScan, Lookup, MappedScan, ScanRecord};
use mrol_map::mapping::{Decision, LocatedScan, MappingError, ScanMapper, deskewed};
use mrol_map::util::StopSignal;
use mrol_map::visibility::VIEWPOINT_MEMORY_MAX;

/// A scan that was judged: the answer, and what is told of it besides.
pub(crate) struct Judged {
    pub(crate) answer: ScanAnswer,
    /// The pose that its guess stood for; none of an answer that is given again.
    pub(super) guess: Option<Pose>,
    /// Some of the points, where it was refused.
    pub(super) sample: Vec<Point>,
}

/// Points that are kept of a refused scan.
const SAMPLE_POINTS: usize = 300;

/// How far a scan is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effort {
    /// By one ascent, from its guess: some 30 ms.
    OneStart,
    /// From other starts too, and where lost robots may be: up to seconds.
    Whole,
}

impl HostedMap {
    /// Aligns the scan, and where it fits prepares it for the map. Its answer is none where one start is not
    /// enough.
    pub(crate) fn prepare_scan(
        self: &Arc<Self>,
        request: &ScanRequest,
        robot_lock: RobotLock,
        effort: Effort,
        settings: &ServiceSettings,
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<Step<Option<Judged>>, ServiceError> {
        self.check_writable()?;
        let seen = self.map.revision();
        let scan = FilteredScan::of(request, settings)?;
        let replayed = self.replay(&scan)?;
        if let Some(answer) = replayed {
            return Ok(Step::Answered(Some(Judged { answer, guess: None, sample: Vec::new() })));
        }
        self.check_voxels(settings)?;
        self.check_robots(&request.robot, &settings.limits)?;
        budget.check_to_grow()?;
        self.check_room_elsewhere()?;
        let recovers = settings.recovers(request);
        let mapper = self.mapper(request.method, recovers, settings).carving(settings.carving(request));
        let RobotSettings { odometry, mount, .. } = settings.of_robot(&request.robot);
        let mapper = mapper.with_odometry(odometry).with_mount(mount);
        let mapper = if effort == Effort::Whole { mapper } else { mapper.from_one_start() };
        let located = self.locate(&scan, &mapper, stop)?;
        let takes_long = located.alignment.wants_more_starts || recovers && !located.is_accepted();
        if takes_long && effort == Effort::OneStart {
            return Ok(Step::Answered(None));
        }
        let recovered = mapper.recover(&scan.to_map(), located, stop);
        check_not_stopped(stop)?;
        let recovered = recovered?;
        let is_found = recovered.is_accepted() || request.at_guess || request.force;
        let decision = mapper.decide(&scan.to_map(), recovered, stop);
        if is_found {
            // Where nobody asks for it any more, too.
            self.robots.lost.found(&request.robot);
        }
        check_not_stopped(stop)?;
        let decision = decision?;
        let (located, scan_record, carved_at) = match decision {
            Decision::Refused(located) => return Ok(Step::Answered(Some(self.judged(&scan, &located)))),
            Decision::Stationary(located) => {
                let judged = self.judged(&scan, &located);
                let answer = ScanAnswer { accepted: true, stationary: true, ..judged.answer };
                return Ok(Step::Answered(Some(Judged { answer, sample: Vec::new(), ..judged })));
            }
            Decision::Insert { located, record, carved_at } => (located, *record, carved_at),
        };
        let judged = self.judged(&scan, &located);
        let ScanRecord { voxels, carved, moments, viewpoint, .. } = &scan_record;
        let moments = moments.as_slice().len();
        let of_viewpoint = viewpoint.as_ref().map_or(0, |_| VIEWPOINT_MEMORY_MAX as u64);
        let growth = growth_bytes(self.map.settings(), voxels, moments) + of_viewpoint;
        let removal = if carved.is_empty() { 0 } else { removal_bytes(&self.map, carved) };
        let reservation = budget.reserve_growth(growth + removal)?;
        let points_skipped = scan_record.pose.points_skipped;
        let change = Change::Insertion(scan_record);
        let record = self.folder.as_ref().map(|_| record_of(&change)).transpose()?;
        let limits = TurnLimits { carved_at, viewpoint_bytes_max: settings.limits.viewpoint_bytes_max };
        let prepared =
            Prepared { change, record, seen, if_empty: located.is_first, limits, robot_lock, reservation };
        let map = Arc::clone(self);
        let judged = Judged { answer: ScanAnswer { points_skipped, ..judged.answer }, ..judged };
        let answer = move |committed| Some(map.committed(judged, committed));
        Ok(Step::Ready(Submission::Prepared(prepared.into()), Box::new(answer)))
    }

    /// What to say of a scan that was committed.
    fn committed(&self, judged: Judged, committed: Committed) -> Judged {
        let version = self.version(committed.version());
        let (new_voxels, carved_voxels) = (committed.added, committed.removed);
        let answer = ScanAnswer { accepted: true, new_voxels, carved_voxels, version, ..judged.answer };
        Judged { answer, sample: Vec::new(), ..judged }
    }

    /// What is told of a scan that was judged, and not added yet.
    fn judged(&self, scan: &FilteredScan<'_>, located: &LocatedScan) -> Judged {
        let (answer, guess) = (self.answer(scan, located), Some(located.guess));
        let sample = if answer.accepted { Vec::new() } else { sample_of(scan.to_map().points) };
        Judged { answer, guess, sample }
    }

    /// Says what [`HostedMap::prepare_scan`] would; changes nothing.
    pub(crate) fn align_scan(
        &self,
        request: &ScanRequest,
        settings: &ServiceSettings,
        stop: StopSignal<'_>,
    ) -> Result<ScanAnswer, ServiceError> {
        request.foreground_level.map_or(Ok(()), |level| self.check_level(level)).map_err(|error| {
            let message = format!("foreground_level: {}", error.message);
            ServiceError { message, ..error }
        })?;
        let scan = FilteredScan::of(request, settings)?;
        let RobotSettings { odometry, mount, .. } = settings.of_robot(&request.robot);
        let mapper = self.mapper(request.method, false, settings).with_odometry(odometry).with_mount(mount);
        let located = self.locate(&scan, &mapper, stop)?;
        let foreground = request.foreground_level.map(|level| self.foreground(&scan, &located, level));
        Ok(ScanAnswer { foreground, ..self.answer(&scan, &located) })
    }

    /// The points of the scan in no occupied voxel of `level`.
    fn foreground(&self, scan: &FilteredScan<'_>, located: &LocatedScan, level: u32) -> Foreground {
        let all = scan.request.points.as_slice();
        let times = scan.times.as_ref().zip(located.velocity.as_ref());
        let deskewed = times.map(|(times, velocity)| deskewed(all, times.as_slice(), velocity));
        let points = deskewed.as_deref().unwrap_or(all);
        let mut words = vec![0; all.len().div_ceil(64)];
        let quantize = self.map.lattice().from_points(&located.alignment.map_from_sensor);
        let long_read = self.map.long_read();
        long_read.view().query(points, &quantize, level, Lookup::Exact, &mut words);
        drop(long_read);
        for (word, points) in words.iter_mut().zip(all.chunks(64)) {
            let counts = |(i, &point): (usize, &Point)| u64::from(scan.keeps(point)) << i;
            *word = !*word & points.iter().enumerate().map(counts).sum::<u64>();
        }
        let points = words.iter().map(|word| word.count_ones() as usize).sum();
        Foreground { bitmap: bitmap(words, all.len()), points }
    }

    /// True of a scan whose id was not accepted before, so that it may add something. Does not wait: while the
    /// trajectory changes it says false, and the alignment finds out.
    pub(super) fn is_new(&self, request: &ScanRequest) -> bool {
        let Some(trajectory) = self.map.try_trajectory() else {
            return false;
        };
        let accepted = |id| trajectory.known(&request.robot, &request.session, id).is_some();
        !request.scan_id.is_some_and(accepted)
    }

    /// The first answer again, where this scan was accepted before.
    fn replay(&self, scan: &FilteredScan<'_>) -> Result<Option<ScanAnswer>, ServiceError> {
        let ScanRequest { robot, session, scan_id: Some(scan_id), .. } = scan.request else {
            return Ok(None);
        };
        let name = || scan_name(robot, session, *scan_id);
        let trajectory = self.map.trajectory();
        let (reason, message) = match trajectory.known(robot, session, *scan_id) {
            None => return Ok(None),
            Some(KnownScan::Kept(pose)) if pose.digest == scan.digest => {
                return Ok(Some(self.answer_again(pose)));
            }
            Some(KnownScan::TooOld) => return Err(scan_id_too_old(robot, session, *scan_id)),
            Some(KnownScan::Undone(pose)) if pose.digest == scan.digest => {
                let message = format!(
                    "{} was accepted at revision {} and undone since: it is not inserted again; send it under a new \
                     scan_id to have it back",
                    name(),
                    pose.revision
                );
                (Reason::ScanWithdrawn, message)
            }
            Some(KnownScan::Kept(pose) | KnownScan::Undone(pose)) => {
                let message = format!(
                    "{} was accepted at revision {} with other content: number new scans anew, in a session with a \
                     new name after a restart",
                    name(),
                    pose.revision
                );
                (Reason::ScanIdTaken, message)
            }
        };
        Err(ServiceError::new(reason, message))
    }

    /// Finds where the scan was taken.
    fn locate(
        &self,
        scan: &FilteredScan<'_>,
        mapper: &ScanMapper<'_>,
        stop: StopSignal<'_>,
    ) -> Result<LocatedScan, ServiceError> {
        let located = mapper.locate(&scan.to_map(), stop);
        check_not_stopped(stop)?;
        located.map_err(|error| self.cannot_map(error))
    }

    /// The error of a scan that cannot be mapped, with the name of the map where it helps.
    fn cannot_map(&self, error: MappingError) -> ServiceError {
        match error {
            MappingError::GuessRequired(robot) => {
                let message = format!(
                    "guess required: robot {robot} has no accepted scan in map {}, which is not empty",
                    self.name
                );
                ServiceError::new(Reason::GuessRequired, message)
            }
            other => other.into(),
        }
    }

    fn check_voxels(&self, settings: &ServiceSettings) -> Result<(), ServiceError> {
        let (voxels, most) = (self.map.voxels(0), settings.limits.voxels_per_map_max);
        if voxels < most {
            return Ok(());
        }
        let message = format!("map {} has {voxels} voxels, voxels_per_map_max is {most}", self.name);
        Err(ServiceError::new(Reason::MapFull, message))
    }

    /// The answer to a scan that was accepted before; what was only of its alignment's moment is not kept.
    fn answer_again(&self, pose: &MappedScan) -> ScanAnswer {
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
            rays: None,
            rivals: Vec::new(),
            iterations: pose.iterations,
            align_time: Duration::ZERO,
            points_skipped: pose.points_skipped,
            new_voxels: pose.new_voxels,
            carved_voxels: pose.carved_voxels,
            foreground: None,
            version: self.version_at(pose.revision),
            replayed: true,
            stationary: false,
            recovered: None,
        }
    }

    /// What to say of a scan that was not added.
    fn answer(&self, scan: &FilteredScan<'_>, located: &LocatedScan) -> ScanAnswer {
        let alignment = &located.alignment;
        let skipped = scan.skipped(&self.map.lattice().from_points(&alignment.map_from_sensor));
        let accepted = alignment.verdict == Verdict::Accepted;
        let notes = [
            scan.sensor_mismatch().map(|mismatch| mismatch.to_string()),
            (!accepted || self.map.is_empty())
                .then(|| scan.unit_doubt())
                .flatten()
                .map(|doubt| doubt.to_string()),
        ];
        let mut reason = skipped.explain(accepted, &alignment.reason);
        notes.into_iter().flatten().for_each(|note| reason.extend(["; ", &note]));
        ScanAnswer {
            accepted,
            verdict: alignment.verdict,
            reason,
            map_from_sensor: alignment.map_from_sensor,
            level_overlaps: alignment.level_overlaps.clone(),
            inliers: alignment.inliers,
            fitness: alignment.fitness,
            information: Some(alignment.information.rows()),
            undetermined: alignment.undetermined.clone(),
            rays: alignment.agreement,
            rivals: alignment.rivals.clone(),
            iterations: alignment.iterations,
            align_time: located.align_time,
            points_skipped: skipped.total(),
            new_voxels: 0,
            carved_voxels: 0,
            foreground: None,
            version: self.version_now(),
            replayed: false,
            stationary: false,
            recovered: located.recovered,
        }
    }
}

/// Some of the points, evenly over their order.
fn sample_of(points: &[Point]) -> Vec<Point> {
    points.iter().copied().step_by(points.len().div_ceil(SAMPLE_POINTS).max(1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_has_few_points_of_a_large_scan_and_all_of_a_small_one() {
        for (points, sampled) in [(0, 0), (1, 1), (300, 300), (301, 151), (90_000, 300)] {
            assert_eq!(sample_of(&vec![Point::new(0.0, 0.0, 0.0); points]).len(), sampled);
        }
    }
}
