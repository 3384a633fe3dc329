//! The mapper: where a scan was taken, and what of it enters the map.

use std::borrow::Cow;
use std::time::Instant;

use super::carving::{Carving, CarvingScan, CarvingSettings};
use super::deskew::DeskewSettings;
use super::error::MappingError;
use super::located_scan::LocatedScan;
use super::odometry::OdometrySettings;
use super::recovery_settings::Recovery;
use super::resolved_guess::last_seen;
use super::scan::Scan;
use super::sensor_mount::SensorMount;
use super::sightings::Sightings;
use super::stationary::StationarySettings;
use super::viewpoints::{SeenScan, ViewpointSettings};
use crate::align::{Alignment, AlignmentSettings, Verdict, align_until, evaluate_at};
use crate::geometry::{Point, Pose, Twist, pose_difference};
use crate::map::{MappedScan, MultiResolutionMap, ScanRecord};
use crate::util::StopSignal;
use crate::visibility::ScanRays;

/// A scan that was found farther from its guess than this leaves a viewpoint, meters: the next ones come from there.
const FAR_M: f64 = 1.0;
/// A scan is aligned again where the motion that was found moves one of its points by more than this share of a finest
/// voxel. Below it no error that was measured changed by more than 0.3 mm (docs/measurements.md, Deskewing).
const SHARPER: f64 = 1.0 / 32.0;

/// Maps scans: finds where each was taken, and adds those that fit to the map.
///
/// ```
/// use mrol_map::geometry::{Point, Pose};
/// use mrol_map::map::{MapSettings, MultiResolutionMap, RobotName};
/// use mrol_map::mapping::{MappingSettings, Scan, ScanMapper, Sightings};
/// use mrol_map::util::StopSignal;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let map = MultiResolutionMap::new(MapSettings::new(0.05, 4))?;
/// let robot = RobotName::new("r1")?;
/// let points: Vec<_> = (0..200).map(|i| Point::new(2.0, 0.02 * i as f32, 0.5)).collect();
///
/// let sightings = Sightings::default();
/// let mapper = ScanMapper::new(&map, &sightings, MappingSettings::default());
/// let mapped = mapper.map_scan(&Scan::new(&robot, &points), StopSignal::NEVER)?;
/// assert!(mapped.is_inserted());
/// assert_eq!(mapped.located.alignment.map_from_sensor, Pose::identity());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ScanMapper<'a> {
    pub(super) map: &'a MultiResolutionMap,
    pub(super) sightings: &'a Sightings,
    pub(super) settings: MappingSettings,
    pub(super) recovery: Option<Recovery<'a>>,
}

/// Settings of a [`ScanMapper`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MappingSettings {
    /// How scans are aligned.
    pub alignment: AlignmentSettings,
    /// When a scan shows nothing new because its robot stands still; none: every scan that fits is inserted.
    pub stationary: Option<StationarySettings>,
    /// How far off guesses may be of which nobody says.
    pub odometry: OdometrySettings,
    /// When a motion is believed that scans are deskewed with.
    pub deskew: DeskewSettings,
    /// When a scan leaves a viewpoint.
    pub viewpoints: ViewpointSettings,
    /// What a scan that fits carves out of the map; none: it only adds.
    pub carving: Option<CarvingSettings>,
    /// How the sensor is mounted: where the first scan of an empty map was taken if nobody says.
    pub mount: SensorMount,
}

impl<'a> ScanMapper<'a> {
    /// A mapper of scans into `map`, whose robots were seen as `sightings` tells.
    pub fn new(map: &'a MultiResolutionMap, sightings: &'a Sightings, settings: MappingSettings) -> Self {
        Self { map, sightings, settings, recovery: None }
    }

    /// This mapper, which looks from one start alone, for no lost robot, and for some 30 ms: the answer holds where it
    /// is accepted and [wants no more starts](Alignment::wants_more_starts).
    #[must_use]
    pub fn from_one_start(self) -> Self {
        let mut settings = self.settings;
        settings.alignment.multi_start.ascents = 0;
        Self { settings, recovery: None, ..self }
    }

    /// This mapper, whose scans carve the map as `carving` says, or not.
    #[must_use]
    pub fn carving(self, carving: Option<CarvingSettings>) -> Self {
        Self { settings: MappingSettings { carving, ..self.settings }, ..self }
    }

    /// This mapper, for scans of a sensor that is mounted so.
    #[must_use]
    pub fn with_mount(self, mount: SensorMount) -> Self {
        Self { settings: MappingSettings { mount, ..self.settings }, ..self }
    }

