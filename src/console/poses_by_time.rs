//! Poses by time: of scans that are named by times, between the lines of a file that are times too, as the RGB-D sets
//! of TUM have them.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::output::Output;
use mrol_map::geometry::{Pose, Twist};
use mrol_map::scan::StampedPose;

/// Numbers of scans, and not times: below this, and whole.
const NUMBER_MAX: f64 = 1e6;
/// How far apart in time two lines may be that a pose is taken between.
const APART_MAX_S: f64 = 0.2;
/// Times beyond this are no seconds since 1970: the year 5138.
const TIME_MAX_S: f64 = 1e11;
/// Digits of a number in a name that is a time: seconds since 1970 have ten.
const TIME_DIGITS: usize = 9;

/// What the name of a scan says.
#[derive(Debug, Clone, Copy, PartialEq)]
enum NameOfScan {
    /// A whole number.
    Number,
    /// A time, seconds.
    Time(f64),
    /// Something with digits in it as a time has.
    LikeTime,
    Other,
}

impl NameOfScan {
    fn of(file: &Path) -> Self {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let is_digits = stem.bytes().all(|byte| byte.is_ascii_digit());
        match stem.parse::<f64>().ok().filter(|number| number.is_finite()) {
            Some(number) if is_digits && number < NUMBER_MAX => Self::Number,
            Some(time_s) => Self::Time(time_s),
            None if stem.split(|c: char| !c.is_ascii_digit()).any(|digits| digits.len() >= TIME_DIGITS) => {
                Self::LikeTime
            }
            None => Self::Other,
        }
    }
}

/// The times that scans are named by, seconds; none where they are numbered or named otherwise.
///
/// # Errors
/// Names a file that is no time among times.
pub(super) fn times_of(files: &[PathBuf]) -> Result<Option<Vec<f64>>, &Path> {
    let names: Vec<NameOfScan> = files.iter().map(|file| NameOfScan::of(file)).collect();
    if !names.iter().any(|name| matches!(name, NameOfScan::Time(_) | NameOfScan::LikeTime)) {
        return Ok(None);
    }
    let times = files.iter().zip(names).map(|(file, name)| match name {
        NameOfScan::Time(time_s) => Ok(time_s),
        _ => Err(file.as_path()),
    });
    times.collect::<Result<_, _>>().map(Some)
}

/// True of lines that are numbered, as those of a trajectory of this program.
pub(super) fn are_numbered(poses: &[StampedPose]) -> bool {
    poses.iter().all(|pose| pose.id.fract() == 0.0 && (0.0..NUMBER_MAX).contains(&pose.id))
}

/// The poses of scans that were taken at `times_s`, each between two lines.
pub(super) fn poses_at(
    path: &Path,
    mut stamped: Vec<StampedPose>,
    files: &[PathBuf],
    times_s: &[f64],
    output: &Output,
) -> Result<Vec<Pose>, CliError> {
    let named = path.display();
    let times = stamped.iter().map(|pose| pose.id).chain(times_s.iter().copied());
    if let Some(time) = times.into_iter().find(|time| time.abs() > TIME_MAX_S) {
        return Err(CliError::failed(format!(
            "{named}: lines and names of scans are taken as times in seconds, and one is {time}: is it in nanoseconds?"
        )));
    }
    stamped.sort_by(|a, b| a.id.total_cmp(&b.id));
    let is_twofold = |pair: &&[StampedPose]| {
        pair[0].id == pair[1].id && pair[0].map_from_sensor != pair[1].map_from_sensor
    };
    if let Some(pair) = stamped.windows(2).find(is_twofold) {
        return Err(CliError::failed(format!("{named}: two lines have different poses at {} s", pair[0].id)));
    }
    output.note(format!("{named}: the poses at the times that the scans are named by"));
    let pose = |(file, &time_s): (&PathBuf, &f64)| {
        between(&stamped, time_s).ok_or_else(|| {
            CliError::failed(format!(
                "{named}: no pose for {}: its name is the time {time_s} s, with no two lines around it that are at most \
                 {APART_MAX_S} s apart; leave it out",
                file.display()
            ))
        })
    };
    files.iter().zip(times_s).map(pose).collect()
}

/// The pose at a time between two lines, which are sorted by time.
fn between(sorted: &[StampedPose], time_s: f64) -> Option<Pose> {
    let after = sorted.partition_point(|pose| pose.id < time_s);
    let next = sorted.get(after)?;
    if next.id == time_s {
        return Some(next.map_from_sensor);
    }
    let last = &sorted[after.checked_sub(1)?];
    let (passed_s, apart_s) = (time_s - last.id, next.id - last.id);
    let is_near = apart_s <= APART_MAX_S;
    is_near.then(|| {
        let motion = Twist::of_motion(&last.map_from_sensor.inv_mul(&next.map_from_sensor), apart_s);
        last.map_from_sensor * motion.motion(passed_s)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_at_a_time_lies_between_two_lines_near_it() {
        let line = |id: f64, x: f64| StampedPose { id, map_from_sensor: Pose::translation(x, 0.0, 0.0) };
        let lines = [line(10.0, 0.0), line(10.1, 1.0), line(10.5, 2.0)];
        let x = |time_s| between(&lines, time_s).map(|pose| pose.translation.x);
        assert_eq!((x(10.0), x(10.1), x(10.5)), (Some(0.0), Some(1.0), Some(2.0)));
        assert!((x(10.025).unwrap() - 0.25).abs() < 1e-9);
        assert_eq!((x(9.9), x(10.3), x(10.6)), (None, None, None));
    }

    #[test]
    fn names_are_times_or_numbers_or_neither() {
        let files = |names: &[&str]| {
            names.iter().map(|name| PathBuf::from(format!("d/{name}.png"))).collect::<Vec<_>>()
        };
        let times = |names: &[&str]| times_of(&files(names)).map_err(Path::to_owned);
        assert_eq!(
            times(&["1305031102.160407", "1305031103"]),
            Ok(Some(vec![1_305_031_102.160_407, 1_305_031_103.0]))
        );
        assert_eq!(times(&["0.000000", "0.100000"]), Ok(Some(vec![0.0, 0.1])));
        for numbered in [&["7"][..], &["0000", "0001"], &["scan7", "a"], &["nan"], &[]] {
            assert_eq!(times(numbered), Ok(None), "{numbered:?}");
        }
        for (names, which) in [
            (&["10.05", "avg"][..], "avg"),
            (&["depth_1305031102.16"], "depth_1305031102.16"),
            (&["1305031102,16", "1305031102,26"], "1305031102,16"),
            (&["1305031102.16", "7"], "7"),
        ] {
            assert_eq!(times(names), Err(PathBuf::from(format!("d/{which}.png"))), "{names:?}");
        }
    }
}
