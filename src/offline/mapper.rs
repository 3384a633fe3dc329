//! Mapping of scans in this process, one after the other.

use std::time::Duration;

use crate::console::CliError;
use mrol_map::align::localize::Gravity;
use mrol_map::align::{Alignment, AlignmentSettings, Verdict};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{Lookup, MapSettings, MultiResolutionMap, RobotName};
use mrol_map::mapping::{
    CarvingSettings, Guess, LostRobots, MappingError, MappingSettings, Recovered, RecoverySettings, Scan,
    ScanMapper, SensorMount, Sightings,
};
use mrol_map::util::StopSignal;
use mrol_map::visibility::{SensorModel, SensorRays};

/// Name of the robot in the map's trajectory.
const ROBOT: &str = "mrol";

/// A map that grows scan by scan.
pub struct Mapper {
    map: MultiResolutionMap,
    settings: MappingSettings,
    robot: RobotName,
    guess: Guess,
    sightings: Sightings,
    lost: LostRobots,
    recovers: bool,
    sensor: Option<SensorModel>,
}

/// A scan to map, and what is known of it.
#[derive(Debug, Clone, Copy)]
pub struct KnownScan<'a> {
    /// Its number, which no other scan has.
    pub id: u64,
    /// In the sensor frame, meters, all of them finite.
    pub points: &'a [Point],
    /// When it was taken, nanoseconds since the Unix epoch.
    pub timestamp_ns: Option<i64>,
    /// When each point was measured, seconds from the timestamp.
    pub times_s: Option<&'a [f32]>,
    /// Direction of gravity in the sensor frame.
    pub gravity: Option<Gravity>,
    /// Where it is thought to have been taken; as the mapper is set where nobody knows.
    pub guess: Option<Guess>,
    /// The guess is its pose.
    pub at_guess: bool,
}

impl<'a> KnownScan<'a> {
    /// A scan of which nothing else is known.
    pub fn new(id: u64, points: &'a [Point]) -> Self {
        Self { id, points, timestamp_ns: None, times_s: None, gravity: None, guess: None, at_guess: false }
    }
}

/// Result of mapping a scan.
pub struct Mapped {
    /// The scan's pose, with its verdict.
    pub alignment: Alignment,
    /// Number of finest voxels that the scan added.
    pub new_voxels: usize,
    /// Number of finest voxels that the scan carved.
    pub carved_voxels: usize,
    /// Number of finest voxels after the scan.
    pub voxels: usize,
    /// False positive rate of the filters while the scan was aligned.
    pub false_positive_rate: f64,
    /// Time of the alignment.
    pub align_time: Duration,
    /// Time of the insertion.
    pub insert_time: Duration,
    /// Number of points that lie beyond the map's range where the scan was found.
    pub beyond_map: usize,
    /// How the robot, which was lost, was found again.
    pub recovered: Option<Recovered>,
}

impl Mapped {
    /// True of a scan that went into the map.
    pub fn accepted(&self) -> bool {
        self.alignment.verdict == Verdict::Accepted
    }
}

impl Mapper {
    /// A mapper of an empty map.
    ///
    /// # Errors
    /// When settings of the map are out of range.
    pub fn new(map: MapSettings, alignment: AlignmentSettings, guess: Guess) -> Result<Self, CliError> {
        Ok(Self {
            map: MultiResolutionMap::new(map).map_err(CliError::usage)?,
            // Every scan that fits is wanted in the map's trajectory.
            settings: MappingSettings { alignment, ..MappingSettings::default() },
            robot: RobotName::new(ROBOT).map_err(CliError::failed)?,
            guess,
            sightings: Sightings::default(),
            lost: LostRobots::default(),
            recovers: false,
            sensor: None,
        })
    }

    /// This mapper, which looks for the robot after a scan was refused if `recovers`.
    #[must_use]
    pub fn recovering(self, recovers: bool) -> Self {
        Self { recovers, ..self }
    }

