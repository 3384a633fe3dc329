//! What scans of a sensor tell whose model is known, against those of an unknown sensor and against the scene itself.

#![expect(clippy::unwrap_used, reason = "a test may fail where it stands")]

use std::hint::black_box;
use std::time::{Duration, Instant};

use mrol_map::geometry::{Point, Pose};
use mrol_map::visibility::{
    AbsenceEvidence, IMAGE_BYTES_MAX, RangeImage, ScanRays, ScanSurface, SensorModel, SensorRays,
    SurfaceSettings, Sweep, Thresholds,
};
use mrol_simulate::{DepthCamera, Scene, SpinningLidar};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Places along rays and beside them that are asked for.
const PLACES: usize = 20_000;
/// Side of a voxel, meters.
const VOXEL_M: f32 = 0.1;

/// A sensor, its model, and what it saw of a scene.
struct Seen {
    name: String,
    scene: Scene,
    map_from_sensor: Pose,
    model: SensorModel,
    /// Row by row: columns of a lidar and rows of a camera; not finite where nothing returned.
    points: Vec<Point>,
    /// Points of a row.
    row: usize,
}

impl Seen {
    fn by_lidar(rings: u32, columns: u32, elevation_max_deg: f64, seed: u64) -> Self {
        let lidar = SpinningLidar { rings, azimuths: columns, elevation_max_deg, ..SpinningLidar::default() };
        let (scene, map_from_sensor, mut random) = place(seed, 0.0);
        let highest_deg = elevation_max_deg * (1.0 - 1.0 / f64::from(rings));
        Self {
            name: format!("lidar {rings} x {columns}, seed {seed}"),
            points: lidar.scan(&scene, &map_from_sensor, &mut random),
            model: SensorModel::Spinning { rings, columns, lowest_deg: -highest_deg, highest_deg },
            scene,
            map_from_sensor,
            row: rings as usize,
        }
    }

    fn by_camera(width: u32, height: u32, seed: u64) -> Self {
        let camera = DepthCamera { width_px: width, height_px: height, ..DepthCamera::default() };
        // x to the right, y down, z forward.
        let (scene, map_from_sensor, mut random) = place(seed, -std::f64::consts::FRAC_PI_2);
        let focal = |pixels: u32, fov_deg: f64| f64::from(pixels) / 2.0 / (fov_deg / 2.0).to_radians().tan();
        let (fx, fy) = (focal(width, camera.horizontal_fov_deg), focal(height, camera.vertical_fov_deg));
        Self {
            name: format!("camera {width} x {height}, seed {seed}"),
            points: camera.scan(&scene, &map_from_sensor, &mut random),
            model: SensorModel::Pinhole { width, height, fx, fy },
            scene,
            map_from_sensor,
            row: width as usize,
        }
    }

    fn all(seed: u64) -> [Self; 6] {
        [
            Self::by_lidar(64, 1024, 22.0, seed),
            Self::by_lidar(32, 900, 22.0, seed),
            Self::by_lidar(16, 1800, 15.0, seed),
            Self::by_lidar(128, 1024, 44.0, seed),
            Self::by_camera(160, 120, seed),
            Self::by_camera(424, 240, seed),
        ]
    }

    fn finite(&self) -> Vec<Point> {
        self.points.iter().copied().filter(|point| point.is_finite()).collect()
    }

    /// Every so many-th point of a row, and of the rows every so many-th.
    fn every(&self, of_row: usize, of_rows: usize) -> Vec<Point> {
        let rows = self.points.chunks(self.row).step_by(of_rows);
        rows.flat_map(|row| row.iter().step_by(of_row)).copied().filter(|point| point.is_finite()).collect()
    }

