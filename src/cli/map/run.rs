//! What a run of `mrol map` has done so far.

use std::path::Path;
use std::time::Instant;

use super::report::{ScanLine, SkippedLine, Summary};
use mrol::console::{CliError, Survey};
use mrol::offline::{FalsePositives, Mapped, Mapper, TruthErrors};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::Lookup;
use mrol_map::scan::{PointFilter, SkippedPoints, StampedPose};

/// The poses that are known before a run: map_from_sensor.
#[derive(Default)]
pub(super) struct KnownPoses {
    /// That of the first scan.
    pub(super) first: Option<Pose>,
    /// Those of all scans.
    pub(super) truth: Option<Vec<Pose>>,
    /// Scans are put at these.
    pub(super) at_truth: bool,
}

/// State of a run.
pub(super) struct Run {
    survey: Survey,
    first_pose: Option<Pose>,
    at_truth: bool,
    truth: Option<TruthErrors>,
    pub(super) trajectory: Vec<StampedPose>,
    /// Scans that were mapped or refused.
    scans: usize,
    /// Scans that had no point to map, and why the first of them had none.
    skipped: usize,
    first_skipped: Option<CliError>,
    false_positives: FalsePositives,
    name_width: usize,
    start: Instant,
}

impl Run {
    /// A run of scans whose names have so many characters.
    pub(super) fn new(known: KnownPoses, survey: Survey, name_width: usize) -> Self {
        let to_map = |pose: Pose| survey.to_map(&pose);
        let truth = known.truth.map(|poses| poses.into_iter().map(to_map).collect());
        Self {
            survey,
            first_pose: known.first.map(to_map),
            at_truth: known.at_truth,
            truth: truth.map(TruthErrors::new),
            trajectory: Vec::new(),
            scans: 0,
            skipped: 0,
            first_skipped: None,
            false_positives: FalsePositives::default(),
            name_width,
            start: Instant::now(),
        }
    }

    pub(super) fn head(&self) -> String {
        ScanLine::head(self.name_width, self.truth.is_some())
    }

    /// Known pose of scan `k`, map_from_sensor, if there is one.
    pub(super) fn guess(&self, k: usize) -> Option<Pose> {
        let truth = self.truth.as_ref().filter(|_| self.at_truth);
        truth.map(|truth| truth.pose(k)).or(self.first_pose.filter(|_| self.scans == 0))
    }

    /// Records a scan that has no point to map; returns its line.
    pub(super) fn skip(&mut self, file: &Path, scan: String, why: String) -> SkippedLine {
        self.skipped += 1;
        self.first_skipped.get_or_insert_with(|| in_file(file, &why));
        SkippedLine::of(scan, why, self.name_width)
    }

    /// Refuses a run in which no scan had a point to map: there is no map to write.
    pub(super) fn check_any(&mut self) -> Result<(), CliError> {
        match self.first_skipped.take().filter(|_| self.scans == 0) {
            Some(why) => Err(why),
            None => Ok(()),
        }
    }

    /// Records the result of scan `k`, which the trajectory calls `id`; returns its line.
    pub(super) fn note(
        &mut self,
        (k, id): (usize, f64),
        scan: String,
        mapped: &Mapped,
        skipped: SkippedPoints,
    ) -> ScanLine {
        self.scans += 1;
        self.false_positives.add(mapped.alignment.lookups, mapped.false_positive_rate);
        let map_from_sensor = mapped.alignment.map_from_sensor;
        let accepted = mapped.accepted();
        if accepted {
            let map_from_sensor = self.survey.to_survey(&map_from_sensor);
            self.trajectory.push(StampedPose { id, map_from_sensor });
        }
        let error = self.truth.as_mut().filter(|_| accepted).map(|truth| truth.add(k, &map_from_sensor));
        let skipped = SkippedPoints { beyond_map: mapped.beyond_map, ..skipped };
        ScanLine::of(scan, mapped, &skipped, error, self.name_width)
    }

    /// The summary of the run; that of the filters where somebody asked them by name.
    pub(super) fn summary(&self, mapper: &Mapper, asked: Option<Lookup>) -> Summary {
        Summary {
            scans: self.scans + self.skipped,
            accepted: self.trajectory.len(),
            refused: self.scans - self.trajectory.len(),
            skipped: self.skipped,
            voxels: mapper.map().voxels(0),
            resolution_m: mapper.map().settings().resolution_m,
            levels: mapper.map().settings().levels,
            seconds: self.start.elapsed().as_secs_f64(),
            error: self.truth.as_ref().and_then(TruthErrors::summary),
            filter: (asked.is_some() && mapper.asks_filters())
                .then(|| self.false_positives.summary(mapper.false_positive_rate())),
        }
    }
}

/// What a scan file has for the map.
pub(super) enum Usable {
    /// Points that pass the filter, when they were measured, and how many do not pass.
    Points { points: Vec<Point>, times_s: Option<Vec<f32>>, skipped: SkippedPoints },
    /// No point that passes, for this reason.
    Nothing(String),
}

impl Usable {
    /// Those of the points of a scan that pass the filter, with their times where there are some.
    pub(super) fn of(mut points: Vec<Point>, times_s: Option<Vec<f32>>, filter: &PointFilter) -> Self {
        let skipped = SkippedPoints::of(&points, filter);
        let times_s = times_s.map(|times_s| {
            let kept = times_s.iter().zip(&points).filter(|(_, point)| filter.keeps(**point));
            kept.map(|(time_s, _)| *time_s).collect()
        });
        points.retain(|&point| filter.keeps(point));
        match (skipped.points, points.is_empty()) {
            (0, _) => Self::Nothing("no point in this file".to_owned()),
            (all, true) if skipped.not_finite + skipped.zeros == all => Self::Nothing(format!(
                "none of its {all} points is a return ({skipped}); --keep-zeros keeps those at 0 0 0"
            )),
            (_, true) => Self::Nothing(format!(
                "none of its points passes --range-min, --range-max and --body ({skipped})"
            )),
            _ => Self::Points { points, times_s, skipped },
        }
    }
}

pub(super) fn in_file(file: &Path, problem: impl std::fmt::Display) -> CliError {
    CliError::failed(format!("{}: {problem}", file.display()))
}
