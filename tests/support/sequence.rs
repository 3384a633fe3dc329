//! A simulated sequence in files.

use mrol::geometry::{Pose, rotation_xyzw, translation_m};
use mrol::scan::{StampedPose, write_ply, write_trajectory};
use mrol_simulate::{Scene, tours};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A simulated sequence in files: scans and true poses.
pub struct Sequence {
    pub folder: tempfile::TempDir,
    pub poses: Vec<Pose>,
}

impl Sequence {
    /// What the camera of the simulated building sees from the first `scans` places of its tour.
    pub fn of(scans: usize) -> Self {
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
    pub fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// The pose of the first scan, as an option takes it.
    pub fn first_pose(&self) -> String {
        let (t, q) = (translation_m(&self.poses[0]), rotation_xyzw(&self.poses[0]));
        t.iter().chain(&q).map(ToString::to_string).collect::<Vec<_>>().join(" ")
    }
}
