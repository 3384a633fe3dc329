//! Depth images and poses, as the RGB-D sets of TUM have them.

use std::fs;
use std::path::PathBuf;

use mrol::geometry::Point;
use mrol::scan::write_ply;
use mrol::store::{Disk, Snapshot};

use super::{complaint, mrol, objects};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
const CAMERA: &str = "60 58 31.5 23.5";
/// Seconds since the epoch.
const BEGIN_S: f64 = 1_305_031_102.0;

/// A camera that went past a wall with a corner, its images, their points as clouds, and its poses at other times.
struct Set {
    folder: tempfile::TempDir,
}

impl Set {
    fn of(images: u32) -> Self {
        let set = Self { folder: tempfile::tempdir().unwrap() };
        fs::create_dir(set.folder.path().join("depth")).unwrap();
        fs::create_dir(set.folder.path().join("clouds")).unwrap();
        for k in 0..images {
            let time_s = BEGIN_S + 0.25 + f64::from(k) * 0.5;
            let depths: Vec<u16> =
                (0..HEIGHT).flat_map(|v| (0..WIDTH).map(move |u| depth(u, v, k))).collect();
            set.write_image(&format!("depth/{time_s}.png"), &depths);
            let points: Vec<Point> = (0..).zip(&depths).map(|(pixel, &depth)| point(pixel, depth)).collect();
            write_ply(&set.folder.path().join(format!("clouds/{k}.ply")), &points).unwrap();
        }
        // Between 0.2 m and 0.3 m lies each image, in the middle.
        let line = |time_s: f64, x: f64| format!("{time_s} {x} 0 1 -0.5 0.5 -0.5 0.5\n");
        let times = (0..images * 5 + 5).map(|k| f64::from(k) * 0.1 + 0.0);
        let lines = times.map(|since_s| line(BEGIN_S + since_s, since_s));
        fs::write(
            set.folder.path().join("groundtruth.txt"),
            format!("# a set\n{}", lines.collect::<String>()),
        )
        .unwrap();
        let lines = (0..images).map(|k| line(f64::from(k), 0.25 + f64::from(k) * 0.5));
        fs::write(set.folder.path().join("poses.txt"), lines.collect::<String>()).unwrap();
        set
    }

    fn write_image(&self, name: &str, depths: &[u16]) {
        let file = fs::File::create(self.folder.path().join(name)).unwrap();
        let mut encoder = png::Encoder::new(file, WIDTH, HEIGHT);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        let bytes: Vec<u8> = depths.iter().flat_map(|depth| depth.to_be_bytes()).collect();
        encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }
}

/// Depth of a pixel of an image, 5000 a meter; 0 where nothing returned.
fn depth(column: u32, row: u32, image: u32) -> u16 {
    match (column + row + image) % 9 {
        0 => 0,
        _ => (10_000 + 20 * column.abs_diff(30 + image) + 7 * row) as u16,
    }
}

/// What a pixel met, in the frame of the camera.
fn point(pixel: u32, depth: u16) -> Point {
    let (u, v) = (f64::from(pixel % WIDTH), f64::from(pixel / WIDTH));
    let depth_m = f64::from(depth) / 5000.0;
    Point::from(nalgebra::Point3::new((u - 31.5) / 60.0 * depth_m, (v - 23.5) / 58.0 * depth_m, depth_m))
}

#[test]
fn depth_images_at_the_poses_of_their_times_give_the_map_of_their_points() {
    let set = Set::of(3);
    let mapped = |scans: &str, poses: &str, more: &[&str]| {
        let out = set.path("map.mrol");
        let command = ["map", scans, "--resolution", "0.05", "--poses", poses, "--out", &out];
        assert_eq!(objects(&[&command[..], more].concat())[0]["verdict"], "accepted");
        Snapshot::read(&Disk::default(), out.as_ref()).unwrap().contents
    };
    let camera = ["--camera", CAMERA, "--depth-scale", "5000"];
    let of_images = mapped(&set.path("depth"), &set.path("groundtruth.txt"), &camera);
    let of_points = mapped(&set.path("clouds"), &set.path("poses.txt"), &[]);
    assert!(of_images.voxels.len() > 500);
    // Poses between two lines are off by rounding, and so are points on the faces between voxels.
    let differ = of_images.voxels.iter().filter(|key| !of_points.voxels.contains(*key)).count();
    assert!(differ * 100 <= of_points.voxels.len(), "{differ} of {}", of_points.voxels.len());
}

#[test]
fn the_first_image_is_put_upright() {
    let set = Set::of(2);
    let command =
        ["map", &set.path("depth"), "--resolution", "0.05", "--camera", CAMERA, "--depth-scale", "5000"];
    let first = &objects(&command)[0]["map_from_sensor"]["rotation_xyzw"];
    // z of a camera is x of the map, x is -y, y is -z.
    assert_eq!(first, &serde_json::json!([-0.5, 0.5, -0.5, 0.5]));
}

#[test]
fn an_image_without_a_camera_or_a_pose_says_what_to_do() {
    let set = Set::of(1);
    let depth = set.path("depth");
    let image: PathBuf = fs::read_dir(&depth).unwrap().next().unwrap().unwrap().path();
    for scans in [&depth, &image.display().to_string()] {
        let told = complaint(&["map", scans, "--resolution", "0.05"], 2);
        assert!(told.contains("--camera \"fx fy cx cy\""), "{told}");
    }
    let with_camera = |scans: &str, more: &[&str]| {
        let command = ["map", scans, "--resolution", "0.05", "--camera", CAMERA];
        mrol(&[&command[..], more].concat()).output().unwrap()
    };
    set.write_image("depth/1305031109.5.png", &vec![5000; (WIDTH * HEIGHT) as usize]);
    let late = with_camera(&depth, &["--poses", &set.path("groundtruth.txt")]);
    let told = String::from_utf8_lossy(&late.stderr).into_owned();
    assert!(
        !late.status.success() && told.contains("no pose for") && told.contains("1305031109.5"),
        "{told}"
    );
    for wrong in ["0 58 31.5 23.5", "60 58 31.5", "60 58 31.5 inf"] {
        let told = complaint(&["map", &depth, "--resolution", "0.05", "--camera", wrong], 2);
        assert!(told.contains("fx fy cx cy"), "{told}");
    }
    let told =
        complaint(&["map", &depth, "--resolution", "0.05", "--camera", CAMERA, "--depth-scale", "0"], 2);
    assert!(told.contains("above 0"), "{told}");
    fs::write(&image, b"no image").unwrap();
    let damaged = with_camera(&image.display().to_string(), &[]);
    assert!(String::from_utf8_lossy(&damaged.stderr).contains("no PNG that can be read"), "{damaged:?}");
}
