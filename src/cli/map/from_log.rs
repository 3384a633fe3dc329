//! `mrol map` of a robot's log.

use std::path::{Path, PathBuf};

use super::command::Map;
use super::run::{KnownPoses, Run, Usable, in_file};
use crate::cli::alignment_options::GuessName;
use crate::cli::log::{LogFile, name_of_stamp};
use mrol::console::{CliError, Output, Survey};
use mrol::offline::KnownScan;
use mrol_logs::sequence::{LoggedScan, Odometer};
use mrol_map::align::AlignmentSettings;
use mrol_map::mapping::Guess;
use mrol_map::scan::{PointFilter, UnitDoubt};

/// Characters of a scan's name: a stamp of this century, in milliseconds.
const NAME_WIDTH: usize = 14;

impl Map {
    /// Maps the clouds of a log.
    pub(super) fn run_log(
        &self,
        path: &Path,
        alignment: AlignmentSettings,
        filter: PointFilter,
        output: Output,
    ) -> Result<(), CliError> {
        self.refuse_options_of_files()?;
        let inputs: Vec<PathBuf> = match std::fs::read_dir(path) {
            Ok(entries) => entries.flatten().map(|entry| entry.path()).collect(),
            Err(_) => vec![path.to_owned()],
        };
        self.check_outputs(inputs.iter().map(PathBuf::as_path))?;
        let (log, mut scans) = LogFile::open(path, &self.log, &output)?;
        let settings = self.map_settings();
        let guess = self.guess.unwrap_or(GuessName::ConstantVelocity);
        let mut mapper = self.mapper(settings, alignment, guess)?;
        let survey = Survey::of(&[], None, false, settings.resolution_m);
        let known = KnownPoses { first: self.first_pose, ..KnownPoses::default() };
        let mut run = Run::new(known, survey, NAME_WIDTH);
        let mut odometer = Odometer::default();
        let output = output.with_bar_of_bytes(log.bytes);
        output.say(run.head())?;
        let mut k = 0;
        while let Some((mut scan, position)) = scans.next(&output)? {
            let name = name_of_stamp(scan.stamp_ns);
            let points = std::mem::take(&mut scan.points);
            if k == 0 {
                let doubt = UnitDoubt::of(points.iter().map(|point| point.to_f64()));
                doubt.into_iter().for_each(|doubt| output.note(format!("{}: {doubt}", path.display())));
            }
            match Usable::of(points, scan.times_s.take(), &filter) {
                Usable::Points { points, times_s, skipped } => {
                    let is_first = run.trajectory.is_empty();
                    let told = run.guess(k);
                    let first = || if is_first { self.first_guess(&scan) } else { None };
                    let known = KnownScan {
                        timestamp_ns: Some(scan.stamp_ns),
                        times_s: times_s.as_deref(),
                        // A robot that drives accelerates, which is no direction of gravity.
                        gravity: scan.gravity.filter(|_| is_first),
                        guess: told.map(Guess::Pose).or_else(|| odometer.guess(&scan)).or_else(first),
                        at_guess: told.is_some(),
                        ..KnownScan::new(k as u64, &points)
                    };
                    let mapped =
                        mapper.add_known(known).map_err(|e| in_file(path, format!("{name}: {e}")))?;
                    if mapped.accepted() {
                        odometer.accepted(&scan);
                    }
                    let id = scan.stamp_ns as f64 * 1e-9;
                    output.print(&run.note((k, id), name, &mapped, skipped))?;
                }
                Usable::Nothing(why) => output.print(&run.skip(path, name, why))?,
            }
            k += 1;
            output.advance_to(position);
        }
        if k == 0 {
            return Err(in_file(path, "no cloud of the log is taken: see the notes above, and --from, --to"));
        }
        self.finish(&mapper, run, &output)
    }

    /// Where the first scan was taken by the odometry, in whose frame the map then lies; none where options say it.
    fn first_guess(&self, scan: &LoggedScan) -> Option<Guess> {
        let is_told = self.axes.is_some() || self.sensor_height.is_some();
        scan.first_pose().filter(|_| !is_told).map(Guess::Pose)
    }

    fn refuse_options_of_files(&self) -> Result<(), CliError> {
        let given =
            [("--truth and --poses", self.poses_file().is_some()), ("--origin", self.origin.is_some())];
        match given.into_iter().chain(self.scan_files.given()).find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(CliError::usage(format!("{option}: for scan files, not for a log"))),
            None => Ok(()),
        }
    }
}
