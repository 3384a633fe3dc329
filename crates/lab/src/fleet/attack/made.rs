//! What attackers ask and send.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fleet::error::FleetError;
use crate::fleet::robot::TURN_POINTS;
use crate::workload::bodies::cart;
use crate::workload::{Order, Room, Site, Workload};
use mrol_client::new_session;
use mrol_map::align::localize::LocalizationQuery;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::RobotName;
use mrol_map::mapping::Guess;
use mrol_map::planning::{BandFrom, GridArea, Surroundings, Unknown};
use mrol_service::{
    CheckAs, ClassifyQuestion, GridQuestion, GridScope, LocalizationRequest, MotionCheck, PointCloud,
    PoseCheck, QuestionScope, RayQuestion, RaysToward, ScanRequest,
};

/// Poses of a check, a controller's cycle.
const POSES: usize = 56_000;
/// Motions of a check.
const MOTIONS: usize = 4_000;
/// Length of a motion, meters.
const MOTION_M: f32 = 3.0;
/// Rays of a question.
const RAYS: usize = 200_000;
/// Length of a ray, meters.
const RANGE_M: f64 = 100.0;
/// Points that are classified at once.
const POINTS: usize = 500_000;
/// Of the points of a revolution, one in so many is in a scan.
const ONE_IN: usize = 3;
/// Points of a scan that no sensor saw.
const GARBAGE_POINTS: usize = 20_000;
/// Voxels of the place where lost robots are.
const SITE_VOXELS: usize = 100_000;
/// Points of a tiny scan.
const TINY_POINTS: usize = 8;
/// How far off a wrong guess is, meters along each axis: 0.8 m in all.
const WRONG_BY_M: f64 = 0.462;
/// Half of the room's sides, within which bodies and points are, meters.
const HALF_M: [f32; 3] = [6.5, 4.0, 1.3];

/// Questions and scans, made once and sent again and again.
pub(super) struct Made {
    pub(super) poses: PoseCheck,
    pub(super) motions: MotionCheck,
    pub(super) rays: RayQuestion,
    pub(super) points: ClassifyQuestion,
    pub(super) grid: GridQuestion,
    scan: PointCloud,
    elsewhere: PointCloud,
    garbage: PointCloud,
    tiny: PointCloud,
    map_from_scan: Pose,
}

impl Made {
    pub(super) fn new(seed: u64) -> Result<Self, FleetError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let seen = Workload::Room(Room).queries(Order::Scan, TURN_POINTS, seed);
        let site = Workload::Site(Site::of(SITE_VOXELS, seed)).queries(Order::Scan, TURN_POINTS, seed);
        let mut somewhere = |count: usize| (0..count).map(|_| anywhere(&mut random)).collect::<Vec<_>>();
        let [from, points, ends, garbage, tiny] =
            [MOTIONS, POINTS, RAYS, GARBAGE_POINTS, TINY_POINTS].map(&mut somewhere);
        let poses = somewhere(POSES).into_iter().flat_map(pose).collect();
        let motions = from.into_iter().flat_map(|from| [pose(from), pose(moved(from))]).flatten().collect();
        let asked = QuestionScope::default();
        let surroundings = || Surroundings::ALL_VOXELS;
        Ok(Self {
            poses: PoseCheck {
                asked,
                body: Arc::new(cart::footprint().map_err(FleetError::failed)?),
                configurations: poses,
                surroundings: surroundings(),
                answer: CheckAs::Colliding,
            },
            motions: MotionCheck {
                asked,
                body: Arc::new(cart::body().map_err(FleetError::failed)?),
                configurations: motions,
                lengths: vec![2; MOTIONS],
                step_m: None,
                clearance_max_m: None,
                surroundings: surroundings(),
            },
            rays: RayQuestion {
                asked,
                origins: cloud(vec![[0.0; 3]]),
                toward: RaysToward::Directions {
                    directions: cloud(ends.into_iter().map(unit).collect()),
                    range_m: RANGE_M,
                },
                unknown: Unknown::Free,
            },
            points: ClassifyQuestion { asked, points: cloud(points) },
            grid: GridQuestion {
                asked,
                scope: GridScope {
                    area: GridArea::Occupied,
                    band_m: [f64::NEG_INFINITY, f64::INFINITY],
                    band_from: BandFrom::Map,
                    cell_m: None,
                    tells_unknown: true,
                },
            },
            scan: few_of(seen.points),
            elsewhere: few_of(site.points),
            garbage: cloud(garbage),
            tiny: cloud(tiny),
            map_from_scan: seen.map_from_points,
        })
    }

    /// A scan of the room whose guess is so far off that its verdict takes long.
    pub(super) fn doubtful(&self, robot: RobotName) -> ScanRequest {
        let wrong = Pose::translation(WRONG_BY_M, WRONG_BY_M, WRONG_BY_M) * self.map_from_scan;
        ScanRequest { guess: Guess::Pose(wrong), ..ScanRequest::new(robot, self.scan.clone()) }
    }

    /// A scan of the room, at its pose.
    pub(super) fn placed(&self, robot: RobotName) -> ScanRequest {
        ScanRequest {
            guess: Guess::Pose(self.map_from_scan),
            session: new_session(),
            ..ScanRequest::new(robot, self.scan.clone())
        }
    }

    /// A scan of another place, whose robot wants to be looked for.
    pub(super) fn elsewhere(&self, robot: RobotName) -> ScanRequest {
        let guess = Guess::Pose(self.map_from_scan);
        ScanRequest { guess, recover: Some(true), ..ScanRequest::new(robot, self.elsewhere.clone()) }
    }

    /// Points that no sensor saw.
    pub(super) fn garbage(&self, robot: RobotName) -> ScanRequest {
        let guess = Guess::Pose(self.map_from_scan);
        ScanRequest { guess, ..ScanRequest::new(robot, self.garbage.clone()) }
    }

    /// A few points, taken as they are.
    pub(super) fn tiny(&self, robot: RobotName) -> ScanRequest {
        let guess = Guess::Pose(Pose::identity());
        ScanRequest { guess, at_guess: true, ..ScanRequest::new(robot, self.tiny.clone()) }
    }

    /// Where was this scan taken?
    pub(super) fn lost(&self) -> LocalizationRequest {
        LocalizationRequest {
            points: self.scan.clone(),
            query: LocalizationQuery::default(),
            time_limit: None,
        }
    }
}

/// A scan of some of a revolution's points.
fn few_of(revolution: Vec<Point>) -> PointCloud {
    revolution.into_iter().step_by(ONE_IN).collect::<Vec<_>>().into()
}

fn anywhere(random: &mut ChaCha8Rng) -> [f32; 3] {
    HALF_M.map(|half_m| random.random_range(-half_m..half_m))
}

fn moved([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x - MOTION_M.copysign(x), y, z]
}

/// The direction of a point that is not the origin.
fn unit(point: [f32; 3]) -> [f32; 3] {
    let length = point.iter().map(|c| c * c).sum::<f32>().sqrt().max(f32::MIN_POSITIVE);
    point.map(|c| c / length)
}

/// A pose that stands upright.
fn pose([x, y, z]: [f32; 3]) -> [f32; 7] {
    [x, y, z, 0.0, 0.0, 0.0, 1.0]
}

fn cloud(points: Vec<[f32; 3]>) -> PointCloud {
    points.into_iter().map(|[x, y, z]| Point::new(x, y, z)).collect::<Vec<_>>().into()
}