    /// This mapper, for scans of a robot whose odometry errs so.
    #[must_use]
    pub fn with_odometry(self, odometry: OdometrySettings) -> Self {
        Self { settings: MappingSettings { odometry, ..self.settings }, ..self }
    }

    /// Finds where a scan was taken; changes nothing.
    ///
    /// The first scan of an empty map is taken at its guess, upright where it tells the direction of gravity. Every
    /// other one is aligned from its guess, or only judged there where the caller wants it at its guess. Points with
    /// times are deskewed: first by the motion that the guess tells, then, once the alignment has found the pose, by
    /// the motion to that, and aligned again where that moves them.
    ///
    /// # Errors
    /// The guess needs a pose that is not there, or `stop` said so.
    pub fn locate(&self, scan: &Scan<'_>, stop: StopSignal<'_>) -> Result<LocatedScan, MappingError> {
        let Self { map, sightings, .. } = self;
        let start = Instant::now();
        let map_is_empty = map.is_empty();
        let first_pose = map_is_empty.then(|| self.settings.mount.first_pose());
        let guess =
            scan.guess.resolve(scan.robot, scan.timestamp_ns, &map.trajectory(), sightings, first_pose)?;
        let mut velocity = self.velocity(scan, &guess);
        let mut alignment = if map_is_empty {
            let upright = if scan.at_guess { guess } else { self.prior(scan, guess).leveled_guess() };
            Alignment::trusted(upright, map.settings().levels, scan.points)
        } else {
            self.align(scan, velocity.as_ref(), &guess, stop)
        };
        if scan.times_s.is_some() && !scan.at_guess && alignment.verdict == Verdict::Accepted {
            let found = self.velocity(scan, &alignment.map_from_sensor);
            let moved_m = scan.points_moved_m(velocity.as_ref(), found.as_ref());
            let is_sharper = found.is_some() && moved_m > SHARPER * map.settings().resolution_m;
            if is_sharper {
                let wants_more_starts = alignment.wants_more_starts;
                alignment = self.align(scan, found.as_ref(), &alignment.map_from_sensor, stop);
                alignment.wants_more_starts |= wants_more_starts;
            }
            velocity = found.or(velocity);
        }
        if stop.is_stopped() {
            return Err(MappingError::Stopped);
        }
        let is_first = map_is_empty && !scan.at_guess;
        let align_time = start.elapsed();
        Ok(LocatedScan { guess, alignment, align_time, is_first, velocity, recovered: None })
    }

    /// Aligns a scan from `guess`, or judges it there, its points deskewed by `velocity`.
    fn align(
        &self,
        scan: &Scan<'_>,
        velocity: Option<&Twist>,
        guess: &Pose,
        stop: StopSignal<'_>,
    ) -> Alignment {
        let (points, settings) = (scan.points_at(velocity), &self.settings.alignment);
        match scan.at_guess {
            true => evaluate_at(self.map, &points, guess, settings, stop),
            false => align_until(self.map, &points, &self.prior(scan, *guess), settings, stop),
        }
    }

    /// The velocity of the sensor of a scan with times, if it was taken at `map_from_sensor`: constant since its robot
    /// was seen last. None where a time or the last pose is not known.
    fn velocity(&self, scan: &Scan<'_>, map_from_sensor: &Pose) -> Option<Twist> {
        scan.times_s?;
        let (last, last_ns) = last_seen(scan.robot, &self.map.trajectory(), self.sightings)?;
        self.settings.deskew.velocity((&last, last_ns), (map_from_sensor, scan.timestamp_ns))
    }

