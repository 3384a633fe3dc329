//! The explorer: a robot that goes to the nearest frontier, over and over.

use super::standing::SENSOR_HEIGHT_M;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::standing::{body, own_place, pose_at};
use super::ways::{Grid, Places};
use mrol_client::{Client, ClientError, new_session};
use mrol_map::geometry::Pose;
use mrol_map::map::{MapName, Region, RobotName, SessionName};
use mrol_map::mapping::Guess;
use mrol_map::planning::{Body, Frontier, Surroundings, Unknown};
use mrol_service::{
    CheckAs, FrontierQuestion, MotionCheck, PoseCheck, QuestionScope, ScanAnswer, ScanRequest,
};
use mrol_simulate::{Scene, SpinningLidar};

/// Level of the voxels that are asked about: 10 cm in a map of 5 cm.
const LEVEL: u32 = 1;
/// Level of the voxels of frontiers: 20 cm.
const FRONTIER_LEVEL: u32 = 2;
/// Voxels of a frontier that is worth a way.
const FRONTIER_SIZE_MIN: u64 = 12;
/// Heights in which frontiers are looked for, meters.
const FRONTIER_HEIGHTS_M: [f64; 2] = [0.2, 2.2];
/// How far around the places where the robot was it looks for ways and frontiers, meters.
const AROUND_M: f64 = 8.0;
/// How far it drives between two scans, meters.
const SCAN_EVERY_M: f64 = 0.6;
/// A frontier within this of as many visited ones as there may be visits is given up, meters: it stays, whatever the
/// robot does.
const GIVEN_UP_M: f64 = 0.5;
const VISITS_MAX: usize = 6;
/// Half the side of the place where the robot begins, which it knows to be free since it stands there, meters.
const OWN_PLACE_M: f64 = 0.8;
/// What a way costs where it cannot keep its room, against others.
const COST_WITHOUT_ROOM: f64 = 4.0;
/// How far from what it knows to be there it keeps, meters.
const ROOM_M: f32 = 0.1;

/// A robot that explores.
pub(crate) struct Explorer {
    pub(super) client: Client,
    pub(super) map: MapName,
    robot: RobotName,
    session: SessionName,
    scene: Arc<Scene>,
    lidar: SpinningLidar,
    random: ChaCha8Rng,
    body: Arc<Body>,
    /// The body with the room that it keeps.
    wide_body: Arc<Body>,
    /// Where the sensor is, and where the server found it.
    pub(super) truth: Pose,
    pub(super) believed: Pose,
    scans: u64,
    /// Where it looked around.
    pub(super) looked: Vec<[f64; 2]>,
    /// The middles of the frontiers that it went to see.
    pub(super) visited: Vec<[f64; 3]>,
    /// Places of the sensor as they really were, one after the other.
    path: Vec<[f64; 3]>,
}

impl Explorer {
    /// An explorer of `scene` that stands at x and y (meters), sees nothing yet, and maps into `map` on the server of
    /// `client`.
    ///
    /// # Errors
    /// For a name that is none.
    pub(crate) fn new(
        client: Client,
        map: MapName,
        scene: Arc<Scene>,
        [x, y]: [f64; 2],
        seed: u64,
    ) -> Result<Self, mrol_map::map::NameError> {
        let start = pose_at([x, y]);
        Ok(Self {
            client,
            map,
            robot: RobotName::new("explorer")?,
            session: new_session(),
            scene,
            lidar: Self::lidar(),
            random: ChaCha8Rng::seed_from_u64(seed),
            body: Arc::new(body(0.0)),
            wide_body: Arc::new(body(ROOM_M)),
            truth: start,
            believed: start,
            scans: 0,
            visited: Vec::new(),
            looked: Vec::new(),
            path: vec![start.translation.vector.into()],
        })
    }

    /// Its sensor: 64 rings, 50 degrees up and down, so that it sees where it drives.
    pub(crate) fn lidar() -> SpinningLidar {
        SpinningLidar {
            rings: 64,
            azimuths: 600,
            elevation_max_deg: 50.0,
            range_min_m: 0.3,
            ..SpinningLidar::default()
        }
    }

    /// The places where its sensor really was, one after the other, a step of the way each.
    pub(crate) fn path(&self) -> &[[f64; 3]] {
        &self.path
    }

    /// Scans that it sent.
    pub(crate) fn scans(&self) -> u64 {
        self.scans
    }

