//! The spinning lidar.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use super::beam::{cast, drops_out, gaussian, point};
use crate::scene::Scene;
use mrol_map::geometry::{Point, Pose};

/// A spinning lidar; its frame has x forward, y to the left and z up.
#[derive(Debug, Clone, PartialEq)]
pub struct SpinningLidar {
    /// Lasers, one above the other.
    pub rings: u32,
    /// Shots of each laser in a turn.
    pub azimuths: u32,
    /// The rings are spread evenly over elevations from minus this to this, degrees.
    pub elevation_max_deg: f64,
    /// Least distance that it measures, meters.
    pub range_min_m: f64,
    /// Largest distance that it measures, meters.
    pub range_max_m: f64,
    /// Standard deviation of a distance, meters.
    pub noise_m: f64,
    /// Share of the returns that are lost.
    pub dropout: f64,
}

impl Default for SpinningLidar {
    /// 32 rings of 900 azimuths, 22 degrees up and down, 0.5 to 30 m, noise of 1 cm, 1 % of the returns lost.
    fn default() -> Self {
        Self {
            rings: 32,
            azimuths: 900,
            elevation_max_deg: 22.0,
            range_min_m: 0.5,
            range_max_m: 30.0,
            noise_m: 0.01,
            dropout: 0.01,
        }
    }
}

impl SpinningLidar {
    /// One scan in the sensor frame, meters: for each azimuth a point of each ring from the lowest, NaN where
    /// nothing returned. The whole turn is measured from one pose, as if it took no time.
    pub fn scan(&self, scene: &Scene, map_from_sensor: &Pose, rng: &mut ChaCha8Rng) -> Vec<Point> {
        let shots = (0..self.azimuths).flat_map(|azimuth| (0..self.rings).map(move |ring| (azimuth, ring)));
        shots
            .map(|(azimuth, ring)| self.measure(self.direction(azimuth, ring), scene, map_from_sensor, rng))
            .collect()
    }

    /// [`SpinningLidar::scan`] of a driver that tells where nothing returned: by a point at `no_return_m` in that
    /// direction.
    pub fn scan_telling_no_returns(
        &self,
        scene: &Scene,
        map_from_sensor: &Pose,
        no_return_m: f64,
        rng: &mut ChaCha8Rng,
    ) -> Vec<Point> {
        let mut points = self.scan(scene, map_from_sensor, rng);
        let shots = (0..self.azimuths).flat_map(|azimuth| (0..self.rings).map(move |ring| (azimuth, ring)));
        for (end, (azimuth, ring)) in points.iter_mut().zip(shots).filter(|(end, _)| !end.is_finite()) {
            *end = point(self.direction(azimuth, ring), Some(no_return_m));
        }
        points
    }

    /// One scan of a sensor that moves during its turn: the points as in [`SpinningLidar::scan`], each in the sensor's
    /// frame at its own time, and these times.
    ///
    /// The turn takes `turn_s` seconds and ends at time 0, so that times are negative; `map_from_sensor` is where the
    /// sensor is at a time.
    pub fn sweep(
        &self,
        scene: &Scene,
        turn_s: f64,
        map_from_sensor: impl Fn(f64) -> Pose,
        rng: &mut ChaCha8Rng,
    ) -> (Vec<Point>, Vec<f32>) {
        let mut scan = (Vec::new(), Vec::new());
        for azimuth in 0..self.azimuths {
            let time_s = (f64::from(azimuth + 1) / f64::from(self.azimuths) - 1.0) * turn_s;
            let pose = map_from_sensor(time_s);
            for ring in 0..self.rings {
                scan.0.push(self.measure(self.direction(azimuth, ring), scene, &pose, rng));
                scan.1.push(time_s as f32);
            }
        }
        scan
    }

    fn direction(&self, azimuth: u32, ring: u32) -> Vector3<f64> {
        let (sin, cos) = (f64::from(azimuth) / f64::from(self.azimuths) * TAU).sin_cos();
        let share = (f64::from(ring) + 0.5) / f64::from(self.rings) * 2.0 - 1.0;
        let (up, along) = (share * self.elevation_max_deg).to_radians().sin_cos();
        Vector3::new(cos * along, sin * along, up)
    }

    fn measure(&self, direction: Vector3<f64>, scene: &Scene, pose: &Pose, rng: &mut ChaCha8Rng) -> Point {
        let range = cast(scene, pose, direction, (self.range_min_m, self.range_max_m));
        let range = range.filter(|_| !drops_out(self.dropout, rng));
        point(direction, range.map(|range| range + self.noise_m * gaussian(rng)))
    }
}
