//! The command line as a process: what it prints, which files it writes, and its exit codes.
#![cfg(feature = "server")]
#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

mod bench;
mod demo;
mod doctor;
mod errors;
mod experiment;
mod help;
mod local;
mod localize;
mod questions;
mod remote;
#[path = "../support/mod.rs"]
mod support;

use assert_cmd::Command;
use mrol::geometry::{Pose, rotation_xyzw, translation_m};
use mrol::lab::simulate::{Scene, tours};
use mrol::scan::{StampedPose, write_ply, write_trajectory};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// A call of the program, away from the caller's settings.
fn mrol(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mrol"));
    for name in ["MROL_SERVER", "MROL_CONFIG", "MROL_KEY", "MROL_KEY_FILE", "MROL_CA"] {
        command.env_remove(name);
    }
    command.args(arguments);
    command
}

/// The objects that a call prints, which must succeed.
fn objects(arguments: &[&str]) -> Vec<Value> {
    let output = mrol(arguments).arg("--json").assert().success().get_output().clone();
    let lines = String::from_utf8(output.stdout).unwrap();
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// A number of a printed object.
fn number(line: &Value, field: &str) -> f64 {
    line[field].as_f64().unwrap_or_else(|| panic!("{field} in {line}"))
}

/// A text of each of them.
fn texts<'a>(lines: &'a [Value], field: &str) -> Vec<&'a str> {
    lines.iter().map(|line| line[field].as_str().unwrap()).collect()
}

/// What a call says on standard error, which must end with `code`.
fn complaint(arguments: &[&str], code: i32) -> String {
    let output = mrol(arguments).assert().code(code).get_output().clone();
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert!(complaint.starts_with("error: "), "{arguments:?}: {complaint}");
    assert!(!complaint.contains("panicked"), "{complaint}");
    complaint
}

/// A simulated sequence in files: scans and true poses.
struct Sequence {
    folder: tempfile::TempDir,
    poses: Vec<Pose>,
}

impl Sequence {
    /// What the camera of the simulated building sees from the first `scans` places of its tour.
    fn of(scans: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scene = Scene::furnished(1);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let [_, tour] = tours(scans);
        std::fs::create_dir(folder.path().join("scans")).unwrap();
        for (k, pose) in tour.poses.iter().enumerate() {
            let points = tour.sensor.scan(&scene, pose, &mut rng);
            write_ply(&folder.path().join(format!("scans/{k:04}.ply")), &points).unwrap();
        }
        let stamped = |(k, pose): (i32, &Pose)| StampedPose { id: k.into(), map_from_sensor: *pose };
        let truth: Vec<_> = (0..).zip(&tour.poses).map(stamped).collect();
        write_trajectory(&folder.path().join("poses.txt"), &truth).unwrap();
        Self { folder, poses: tour.poses }
    }

    /// The path of something in the sequence's folder.
    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// The pose of the first scan, as an option takes it.
    fn first_pose(&self) -> String {
        let (t, q) = (translation_m(&self.poses[0]), rotation_xyzw(&self.poses[0]));
        t.iter().chain(&q).map(ToString::to_string).collect::<Vec<_>>().join(" ")
    }
}
