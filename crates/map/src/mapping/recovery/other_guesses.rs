//! The other guesses from which a refused scan is aligned.

use std::time::Instant;

use super::motion::motion_between;
use crate::align::localize::Gravity;
use crate::align::{Alignment, AlignmentSettings, MultiStartSettings, PosePrior, Verdict, align_until};
use crate::geometry::{Point, Pose, pose_difference, translation_m};
use crate::map::RobotName;
use crate::mapping::error::MappingError;
use crate::mapping::guess::Guess;
use crate::mapping::located_scan::LocatedScan;
use crate::mapping::lost_robots::{LostRobot, LostRobots, LostSince, RefusedScan};
use crate::mapping::recovered::Recovered;
use crate::mapping::recovery_settings::{Recovery, RecoverySettings};
use crate::mapping::resolved_guess::last_seen;
use crate::mapping::scan::Scan;
use crate::mapping::scan_mapper::ScanMapper;
use crate::mapping::scan_prior::seconds_between;
use crate::util::StopSignal;
use crate::voxel::volumetric_sample_until;

/// A pose from which a refused scan is aligned again.
type OtherGuess = (Recovered, Pose);

impl<'a> ScanMapper<'a> {
    /// This mapper, which looks for robots whose scans are refused and remembers them in `lost`.
    #[must_use]
    pub fn recovering(self, lost: &'a LostRobots, settings: RecoverySettings) -> Self {
        Self { recovery: Some(Recovery { lost, settings }), ..self }
    }

    /// Looks for a scan that was refused where it was `located`: aligns it from other guesses. Returns where it is.
    ///
    /// An accepted scan is returned as it is, and so is one that is in the map at the caller's word (`at_guess`,
    /// `force`): its robot is lost no longer.
    ///
    /// # Errors
    /// `stop` said so.
    pub fn recover(
        &self,
        scan: &Scan<'_>,
        located: LocatedScan,
        stop: StopSignal<'_>,
    ) -> Result<LocatedScan, MappingError> {
        let Some(recovery) = self.recovery else { return Ok(located) };
        if located.is_accepted() || scan.at_guess || scan.force {
            recovery.lost.found(scan.robot);
            return Ok(located);
        }
        let start = Instant::now();
        let points = scan.points_at(located.velocity.as_ref());
        let settings = &recovery.settings;
        let kept =
            volumetric_sample_until(&points, settings.points_kept, self.settings.alignment.seed, stop).points;
        let since = self.lost_since(scan);
        let before = recovery.lost.get(scan.robot, &since);
        let motion = before.as_ref().and_then(|before| {
            let expected = seconds_between(before.timestamp_ns, scan.timestamp_ns)
                .map(|seconds| self.settings.odometry.after(seconds));
            let alignment = &self.settings.alignment;
            motion_between(&before.points, &kept, expected, self.map.settings(), alignment, stop)
        });
        let found = self.try_place(scan, before.as_ref(), motion.as_ref(), &points, stop);
        let found = match found {
            Some(found) => Ok(found),
            None => self.try_other_guesses(scan, &located, before.as_ref(), motion.as_ref(), &points, stop),
        };
        if stop.is_stopped() {
            return Err(MappingError::Stopped);
        }
        let align_time = located.align_time + start.elapsed();
        match found {
            Ok((recovered, alignment)) => {
                recovery.lost.found(scan.robot);
                Ok(LocatedScan { alignment, align_time, recovered: Some(recovered), ..located })
            }
            Err(reason) => {
                recovery.lost.note(RefusedScan {
                    robot: scan.robot,
                    since,
                    timestamp_ns: scan.timestamp_ns,
                    gravity: scan.gravity,
                    points: kept,
                    motion,
                    probable_pose: self.probable_pose(scan, &located),
                    is_not_in_place: before.is_some_and(|before| before.place.is_some()),
                });
                let alignment = match reason {
                    Some(reason) => located.alignment.but(Verdict::Ambiguous, reason),
                    None => located.alignment,
                };
                Ok(LocatedScan { alignment, align_time, ..located })
            }
        }
    }

    /// Aligns the scan from where a search saw its robot, moved on since by `motion`: accepted where it is there.
    fn try_place(
        &self,
        scan: &Scan<'_>,
        before: Option<&LostRobot>,
        motion: Option<&Pose>,
        points: &[Point],
        stop: StopSignal<'_>,
    ) -> Option<(Recovered, Alignment)> {
        let guess = before?.place? * motion?;
        let settings = &self.recovery?.settings;
        let alignment = self.align_again(points, &guess, scan.gravity, &self.settings.alignment, stop);
        let is_there =
            self.agrees(&alignment, &guess, settings) && self.may_be_at(scan, &alignment.map_from_sensor);
        is_there.then_some((Recovered::Localization, alignment))
    }

    /// Since when the robot of a refused scan is lost.
    fn lost_since(&self, scan: &Scan<'_>) -> LostSince {
        LostSince {
            session: scan.session.clone(),
            stored: self.map.trajectory().last_of(scan.robot).map(|last| last.revision),
        }
    }

