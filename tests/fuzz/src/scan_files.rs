//! Files of scans and trajectories.

use std::path::Path;

use mrol_map::geometry::Point;
use mrol_map::scan::{ReadError, parse_points, parse_trajectory};

/// The shortest points: three single digits of text, or twelve bytes that LZF may have shrunk to an eighty-eighth.
const POINTS_A_BYTE_MAX: usize = 8;
/// Characters of a message, at most: a hostile file does not fill the log.
const MESSAGE_MAX: usize = 1000;

/// A `.ply` file.
pub(super) fn ply(bytes: &[u8]) {
    points("a.ply", bytes);
}

/// A `.pcd` file.
pub(super) fn pcd(bytes: &[u8]) {
    points("a.pcd", bytes);
}

/// The formats without a header: `.xyz`, `.f32` and trajectories.
pub(super) fn text(bytes: &[u8]) {
    points("a.xyz", bytes);
    if let Some(read) = points("a.f32", bytes) {
        assert_eq!(read.iter().flat_map(|p| p.xyz()).flat_map(f32::to_le_bytes).collect::<Vec<_>>(), bytes);
    }
    trajectory(bytes);
}

fn points(name: &str, bytes: &[u8]) -> Option<Vec<Point>> {
    let read = judged(name, parse_points(Path::new(name), bytes))?;
    assert!(read.len() <= bytes.len() * POINTS_A_BYTE_MAX, "{} points of {} bytes", read.len(), bytes.len());
    Some(read)
}

/// Poses that were read are written, and read again, as they were.
fn trajectory(bytes: &[u8]) {
    let Some(poses) = judged("poses.txt", parse_trajectory(Path::new("poses.txt"), bytes)) else { return };
    let written: String = poses.iter().map(|pose| format!("{pose}\n")).collect();
    let again = parse_trajectory(Path::new("again.txt"), written.as_bytes()).expect("what was written");
    for (pose, again) in poses.iter().zip(&again) {
        assert_eq!(pose.id.to_bits(), again.id.to_bits());
        assert_eq!(pose.map_from_sensor.translation, again.map_from_sensor.translation);
    }
    assert_eq!(poses.len(), again.len());
}

/// What was read; a refusal names the file, in few words.
fn judged<T>(name: &str, read: Result<T, ReadError>) -> Option<T> {
    read.inspect_err(|error| {
        let message = error.to_string();
        assert!(message.starts_with(name) && message.chars().count() < MESSAGE_MAX, "{message}");
    })
    .ok()
}
