//! Scans into a map, one after the other.

use std::time::{Duration, Instant};

use crate::align::{Alignment, AlignmentSettings, Guess, Verdict, align, judge_at};
use crate::cli::error::CliError;
use crate::geometry::{Point, Pose, extrapolate};
use crate::map::{Lookup, MapSettings, MultiResolutionMap, RobotName, ScanRecord, TrajectoryPose};

/// Whose scans they are, in the map's trajectory.
const ROBOT: &str = "mrol";

/// A map that grows scan by scan.
pub(in crate::cli) struct Mapper {
    map: MultiResolutionMap,
    settings: AlignmentSettings,
    robot: RobotName,
    /// The last accepted pose, the paper's guess.
    last: Pose,
    /// The one before it.
    before: Option<Pose>,
    guess: Guess,
}

/// What became of a scan.
pub(in crate::cli) struct Mapped {
    pub(in crate::cli) alignment: Alignment,
    /// Finest voxels that it added.
    pub(in crate::cli) new_voxels: usize,
    /// Finest voxels after it.
    pub(in crate::cli) voxels: usize,
    /// What the filters were expected to let through while it was aligned.
    pub(in crate::cli) false_positive_rate: f64,
    pub(in crate::cli) align_time: Duration,
    pub(in crate::cli) insert_time: Duration,
}

impl Mapped {
    pub(in crate::cli) fn accepted(&self) -> bool {
        self.alignment.verdict == Verdict::Accepted
    }
}

impl Mapper {
    pub(in crate::cli) fn new(
        map: MapSettings,
        settings: AlignmentSettings,
        guess: Guess,
    ) -> Result<Self, CliError> {
        Ok(Self {
            map: MultiResolutionMap::new(map).map_err(CliError::usage)?,
            settings,
            robot: RobotName::new(ROBOT).map_err(CliError::failed)?,
            last: Pose::identity(),
            before: None,
            guess,
        })
    }

    pub(in crate::cli) fn map(&self) -> &MultiResolutionMap {
        &self.map
    }

    /// True when the alignment asks the filters alone.
    pub(in crate::cli) fn asks_filters(&self) -> bool {
        self.settings.lookup == Lookup::Bloom
    }

    /// Aligns scan `k` to the map, or takes `known` as its pose, and adds it where it fits.
    ///
    /// # Errors
    /// When no point of it lies within the map's range.
    pub(in crate::cli) fn add(
        &mut self,
        k: usize,
        points: &[Point],
        known: Option<Pose>,
    ) -> Result<Mapped, String> {
        let false_positive_rate = if self.asks_filters() { self.false_positive_rate() } else { 0.0 };
        let start = Instant::now();
        let alignment = self.place(points, known);
        let align_time = start.elapsed();

        let start = Instant::now();
        let accepted = alignment.verdict == Verdict::Accepted;
        let new_voxels = if accepted { self.commit(k, points, &alignment)? } else { 0 };
        let insert_time = start.elapsed();
        let voxels = self.map.voxels(0);
        Ok(Mapped { alignment, new_voxels, voxels, false_positive_rate, align_time, insert_time })
    }

    fn place(&self, points: &[Point], known: Option<Pose>) -> Alignment {
        let next = match (&self.guess, &self.before) {
            (Guess::ConstantVelocity, Some(before)) => extrapolate(before, &self.last, 1.0),
            _ => self.last,
        };
        let guess = known.unwrap_or(next);
        if self.map.is_empty() || known.is_some() {
            // Nothing to align to, or nothing to find out.
            return judge_at(&self.map, points, &guess, &self.settings).on_the_callers_word();
        }
        align(&self.map, points, &guess, &self.settings)
    }

    /// Adds a scan where it was found to be; the number of new voxels.
    fn commit(&mut self, k: usize, points: &[Point], alignment: &Alignment) -> Result<usize, String> {
        let map_from_sensor = alignment.map_from_sensor;
        let pose = TrajectoryPose {
            robot: self.robot.clone(),
            scan_id: Some(k as u64),
            timestamp_ns: None,
            map_from_sensor,
            revision: 0,
            level_overlaps: alignment.level_overlaps.clone(),
            iterations: alignment.iterations,
            points_skipped: 0,
            new_voxels: 0,
            digest: 0,
        };
        let record = ScanRecord::of_points(pose, points, self.map.lattice());
        if record.voxels.is_empty() {
            let (min_m, end_m) = self.map.lattice().range_m();
            return Err(format!("no point of the scan lies within the map's range of {min_m} to {end_m} m"));
        }
        self.before = (!self.map.is_empty()).then_some(self.last);
        self.last = map_from_sensor;
        Ok(self.map.committer().insert_scan(record).voxels)
    }

    /// The largest of the levels' expected false positive rates, as the filters are filled now.
    pub(in crate::cli) fn false_positive_rate(&self) -> f64 {
        let view = self.map.view();
        let of_level = |level| {
            let (mut voxels, mut expected) = (0.0, 0.0);
            for list in view.lists(level) {
                let filter = list.filter();
                voxels += filter.len() as f64;
                expected += filter.expected_rate() * filter.len() as f64;
            }
            if voxels > 0.0 { expected / voxels } else { 0.0 }
        };
        (0..self.map.settings().levels).map(of_level).fold(0.0, f64::max)
    }
}