    /// Looks around from where it stands, and sends the scan.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub(crate) async fn look(&mut self) -> Result<ScanAnswer, ClientError> {
        let points = self.lidar.scan(&self.scene, &self.truth, &mut self.random);
        let scan = ScanRequest {
            session: self.session.clone(),
            scan_id: Some(self.scans),
            guess: Guess::Pose(self.believed),
            at_guess: self.scans == 0,
            ..ScanRequest::new(self.robot.clone(), points.into())
        };
        self.scans += 1;
        self.looked.push(self.place());
        let answer = self.client.insert_scan(&self.map, scan).await?;
        if answer.accepted {
            self.believed = answer.map_from_sensor;
        }
        Ok(answer)
    }

    /// The part of the map around the places where the robot was: the smallest and the largest x and y, meters.
    fn around(&self) -> [[f64; 2]; 2] {
        let ends = |axis: usize| {
            let along = self.path.iter().map(|place| place[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)))
        };
        let ((x_min, x_max), (y_min, y_max)) = (ends(0), ends(1));
        [[x_min - AROUND_M, y_min - AROUND_M], [x_max + AROUND_M, y_max + AROUND_M]]
    }

    /// The frontiers that were not given up.
    pub(super) async fn frontiers(&self) -> Result<Vec<Frontier>, ClientError> {
        let [[x_min, y_min], [x_max, y_max]] = self.around();
        let [z_min, z_max] = FRONTIER_HEIGHTS_M;
        let question = FrontierQuestion {
            asked: QuestionScope { level: FRONTIER_LEVEL, ..QuestionScope::default() },
            min_m: [x_min, y_min, z_min],
            max_m: [x_max, y_max, z_max],
            size_min: Some(FRONTIER_SIZE_MIN),
            frontiers_max: None,
            standoff_m: Some(1.5),
        };
        let told = self.client.list_frontiers(&self.map, question).await?.answer.frontiers;
        let is_new = |frontier: &Frontier| {
            let near = self.visited.iter().filter(|place| distance(place, &frontier.center_m) <= GIVEN_UP_M);
            near.count() < VISITS_MAX
        };
        Ok(told.into_iter().filter(is_new).collect())
    }

    /// The places where the robot's body fits.
    pub(super) async fn places_that_fit(&self) -> Result<Places, ClientError> {
        let grid = Grid::around(self.around());
        let places: Vec<[f64; 2]> = grid.places().collect();
        let mut costs = vec![1.0; places.len()];
        let [known, unknown] = self.surroundings();
        // It keeps away from what is known to be there where it can, since the next scan may find it a voxel nearer.
        let checks = [
            (known.clone(), &self.wide_body, COST_WITHOUT_ROOM),
            (unknown.clone(), &self.wide_body, COST_WITHOUT_ROOM),
            (known, &self.body, f64::INFINITY),
            (unknown, &self.body, f64::INFINITY),
        ];
        for (surroundings, body, cost) in checks {
            let check = PoseCheck {
                asked: QuestionScope { level: LEVEL, ..QuestionScope::default() },
                body: Arc::clone(body),
                configurations: configurations(&places),
                surroundings,
                answer: CheckAs::Colliding,
            };
            let words = self.client.check_poses(&self.map, check).await?.answer.words();
            let meets = |number: usize| words[number / 64] >> (number % 64) & 1 == 1;
            (0..places.len()).filter(|&number| meets(number)).for_each(|number| costs[number] = cost);
        }
        Ok(Places { grid, costs })
    }

    /// Where the body first meets something along a way from where the robot is, as a share of it; none on a free one.
    pub(super) async fn first_hit(&self, way: &[[f64; 2]]) -> Result<Option<f64>, ClientError> {
        if way.len() < 2 {
            return Ok(None);
        }
        let mut first_hit: Option<f32> = None;
        for surroundings in self.surroundings() {
            let check = MotionCheck {
                asked: QuestionScope { level: LEVEL, ..QuestionScope::default() },
                body: Arc::clone(&self.body),
                configurations: configurations(way),
                lengths: vec![way.len() as u32],
                step_m: None,
                clearance_max_m: None,
                surroundings,
            };
            let answers = self.client.check_motions(&self.map, check).await?.answer;
            let hit = answers.first().and_then(|answer| answer.first_hit);
            first_hit = first_hit.into_iter().chain(hit).reduce(f32::min);
        }
        Ok(first_hit.map(f64::from))
    }

    /// Drives along a way; the answer to the scan at its end.
    pub(super) async fn drive(&mut self, way: &[[f64; 2]]) -> Result<ScanAnswer, ClientError> {
        let mut since_scan_m = 0.0;
        for &place in way.iter().skip(1) {
            // What it believes to have driven it has driven.
            let [x, y] = self.place();
            let motion = nalgebra::Translation3::new(place[0] - x, place[1] - y, 0.0);
            (self.truth, self.believed) = (motion * self.truth, motion * self.believed);
            self.path.push(self.truth.translation.vector.into());
            since_scan_m += motion.vector.norm();
            if since_scan_m >= SCAN_EVERY_M {
                since_scan_m = 0.0;
                self.look().await?;
            }
        }
        self.look().await
    }

    pub(super) fn place(&self) -> [f64; 2] {
        let [x, y, _]: [f64; 3] = self.believed.translation.vector.into();
        [x, y]
    }

    /// What the body must not meet: what is known to be there; and what is not known, but where the robot began and
    /// where it stands now, which it knows to be free since it stands there.
    fn surroundings(&self) -> [Surroundings; 2] {
        let [x, y, _] = self.path[0];
        let start = Region::Box {
            min_m: [x - OWN_PLACE_M, y - OWN_PLACE_M, 0.0],
            max_m: [x + OWN_PLACE_M, y + OWN_PLACE_M, SENSOR_HEIGHT_M + OWN_PLACE_M],
        };
        let here = own_place(self.place());
        let known = Surroundings { ignored: here.to_vec(), unknown: Unknown::Free };
        let ignored = here.into_iter().chain([start]).collect();
        [known, Surroundings { ignored, unknown: Unknown::Occupied }]
    }
}

/// Poses of the body that stands at each place.
fn configurations(places: &[[f64; 2]]) -> Vec<f32> {
    places.iter().flat_map(|&[x, y]| [x as f32, y as f32, 0.0, 0.0, 0.0, 0.0, 1.0]).collect()
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}