    /// Places in the sensor's frame between rays beside each other, and whether nothing is before them.
    fn places(&self) -> Vec<([f32; 3], bool)> {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let origin = Point3::from(self.map_from_sensor.translation.vector);
        let mut place = || {
            let first = random.random_range(0..self.points.len() - self.row - 1);
            let [a, beside, above] = [0, 1, self.row].map(|i| self.points[first + i].to_f64().coords);
            let is_there =
                (first + 1) % self.row != 0 && [a, beside, above].iter().all(|c| c.norm().is_finite());
            let [u, v] = [0, 1].map(|_| random.random_range(0.0..1.0));
            let [a_to, beside_to, above_to] = [a, beside, above].map(|end| end.normalize());
            let direction = (a_to + u * (beside_to - a_to) + v * (above_to - a_to)).normalize();
            let at_m = a.norm() * random.random_range(0.1..1.3);
            if !is_there {
                return None;
            }
            let reaches_m = self.scene.cast(origin, self.map_from_sensor.rotation * direction, 100.0);
            let is_free = reaches_m.is_none_or(|reaches_m| reaches_m > at_m - 0.05);
            Some(((direction * at_m).map(|c| c as f32).into(), is_free))
        };
        (0..PLACES).filter_map(|_| place()).collect()
    }
}

/// A furnished building, a place in it and how the sensor is turned there, and randomness for the sensor.
fn place(seed: u64, roll_rad: f64) -> (Scene, Pose, ChaCha8Rng) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scene = Scene::hall(seed);
    let at = Vector3::new(random.random_range(4.0..16.0), random.random_range(4.0..10.0), 1.0);
    let yaw = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, random.random_range(-3.0..3.0));
    let roll = nalgebra::UnitQuaternion::from_euler_angles(roll_rad, 0.0, 0.0);
    (scene, Pose::from_parts(at.into(), yaw * roll), random)
}

/// Of places, how many are told free that are, and how many that are not.
fn told(places: &[([f32; 3], bool)], is_free: impl Fn([f32; 3]) -> bool) -> [usize; 2] {
    let told = places.iter().filter(|(place, _)| is_free(*place));
    told.fold(
        [0, 0],
        |[right, wrong], (_, is_true)| {
            if *is_true { [right + 1, wrong] } else { [right, wrong + 1] }
        },
    )
}

fn image(points: &[Point], sensor: Option<SensorRays>) -> RangeImage {
    RangeImage::of_points_by(points, Sweep::standing(40.0), IMAGE_BYTES_MAX, sensor, &Thresholds::DEFAULT)
        .unwrap()
}

fn surface(points: &[Point], sensor: Option<SensorRays>) -> ScanSurface {
    let settings = SurfaceSettings {
        grazing_rad: 0.14,
        noise_m: VOXEL_M,
        spacing_m: 0.2,
        sensor,
        thresholds: Thresholds::DEFAULT,
    };
    ScanSurface::of(ScanRays::met(points), settings).unwrap()
}

/// How far from a place the nearest ray ran that ended beyond it, meters.
fn nearest_ray_m(ends: &[Point], place: [f32; 3]) -> f32 {
    let place = Vector3::from(place);
    let distance_m = place.norm();
    let aside_m = |end: &Point| {
        let end = Vector3::from(end.xyz());
        let along_m = place.dot(&end) / end.norm();
        (along_m > 0.0 && end.norm() > distance_m)
            .then(|| (distance_m.powi(2) - along_m.powi(2)).max(0.0).sqrt())
    };
    ends.iter().filter_map(aside_m).fold(f32::INFINITY, f32::min)
}

#[test]
fn scans_of_a_known_sensor_tell_no_less_and_nothing_that_is_false() {
    for seen in (1..=2).flat_map(Seen::all) {
        let (points, places) = (seen.finite(), seen.places());
        let rays = SensorRays::confirmed(&seen.model, &points).unwrap();
        let [unknown, known] = [None, Some(rays)].map(|sensor| {
            let (image, surface) = (image(&points, sensor), surface(&points, sensor));
            let sees_through = |place| surface.sees_through(place, 0.87 * VOXEL_M, 1.5 * VOXEL_M);
            [told(&places, |place| image.is_free(place)), told(&places, sees_through)]
        });
        for (kind, [right, wrong], [right_known, wrong_known]) in
            [("image", unknown[0], known[0]), ("surface", unknown[1], known[1])]
        {
            let what = format!("{}, {kind}: unknown {right} and {wrong}", seen.name);
            assert!(right > 1000 && right_known * 1000 >= right * 995, "{what}, known {right_known}");
            // Noise of a few places at rims.
            assert!(wrong_known <= wrong + 5, "{what}, known {wrong_known} wrong");
        }
    }
}