    /// The record of a scan where it was found: every voxel it touches, the moments of its points where the map keeps
    /// them, its pose, and its viewpoint where it sees something new.
    ///
    /// # Errors
    /// No point lies within the map's range, or `stop` said so.
    pub fn record(
        &self,
        scan: &Scan<'_>,
        located: &LocatedScan,
        stop: StopSignal<'_>,
    ) -> Result<ScanRecord, MappingError> {
        let (alignment, velocity) = (&located.alignment, located.velocity.as_ref());
        let pose = MappedScan {
            robot: scan.robot.clone(),
            session: scan.session.clone(),
            scan_id: scan.scan_id,
            timestamp_ns: scan.timestamp_ns,
            map_from_sensor: alignment.map_from_sensor,
            revision: 0,
            level_overlaps: alignment.level_overlaps.clone(),
            iterations: alignment.iterations,
            points_skipped: scan.points_skipped,
            new_voxels: 0,
            carved_voxels: 0,
            digest: scan.digest,
        };
        let points = scan.points_at(velocity);
        let mut record = match self.map.settings().moments {
            true => ScanRecord::of_points(pose, &points, self.map.lattice()),
            false => ScanRecord::without_moments(pose, &points, self.map.lattice()),
        };
        if record.voxels.is_empty() {
            let (min_m, end_m) = self.map.lattice().range_m();
            return Err(MappingError::OutOfRange { min_m, end_m });
        }
        let mut points = self.met(scan, &record, velocity);
        if !scan.no_returns.points.is_empty() {
            points.to_mut().extend_from_slice(&scan.no_returns.at(velocity));
        }
        let beyond = scan.beyond.at(velocity);
        let (map_from_sensor, moved_m) = (&alignment.map_from_sensor, scan.moved_m(velocity));
        let from_guess_m = pose_difference(&located.guess, map_from_sensor).0;
        let is_needed = located.is_first || from_guess_m > FAR_M;
        let is_stationary = self.is_stationary(scan, map_from_sensor);
        let (points, beyond) = (&points, &beyond);
        let sensor = scan.sensor;
        let seen = SeenScan { points, beyond, map_from_sensor, moved_m, is_needed, is_stationary, sensor };
        record.viewpoint = self.settings.viewpoints.viewpoint_of(seen, &self.map.viewpoints(), stop);
        if stop.is_stopped() {
            return Err(MappingError::Stopped);
        }
        Ok(record)
    }

    /// True of a scan that was taken where its robot's last one was that is in the map.
    fn is_stationary(&self, scan: &Scan<'_>, map_from_sensor: &Pose) -> bool {
        let settings = self.settings.stationary.unwrap_or_default();
        let trajectory = self.map.trajectory();
        let last = trajectory.last_of(scan.robot);
        last.is_some_and(|last| settings.is_same_pose(self.map, &last.map_from_sensor, map_from_sensor))
    }

    /// Where rays of a scan ended, the robot itself too, where the scan is as its record says.
    ///
    /// Points outside the map's range are none: drivers write a huge number where nothing returned, which says nothing.
    fn met<'s>(&self, scan: &Scan<'s>, record: &ScanRecord, velocity: Option<&Twist>) -> Cow<'s, [Point]> {
        let mut met = scan.met_at(velocity);
        if record.pose.points_skipped > scan.points_skipped {
            let from_points = self.map.lattice().from_points(&record.pose.map_from_sensor);
            met.to_mut().retain(|&point| from_points.index(point).is_some());
        }
        met
    }

    /// The voxels of the map that a scan saw through from where it was found; none where this mapper does not carve,
    /// the scan does not fit, or its pose is not [beyond doubt](Alignment::is_beyond_doubt): what is real must not go.
    ///
    /// They are those of the map's revision that the answer names: whoever inserts the scan later
    /// [cuts](Carving::cut) them to what is still there.
    ///
    /// # Errors
    /// When `stop` said so.
    pub fn carve(
        &self,
        scan: &Scan<'_>,
        located: &LocatedScan,
        record: &ScanRecord,
        stop: StopSignal<'_>,
    ) -> Result<Carving, MappingError> {
        let Some(settings) =
            self.settings.carving.filter(|_| located.is_accepted() && located.alignment.is_beyond_doubt())
        else {
            return Ok(Carving::default());
        };
        let velocity = located.velocity.as_ref();
        let met = self.met(scan, record, velocity);
        let (beyond, no_returns) = (scan.beyond.at(velocity), scan.no_returns.at(velocity));
        let rays = ScanRays { met: &met, beyond: &beyond, no_returns: &no_returns };
        let carving = CarvingScan { rays, record, moved_m: scan.moved_m(velocity), sensor: scan.sensor };
        carving.carve(self.map, &settings, stop)
    }

    /// True of a scan that shows again what its robot's last one showed, from where that was taken, carves nothing, and
    /// sees nothing newly. That the robot was seen there is noted for its next guess.
    ///
    /// Never true of a scan that the caller wants at its guess, or in the map whatever it shows (`force`).
    pub(super) fn note_stationary(&self, scan: &Scan<'_>, record: &ScanRecord) -> bool {
        let changes_what_is_free = !record.carved.is_empty() || record.viewpoint.is_some();
        let is_kept = scan.at_guess || scan.force || changes_what_is_free;
        let Some(settings) = self.settings.stationary.filter(|_| !is_kept) else {
            return false;
        };
        let Some(last) = self.map.trajectory().last_of(scan.robot).cloned() else { return false };
        let is_stationary = settings.is_stationary(self.map, &last, record);
        if is_stationary {
            self.sightings.note_standing(&last, record.pose.map_from_sensor, scan.timestamp_ns);
        }
        is_stationary
    }
}
