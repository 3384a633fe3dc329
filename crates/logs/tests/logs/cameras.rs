//! Depth images are clouds of the points that their pixels met.

use super::support::{CdrWriter, McapWriter};
use mrol_logs::cloud::{Cloud, CloudError};
use mrol_logs::log::{McapReader, Messages};
use mrol_logs::sequence::{Sequence, SequenceOptions};
use mrol_logs::survey::{Choice, ChoiceError, LogSurvey, Plan};
use mrol_map::geometry::Point;

const WIDTH: u32 = 4;
const HEIGHT: u32 = 3;
/// Focal lengths and center.
const CAMERA: [f64; 4] = [2.0, 4.0, 1.5, 1.0];
const START_NS: i64 = 1_764_370_870_000_000_000;

/// An image with two bytes more than its pixels need behind each row.
fn image(
    encoding: &str,
    is_big: bool,
    [width, height]: [u32; 2],
    pixel: impl Fn(u32, u32) -> Vec<u8>,
) -> Vec<u8> {
    let mut writer = CdrWriter::new(is_big);
    writer.header(START_NS, "camera_optical");
    writer.u32(height);
    writer.u32(width);
    writer.string(encoding);
    writer.u8(u8::from(is_big));
    let rows: Vec<Vec<u8>> = (0..height)
        .map(|v| [(0..width).flat_map(|u| pixel(u, v)).collect(), vec![0xff; 2]].concat())
        .collect();
    writer.u32(rows.first().map_or(0, Vec::len) as u32);
    writer.octets(&rows.concat());
    writer.finish()
}

/// Meters ahead of a pixel; there is one without.
fn depth_m(u: u32, v: u32) -> Option<f32> {
    ((u, v) != (2, 1)).then_some(1.0 + u as f32 + 0.5 * v as f32)
}

fn camera_info(distortion: &[f64], is_rectified: bool) -> Vec<u8> {
    camera_info_of(distortion, is_rectified, 0.0, [0; 4])
}