    /// Aligns the scan from other guesses than its own.
    ///
    /// # Errors
    /// When it fits from none of them; with a reason where it fits from several, at different places.
    fn try_other_guesses(
        &self,
        scan: &Scan<'_>,
        located: &LocatedScan,
        before: Option<&LostRobot>,
        motion: Option<&Pose>,
        points: &[Point],
        stop: StopSignal<'_>,
    ) -> Result<(Recovered, Alignment), Option<String>> {
        let Some(Recovery { settings, .. }) = self.recovery else { return Err(None) };
        let mut found: Option<(Recovered, Alignment)> = None;
        for (how, guess) in self.other_guesses(scan, before, motion) {
            let fits = self.align_if_it_fits(points, &guess, scan.gravity, stop);
            let Some(alignment) = fits.filter(|fits| self.may_be_at(scan, &fits.map_from_sensor)) else {
                continue;
            };
            match &found {
                Some((_, first))
                    if !self.is_near(&first.map_from_sensor, &alignment.map_from_sensor, &settings) =>
                {
                    let (meters, degrees) =
                        pose_difference(&first.map_from_sensor, &alignment.map_from_sensor);
                    return Err(Some(format!(
                        "{}; from other guesses it fits at two places, {meters:.2} m and {degrees:.1} deg apart",
                        located.alignment.reason
                    )));
                }
                Some(_) => {}
                None => found = Some((how, alignment)),
            }
        }
        found.ok_or(None)
    }

    /// The guesses of a refused scan other than its own, each far enough from those before it to lead elsewhere.
    fn other_guesses(
        &self,
        scan: &Scan<'_>,
        before: Option<&LostRobot>,
        motion: Option<&Pose>,
    ) -> Vec<OtherGuess> {
        let resolved = |guess: Guess| {
            guess.resolve(scan.robot, scan.timestamp_ns, &self.map.trajectory(), self.sightings, None).ok()
        };
        // A scan that does not align to the one before it was taken near that all the same.
        let chained = before.map(|before| before.chained * motion.copied().unwrap_or_else(Pose::identity));
        let all = [
            (Recovered::ChainedScans, chained),
            (Recovered::LastPose, resolved(Guess::Last)),
            (Recovered::ConstantVelocity, resolved(Guess::ConstantVelocity)),
        ];
        let own = resolved(scan.guess);
        let resolution_m = self.map.settings().resolution_m;
        let mut tried: Vec<Pose> = own.into_iter().collect();
        let mut others = Vec::new();
        for (how, guess) in all {
            let Some(guess) = guess else { continue };
            let is_new = |tried: &Pose| {
                let (meters, degrees) = pose_difference(tried, &guess);
                meters > resolution_m || degrees > 1.0
            };
            if tried.iter().all(is_new) {
                tried.push(guess);
                others.push((how, guess));
            }
        }
        others
    }

    /// Where a refused scan most probably was taken: where its alignment ended if only that is open, else at its guess.
    fn probable_pose(&self, scan: &Scan<'_>, located: &LocatedScan) -> Pose {
        if located.alignment.verdict == Verdict::Undetermined {
            return located.alignment.map_from_sensor;
        }
        let guess =
            scan.guess.resolve(scan.robot, scan.timestamp_ns, &self.map.trajectory(), self.sightings, None);
        guess.unwrap_or(located.alignment.map_from_sensor)
    }

    /// Aligns a scan from `guess`; none where it does not fit. Most do not, and the first of many starts says so in a
    /// tenth of the time: the others look for rivals where it fits.
    fn align_if_it_fits(
        &self,
        points: &[Point],
        guess: &Pose,
        gravity: Option<Gravity>,
        stop: StopSignal<'_>,
    ) -> Option<Alignment> {
        let all = self.settings.alignment;
        let first =
            AlignmentSettings { multi_start: MultiStartSettings { ascents: 0, ..all.multi_start }, ..all };
        let fits = |settings| {
            let alignment = self.align_again(points, guess, gravity, settings, stop);
            (alignment.verdict == Verdict::Accepted).then_some(alignment)
        };
        fits(&first).and_then(|_| fits(&all))
    }

    /// Aligns a scan from `guess`.
    fn align_again(
        &self,
        points: &[Point],
        guess: &Pose,
        gravity: Option<Gravity>,
        settings: &AlignmentSettings,
        stop: StopSignal<'_>,
    ) -> Alignment {
        let prior = PosePrior { gravity, ..(*guess).into() };
        align_until(self.map, points, &prior, settings, stop)
    }

    fn agrees(&self, alignment: &Alignment, expected: &Pose, settings: &RecoverySettings) -> bool {
        alignment.verdict == Verdict::Accepted && self.is_near(&alignment.map_from_sensor, expected, settings)
    }

    fn is_near(&self, a: &Pose, b: &Pose, settings: &RecoverySettings) -> bool {
        let (meters, degrees) = pose_difference(a, b);
        meters <= settings.agreement * self.map.settings().resolution_m && degrees <= settings.agreement_deg
    }

    /// True of a pose that the robot can have reached, and that the covariance of the scan's own guess does not rule
    /// out.
    fn may_be_at(&self, scan: &Scan<'_>, pose: &Pose) -> bool {
        let is_in_reach = self
            .reachable(scan.robot, scan.timestamp_ns)
            .is_none_or(|reachable| reachable.contains(translation_m(pose)));
        let own =
            scan.guess.resolve(scan.robot, scan.timestamp_ns, &self.map.trajectory(), self.sightings, None);
        let is_ruled_out = own.is_ok_and(|guess| {
            self.prior(scan, guess).rules_out(
                pose,
                self.map.settings().resolution_m,
                &self.settings.alignment,
            )
        });
        is_in_reach && !is_ruled_out
    }

    /// The robot's last good pose, with its time.
    pub(super) fn last_good(&self, robot: &RobotName) -> Option<(Pose, Option<i64>)> {
        last_seen(robot, &self.map.trajectory(), self.sightings)
    }
}