#[test]
fn a_model_of_more_rays_than_were_sent_lets_no_scan_see_between_them() {
    let well_beyond = AbsenceEvidence { margin_m: 3.0 * VOXEL_M, gap_max_m: VOXEL_M };
    let (mut refused, mut used) = (0, 0);
    for seen in Seen::all(3) {
        let places = seen.places();
        for [of_row, of_rows] in [[2, 1], [1, 2], [2, 2], [4, 1], [1, 4], [4, 4]] {
            let points = seen.every(of_row, of_rows);
            let what = format!("{}, every {of_row} of a row, of {of_rows} rows", seen.name);
            let rays = match SensorRays::confirmed(&seen.model, &points) {
                Ok(rays) => rays,
                Err(mismatch) => {
                    assert!(mismatch.to_string().contains(&seen.model.to_string()), "{mismatch}");
                    refused += 1;
                    continue;
                }
            };
            used += 1;
            // What no ray passed is told no more often than by an unknown sensor.
            let [unknown, known] = [None, Some(rays)].map(|sensor| {
                let (image, surface) = (image(&points, sensor), surface(&points, sensor));
                let sees_through = |place| surface.sees_through(place, 0.87 * VOXEL_M, 1.5 * VOXEL_M);
                let missed = |told: &dyn Fn([f32; 3]) -> bool, near_m: f32| {
                    let some = places.iter().step_by(17).filter(|(place, _)| told(*place));
                    some.filter(|(place, _)| nearest_ray_m(&points, *place) > near_m).count()
                };
                [
                    told(&places, |place| image.is_free(place))[1],
                    missed(&|place| image.proves_absent(place, well_beyond), VOXEL_M),
                    missed(&sees_through, 1.5 * VOXEL_M),
                ]
            });
            for (kind, unknown, known) in [("free", 0, 5), ("absent", 1, 2), ("carved", 2, 0)]
                .map(|(kind, i, more)| (kind, unknown[i] + more, known[i]))
            {
                assert!(known <= unknown, "{what}, {kind}: {known} places, {unknown} are allowed");
            }
        }
    }
    assert!(refused >= 12 && used >= 6, "{refused} refused, {used} used: the test says little");
}

#[test]
fn a_model_of_fewer_rays_than_points_and_of_another_sensor_is_not_used() {
    let seen = Seen::by_lidar(32, 900, 22.0, 4);
    let points = seen.finite();
    let refused = |model: &str, points: &[Point]| {
        SensorRays::confirmed(&model.parse().unwrap(), points).unwrap_err().to_string()
    };
    let more = refused("spinning 16 900 -21 21", &points);
    assert!(more.contains(&format!("{} points are more than its 14400 rays", points.len())), "{more}");
    let finer = refused("spinning 128 3600 -21.3 21.3", &points);
    assert!(finer.contains("rays are missing") || finer.contains("degrees apart"), "{finer}");
    let camera = refused("pinhole 640 480 525 525", &points);
    assert!(camera.contains("rays are missing") || camera.contains("degrees apart"), "{camera}");
    let few = refused("spinning 32 900 -21.3 21.3", &[points[0]]);
    assert!(few.contains("rays are missing"), "{few}");
}

#[test]
#[ignore = "figures of docs/measurements.md (Known sensors)"]
fn figures_of_times() {
    for seen in Seen::all(1) {
        let points = seen.finite();
        let known = || SensorRays::confirmed(&seen.model, &points).ok();
        assert!(known().is_some(), "{}", seen.name);
        // In turns, the shortest of each: others are at work on the machine.
        let mut shortest = [Duration::MAX; 4];
        for _ in 0..15 {
            let ways: [&dyn Fn(); 4] = [
                &|| drop(black_box(image(&points, None))),
                &|| drop(black_box(image(&points, known()))),
                &|| drop(black_box(surface(&points, None))),
                &|| drop(black_box(surface(&points, known()))),
            ];
            for (shortest, way) in shortest.iter_mut().zip(ways) {
                let start = Instant::now();
                way();
                *shortest = start.elapsed().min(*shortest);
            }
        }
        let [image, image_known, surface, surface_known] = shortest.map(|time| time.as_secs_f64() * 1e3);
        println!(
            "{}, {} points: image {image:.1} ms, known {image_known:.1}, {:.2}; surface {surface:.1}, known \
             {surface_known:.1}, {:.2}",
            seen.name,
            points.len(),
            image_known / image,
            surface_known / surface
        );
    }
}
