//! A simulated robot: moves along its tour, scans, and streams its scans.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use mrol::console::CliError;
use mrol_client::{Client, new_session};
use mrol_map::geometry::{Pose, pose_difference};
use mrol_map::map::{MapName, RobotName};
use mrol_map::mapping::Guess;
use mrol_service::{ScanAnswer, ScanRequest};
use mrol_simulate::{Scene, Sensor, Tour};

/// Scans ray-cast ahead of the one that is being sent.
const SCANS_AHEAD: usize = 2;

pub(super) struct Robot {
    tour: Tour,
    scene: Arc<Scene>,
    /// Random generator of the sensor's noise.
    rng: ChaCha8Rng,
}

/// The answer to a robot's scan.
pub(super) struct News {
    pub(super) robot: &'static str,
    /// Number of the scan, from 1.
    pub(super) scan: usize,
    pub(super) scans: usize,
    pub(super) answer: ScanAnswer,
    /// The error of the pose found against the true one, meters and degrees.
    pub(super) error: (f64, f64),
}

impl Robot {
    /// The robot of a tour, whose noise is stream `stream` of `seed`.
    pub(super) fn new(tour: Tour, scene: Arc<Scene>, seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self { tour, scene, rng }
    }

    pub(super) fn name(&self) -> &'static str {
        self.tour.name
    }

    pub(super) fn scans(&self) -> usize {
        self.tour.poses.len()
    }

    /// Description of the robot's sensor.
    pub(super) fn sensor(&self) -> String {
        match &self.tour.sensor {
            Sensor::DepthCamera(camera) => {
                let (width, height) = (camera.width_px, camera.height_px);
                format!("depth camera, {width} x {height} points, {} m", camera.range_max_m)
            }
            Sensor::SpinningLidar(lidar) => {
                let (rings, azimuths) = (lidar.rings, lidar.azimuths);
                format!("spinning lidar, {rings} x {azimuths} points, {} m", lidar.range_max_m)
            }
        }
    }

    /// Streams a scan from each pose of the tour; sends each answer to `news`.
    pub(super) async fn tour(
        self,
        client: Client,
        map: MapName,
        news: mpsc::Sender<News>,
    ) -> Result<(), CliError> {
        let (robot, true_poses) = (self.name(), self.tour.poses.clone());
        let name = RobotName::new(robot).map_err(CliError::failed)?;
        let (sender, scans) = mpsc::channel(SCANS_AHEAD);
        let looking = tokio::task::spawn_blocking(move || self.look_around(&name, &sender));
        let mut answers = client.insert_scans(&map, ReceiverStream::new(scans)).await?;
        for (k, true_pose) in true_poses.iter().enumerate() {
            let answer = answers.next().await.ok_or_else(|| {
                CliError::failed(format!("the daemon answered {k} of {} scans of {robot}", true_poses.len()))
            })??;
            let error = pose_difference(true_pose, &answer.map_from_sensor);
            let scans = true_poses.len();
            if news.send(News { robot, scan: k + 1, scans, answer, error }).await.is_err() {
                break;
            }
        }
        looking.await.map_err(CliError::failed)
    }

    /// Ray-casts scan after scan, until the receiver is closed.
    fn look_around(mut self, name: &RobotName, sender: &mpsc::Sender<ScanRequest>) {
        let session = new_session();
        for (k, pose) in self.tour.poses.iter().enumerate() {
            let points = self.tour.sensor.scan(&self.scene, pose, &mut self.rng);
            let scan = ScanRequest {
                session: session.clone(),
                scan_id: Some(k as u64),
                guess: guess(k, pose),
                at_guess: k == 0,
                ..ScanRequest::new(name.clone(), points.into())
            };
            if sender.blocking_send(scan).is_err() {
                return;
            }
        }
    }
}

/// The guess of scan `k`: the true pose for the first one; from there on the last pose in the map, without odometry.
fn guess(k: usize, true_pose: &Pose) -> Guess {
    if k == 0 { Guess::Pose(*true_pose) } else { Guess::Last }
}
