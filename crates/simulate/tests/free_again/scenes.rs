//! Scenes by kind and seed in which something goes, or in which thin things stand.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use mrol_map::geometry::{Point, Pose};
use mrol_map::scan::PointFilter;
use mrol_simulate::{Mover, Scene, SpinningLidar};

/// What goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A crate in a hall that is longer than the robot's range.
    BeyondRange,
    /// Somebody in the way of a robot that stands.
    Person,
    /// A door that was closed before a robot that stands.
    Door,
    /// A pallet with its load.
    Pallet,
    /// A crate before the open sky.
    OpenSky,
    /// Nothing: a low robot drives by tables and poles thinner than a voxel.
    ThinThings,
}

/// Scans before something goes, and after it.
pub(crate) const BEFORE: usize = 6;
const AFTER: usize = 3;
/// Scans past thin things.
const PASSING: usize = 60;
const NO_RETURN_M: f64 = 50.0;

/// A scene, and a robot in it.
pub(crate) struct Situation {
    pub(crate) kind: Kind,
    pub(crate) seed: u64,
    scene: Scene,
    /// What is there, and no longer after `BEFORE` scans.
    things: Vec<Mover>,
    /// Boxes around the things of which the figures tell.
    pub(crate) bounds_m: Vec<[[f64; 3]; 2]>,
    lidar: SpinningLidar,
    pub(crate) filter: PointFilter,
    pub(crate) poses: Vec<Pose>,
    pub(crate) resolution_m: f64,
    random: ChaCha8Rng,
}

fn cuboid(bottom_m: [f64; 3], size_m: [f64; 3]) -> Mover {
    Mover::Crate { bottom_m, size_m, gone_at: usize::MAX }
}

impl Situation {
    pub(crate) fn of(kind: Kind, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed * 16 + kind as u64);
        let mut any = |from: f64, to: f64| random.random_range(from..to);
        let lidar = SpinningLidar { rings: 32, azimuths: 1024, ..SpinningLidar::default() };
        let (x, y) = (10.0 + any(-0.5, 0.5), 7.0 + any(-0.5, 0.5));
        let (away_m, angle) = (any(2.0, 3.5), any(-0.4, 0.4));
        let at = [x + away_m * angle.cos(), y + away_m * angle.sin()];
        let standing = |x, y, z| vec![Pose::translation(x, y, z); BEFORE + AFTER];
        let hall = Scene::hall(seed);
        let none = PointFilter::default();
        let (scene, things, filter, poses, told) = match kind {
            Kind::BeyondRange => {
                let size = [any(0.5, 1.2), any(0.5, 1.2), any(0.5, 1.6)];
                let filter = PointFilter { range_max_m: Some(any(7.2, 8.0)), ..none };
                (hall, vec![cuboid([at[0], at[1], 0.0], size)], filter, standing(x, y, 0.8), 1)
            }
            Kind::Person => {
                let person = Mover::Walker { from_m: at, to_m: [at[0] + 1.0, at[1]], step_m: 0.0 };
                (hall, vec![person], none, standing(x, y, 1.0), 1)
            }
            Kind::Door => {
                let (wall_x, leaf_m) = (x + away_m, any(0.8, 1.1));
                let side = |y: f64, width: f64| cuboid([wall_x, y, 0.0], [0.1, width, 2.7]);
                let (low, high) = (y - leaf_m / 2.0, y + leaf_m / 2.0);
                let leaf = cuboid([wall_x, y, 0.0], [0.05, leaf_m, 2.0]);
                let walls = [
                    side(low / 2.0, low),
                    side((14.0 + high) / 2.0, 14.0 - high),
                    cuboid([wall_x, y, 2.0], [0.1, leaf_m, 0.7]),
                ];
                (hall.with_movers(&walls, 0), vec![leaf], none, standing(x, y, 0.8), 1)
            }
            Kind::Pallet => {
                let load = cuboid([at[0], at[1], 0.0], [1.2, 0.8, any(0.5, 1.4)]);
                (hall, vec![load], none, standing(x, y, 0.7), 1)
            }
            Kind::OpenSky => {
                let size = [any(0.6, 1.2), any(0.6, 1.2), any(0.8, 1.6)];
                let load = cuboid([at[0] - 10.0, at[1] - 7.0, 0.0], size);
                let filter = PointFilter { no_return_m: Some(NO_RETURN_M), ..none };
                (Scene::yard(seed), vec![load], filter, standing(x - 10.0, y - 7.0, 0.8), 1)
            }
            Kind::ThinThings => {
                let mut things = Vec::new();
                for i in 0..4 {
                    let place = [7.0 + 2.0 * f64::from(i) + any(-0.3, 0.3), 7.0 + any(1.0, 2.5)];
                    let (thick, leg) = (any(0.02, 0.03), any(0.03, 0.05));
                    things.push(cuboid([place[0], place[1], 0.72], [1.2, 0.7, thick]));
                    for [dx, dy] in [[-0.55, -0.3], [0.55, -0.3], [-0.55, 0.3], [0.55, 0.3]] {
                        things.push(cuboid([place[0] + dx, place[1] + dy, 0.0], [leg, leg, 0.72]));
                    }
                    let (pole, thick) = ([6.5 + 2.0 * f64::from(i), 7.0 - any(1.0, 3.0)], any(0.03, 0.06));
                    things.push(cuboid([pole[0], pole[1], 0.0], [thick, thick, 2.0]));
                }
                let drive = (0..PASSING).map(|i| {
                    let x = 5.5 + 9.0 * i as f64 / PASSING as f64;
                    Pose::new(Vector3::new(x, 7.0, 0.35), Vector3::new(0.0, 0.0, 0.002 * i as f64))
                });
                let told = things.len();
                (hall, things, none, drive.collect(), told)
            }
        };
        let bounds_m = things[..told].iter().filter_map(|thing| thing.bounds_m(0));
        // Of a door the part that is farther from its frame than carving believes.
        let frame_m = if kind == Kind::Door { [0.0, 0.3, 0.3] } else { [0.0; 3] };
        let inner = |[low, high]: [[f64; 3]; 2]| {
            [[low[0], low[1] + frame_m[1], low[2]], [0, 1, 2].map(|i| high[i] - frame_m[i])]
        };
        let bounds_m = bounds_m.map(inner).collect();
        Self { kind, seed, scene, things, bounds_m, lidar, filter, poses, resolution_m: 0.1, random }
    }

    /// Scan `step`.
    pub(crate) fn scan(&mut self, step: usize) -> Vec<Point> {
        let is_gone = self.kind != Kind::ThinThings && step >= BEFORE;
        let things: &[Mover] = if is_gone { &[] } else { &self.things };
        let scene = self.scene.with_movers(things, 0);
        let pose = &self.poses[step];
        let points = match self.filter.no_return_m {
            Some(no_return_m) => {
                self.lidar.scan_telling_no_returns(&scene, pose, no_return_m, &mut self.random)
            }
            None => self.lidar.scan(&scene, pose, &mut self.random),
        };
        points.into_iter().filter(|point| point.is_finite()).collect()
    }
}