    /// This mapper, whose scans carve what they see through if `carves`.
    #[must_use]
    pub fn carving(mut self, carves: bool) -> Self {
        self.settings.carving = carves.then(CarvingSettings::default);
        self
    }

    /// This mapper, for scans of a sensor that is mounted so.
    #[must_use]
    pub fn mounted(mut self, mount: SensorMount) -> Self {
        self.settings.mount = mount;
        self
    }

    /// This mapper, of scans of a sensor that is known, or of an unknown one.
    #[must_use]
    pub fn with_sensor(self, sensor: Option<SensorModel>) -> Self {
        Self { sensor, ..self }
    }

    /// The map so far.
    pub fn map(&self) -> &MultiResolutionMap {
        &self.map
    }

    /// True when the alignment asks the filters alone.
    pub fn asks_filters(&self) -> bool {
        self.settings.alignment.lookup == Lookup::Bloom && self.map.settings().filter.is_some()
    }

    /// Aligns scan `k` to the map, or takes `known` as its pose, and adds it where it fits.
    ///
    /// # Errors
    /// When no point of it lies within the map's range.
    pub fn add(&mut self, k: usize, points: &[Point], known: Option<Pose>) -> Result<Mapped, MappingError> {
        let guess = known.map(Guess::Pose);
        self.add_known(KnownScan { guess, at_guess: known.is_some(), ..KnownScan::new(k as u64, points) })
    }

    /// Aligns a scan to the map, or takes its guess as its pose, and adds it where it fits.
    ///
    /// # Errors
    /// When no point of it lies within the map's range.
    pub fn add_known(&mut self, known: KnownScan<'_>) -> Result<Mapped, MappingError> {
        let points = known.points;
        let false_positive_rate = if self.asks_filters() { self.false_positive_rate() } else { 0.0 };
        let sensor = self.sensor.map(|model| SensorRays::confirmed(&model, points));
        let scan = Scan {
            sensor: sensor.and_then(Result::ok),
            scan_id: Some(known.id),
            timestamp_ns: known.timestamp_ns,
            times_s: known.times_s,
            gravity: known.gravity,
            guess: known.guess.unwrap_or(self.guess),
            at_guess: known.at_guess,
            ..Scan::new(&self.robot, points)
        };
        let mut mapper = ScanMapper::new(&self.map, &self.sightings, self.settings);
        if self.recovers {
            mapper = mapper.recovering(&self.lost, RecoverySettings::default());
        }
        let mut outcome = mapper.map_scan(&scan, StopSignal::NEVER)?;
        if let Some(mismatch) = sensor.and_then(Result::err) {
            let reason = &mut outcome.located.alignment.reason;
            *reason = format!("{reason}; {mismatch}");
        }
        let from_points = self.map.lattice().from_points(&outcome.located.alignment.map_from_sensor);
        Ok(Mapped {
            beyond_map: points.iter().filter(|&&point| from_points.index(point).is_none()).count(),
            new_voxels: outcome.committed.map_or(0, |committed| committed.added),
            carved_voxels: outcome.committed.map_or(0, |committed| committed.removed),
            voxels: self.map.voxels(0),
            false_positive_rate,
            align_time: outcome.located.align_time,
            insert_time: outcome.insert_time,
            recovered: outcome.located.recovered,
            alignment: outcome.located.alignment,
        })
    }

    /// The largest of the levels' expected false positive rates, as the filters are filled now.
    pub fn false_positive_rate(&self) -> f64 {
        let view = self.map.view();
        let of_level = |level| {
            let (mut voxels, mut expected) = (0.0, 0.0);
            for filter in view.lists(level).filter_map(|list| list.filter()) {
                voxels += filter.len() as f64;
                expected += filter.expected_rate() * filter.len() as f64;
            }
            if voxels > 0.0 { expected / voxels } else { 0.0 }
        };
        (0..self.map.settings().levels).map(of_level).fold(0.0, f64::max)
    }
}