/// [`camera_info`] with a skew, and pixels that are one along a row and a column, from a column and a row on.
fn camera_info_of(distortion: &[f64], is_rectified: bool, skew: f64, part: [u32; 4]) -> Vec<u8> {
    let mut writer = CdrWriter::new(false);
    writer.header(START_NS, "camera_optical");
    writer.u32(HEIGHT);
    writer.u32(WIDTH);
    writer.string("plumb_bob");
    writer.u32(distortion.len() as u32);
    distortion.iter().for_each(|&number| writer.f64(number));
    let [x, y, cx, cy] = CAMERA;
    [x, skew, cx, 0.0, y, cy, 0.0, 0.0, 1.0].into_iter().for_each(|number| writer.f64(number));
    (0..9).for_each(|_| writer.f64(0.0));
    let of_rectified = [2.0 * x, 0.0, cx, 0.0, 0.0, 2.0 * y, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    of_rectified.into_iter().for_each(|number| writer.f64(if is_rectified { number } else { 0.0 }));
    part.into_iter().for_each(|number| writer.u32(number));
    // Height and width of the part, and whether it is to be rectified.
    (0..2).for_each(|_| writer.u32(0));
    writer.u8(0);
    writer.finish()
}

/// A log of one image, whose camera is told after it.
fn log(topic: &str, image: &[u8], infos: &[Vec<u8>]) -> Vec<u8> {
    let mut log = McapWriter::default();
    let images = log.topic(topic, "sensor_msgs/msg/Image");
    let info = log.topic("/camera/depth/camera_info", "sensor_msgs/msg/CameraInfo");
    log.message(images, START_NS as u64, image);
    infos.iter().for_each(|told| log.message(info, START_NS as u64, told));
    log.finish()
}

fn survey(log: &[u8]) -> LogSurvey {
    LogSurvey::take(&mut McapReader::new(log).unwrap(), |_| {}).unwrap()
}

/// The points of the first scan of a log, or the notes where it has none.
fn points(log: &[u8]) -> Result<Vec<Point>, Vec<String>> {
    let survey = survey(log);
    let plan = Plan::of(&survey, &Choice::default()).map_err(|why| vec![why.to_string()])?;
    let mut sequence = Sequence::new(&survey, plan, SequenceOptions::default());
    let mut reader = McapReader::new(log).unwrap();
    while let Some(message) = reader.next_message().unwrap() {
        sequence.take(&message);
    }
    sequence.next_scan(true).map(|scan| scan.points).ok_or_else(|| sequence.notes())
}

fn millimeters(u: u32, v: u32) -> Vec<u8> {
    depth_m(u, v).map_or(0, |depth_m| (1000.0 * depth_m) as u16).to_le_bytes().to_vec()
}

#[test]
fn pixels_are_points_of_a_pinhole_in_either_unit_and_byte_order() {
    let size = [WIDTH, HEIGHT];
    let meters = |u, v| depth_m(u, v).unwrap_or(f32::NAN).to_be_bytes().to_vec();
    let images = [image("16UC1", false, size, millimeters), image("32FC1", true, size, meters)];
    let rectified = "/camera/depth/image_rect_raw";
    let of_lens = (false, rectified, 1.0);
    // An image that nobody rectified is as the lens projects, whatever is told of rectified ones.
    let forms = [of_lens, (true, rectified, 2.0), (true, "/camera/depth/image_raw", 1.0)];
    for (image, (is_rectified, topic, scale)) in
        images.iter().flat_map(|image| forms.map(|form| (image, form)))
    {
        let infos = [camera_info(&[0.0; 5], is_rectified)];
        let points = points(&log(topic, image, &infos)).unwrap();
        assert_eq!(points.len(), 12);
        for (k, point) in points.iter().enumerate() {
            let (u, v) = (k as u32 % WIDTH, k as u32 / WIDTH);
            let Some(depth_m) = depth_m(u, v) else {
                assert!(!point.is_finite());
                continue;
            };
            let along = |pixel: u32, focal: f64, center: f64| (f64::from(pixel) - center) / (scale * focal);
            let [x, y, cx, cy] = CAMERA;
            let expected =
                [along(u, x, cx), along(v, y, cy), 1.0].map(|at_1_m| (at_1_m * f64::from(depth_m)) as f32);
            let off = (0..3).map(|axis| (point.xyz()[axis] - expected[axis]).abs()).fold(0.0, f32::max);
            assert!(off < 1e-6, "pixel {u} {v}: {:?}, {expected:?}", point.xyz());
        }
    }
}

#[test]
fn images_without_depths_and_cameras_that_are_not_known_are_refused_in_words() {
    let depths = image("16UC1", false, [WIDTH, HEIGHT], millimeters);
    let colors = image("rgb8", false, [WIDTH, HEIGHT], |_, _| vec![1, 2, 3]);
    let refused = |topic: &str, image: &[u8], infos: &[Vec<u8>]| {
        let survey = survey(&log(topic, image, infos));
        Plan::of(&survey, &Choice::default()).map(|plan| plan.sensor_frame).unwrap_err()
    };
    let raw = "/camera/depth/image_raw";
    assert!(matches!(refused(raw, &colors, &[camera_info(&[], false)]), ChoiceError::NoClouds(_)));
    let nothing = refused(raw, &depths, &[]).to_string();
    assert!(nothing.contains("no sensor_msgs/CameraInfo at /camera/depth/camera_info"), "{nothing}");
    let bent = refused(raw, &depths, &[camera_info(&[0.1, 0.0], true)]).to_string();
    assert!(bent.contains("the lens distorts"), "{bent}");
    assert!(points(&log("/camera/depth/image_rect", &depths, &[camera_info(&[0.1, 0.0], true)])).is_ok());
    let many = refused(raw, &depths, &[camera_info(&[0.0; 15], true)]).to_string();
    assert!(many.contains("no sensor_msgs/CameraInfo"), "{many}");
    let skewed = refused(raw, &depths, &[camera_info_of(&[], false, 50.0, [0; 4])]).to_string();
    assert!(skewed.contains("has the skew 50"), "{skewed}");
    for part in [[2, 2, 0, 0], [0, 0, 20, 20], [1, 1, 0, 3]] {
        let of_part = refused(raw, &depths, &[camera_info_of(&[], false, 0.0, part)]).to_string();
        assert!(of_part.contains("record whole images"), "{part:?}: {of_part}");
    }
    let whole = [camera_info_of(&[], false, 0.0, [1, 1, 0, 0])];
    assert!(points(&log(raw, &depths, &whole)).is_ok());
    // A camera that is told differently later.
    let told = survey(&log(raw, &depths, &[camera_info(&[], false), camera_info(&[], true)])).contradictions;
    assert!(matches!(&told[..], [only] if only.contains("changes within the log")), "{told:?}");
}

#[test]
fn images_that_are_not_as_they_say_are_left_out_in_words() {
    let infos = [camera_info(&[], false)];
    let said = |image: &[u8]| points(&log("/camera/depth/image_raw", image, &infos)).unwrap_err().concat();
    let other = said(&image("16UC1", false, [WIDTH + 1, HEIGHT], millimeters));
    assert!(other.contains("5 x 3 pixels, and its CameraInfo says 4 x 3"), "{other}");
    let short = said(&image("16UC1", false, [WIDTH, HEIGHT], |_, _| vec![1]));
    assert!(short.contains("need"), "{short}");
    // Sizes that nothing could hold.
    let camera = mrol_logs::cloud::Camera {
        height: u32::MAX,
        width: u32::MAX,
        intrinsics: mrol_map::scan::Intrinsics { focal: [1.0; 2], center: [0.0; 2] },
    };
    let mut huge = image("16UC1", false, [1, 1], millimeters);
    // Behind the encapsulation, the stamp, and the frame's name.
    huge[32..40].fill(0xff);
    let options = mrol_logs::cloud::CloudOptions { camera: Some(&camera), ..Default::default() };
    let read = Cloud::read(mrol_logs::message::MessageKind::Image, &huge, options);
    assert!(matches!(read, Err(CloudError::DataShort { .. })), "{read:?}");
}
