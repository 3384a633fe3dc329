//! Images of what a scan saw: of an unknown sensor, and of one whose model is known, with what confirms the model.

use criterion::{Criterion, criterion_group, criterion_main};
use mrol::geometry::{Point, Pose};
use mrol::visibility::{
    IMAGE_BYTES_MAX, RangeImage, ScanRays, ScanSurface, SensorModel, SensorRays, SurfaceSettings, Sweep,
    Thresholds,
};
use mrol_simulate::{DepthCamera, Scene, SpinningLidar, tours};
use nalgebra::UnitQuaternion;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn images(criterion: &mut Criterion) {
    for (name, points, model) in scans() {
        let mut group = criterion.benchmark_group(format!("image {name}"));
        group.sample_size(20);
        let known = || SensorRays::confirmed(&model, &points).ok();
        assert!(known().is_some(), "the model is that of the sensor");
        group.bench_function("unknown", |bencher| bencher.iter(|| image(&points, None)));
        group.bench_function("known", |bencher| bencher.iter(|| image(&points, known())));
        group.bench_function("surface unknown", |bencher| bencher.iter(|| surface(&points, None)));
        group.bench_function("surface known", |bencher| bencher.iter(|| surface(&points, known())));
        group.finish();
    }
}

fn image(points: &[Point], sensor: Option<SensorRays>) -> Option<RangeImage> {
    RangeImage::of_points_by(points, Sweep::standing(60.0), IMAGE_BYTES_MAX, sensor, &Thresholds::DEFAULT)
}

fn surface(points: &[Point], sensor: Option<SensorRays>) -> Option<ScanSurface> {
    let thresholds = Thresholds::DEFAULT;
    let settings = SurfaceSettings { grazing_rad: 0.14, noise_m: 0.05, spacing_m: 0.105, sensor, thresholds };
    ScanSurface::of(ScanRays::met(points), settings)
}

/// Scans of sensors of several sizes from one place of a furnished building, with the models of the sensors.
fn scans() -> Vec<(String, Vec<Point>, SensorModel)> {
    let scene = Scene::furnished(1);
    let [tour, _] = tours(2);
    let pose = tour.poses[0];
    let finite = |mut points: Vec<Point>| {
        points.retain(|point| point.is_finite());
        points
    };
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut scans = Vec::new();
    for (rings, columns, elevation_max_deg) in [(32, 900, 22.0), (64, 1024, 22.0), (128, 1024, 44.0)] {
        let lidar = SpinningLidar { rings, azimuths: columns, elevation_max_deg, ..SpinningLidar::default() };
        let highest_deg = elevation_max_deg * (1.0 - 1.0 / f64::from(rings));
        let model = SensorModel::Spinning { rings, columns, lowest_deg: -highest_deg, highest_deg };
        let points = finite(lidar.scan(&scene, &pose, &mut random));
        scans.push((format!("lidar {rings} x {columns}"), points, model));
    }
    for (width, height) in [(160, 120), (640, 480)] {
        let camera = DepthCamera { width_px: width, height_px: height, ..DepthCamera::default() };
        let focal = |pixels: u32, fov_deg: f64| f64::from(pixels) / 2.0 / (fov_deg / 2.0).to_radians().tan();
        let (fx, fy) = (focal(width, camera.horizontal_fov_deg), focal(height, camera.vertical_fov_deg));
        // z forward, y down.
        let forward = UnitQuaternion::from_euler_angles(-std::f64::consts::FRAC_PI_2, 0.0, 0.0);
        let camera_pose = Pose::from_parts(pose.translation, pose.rotation * forward);
        let points = finite(camera.scan(&scene, &camera_pose, &mut random));
        scans.push((
            format!("camera {width} x {height}"),
            points,
            SensorModel::Pinhole { width, height, fx, fy },
        ));
    }
    scans
}

criterion_group!(benches, images);
criterion_main!(benches);
