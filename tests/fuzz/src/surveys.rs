//! Surveys, and depth images: what crates of others read, behind checks of ours.

use std::fs;
use std::path::Path;

use mrol_files::survey::{E57Reader, LasReader, SurveyError};
use mrol_files::{DepthImageError, DepthImages};
use mrol_map::scan::Intrinsics;

/// Points of a compressed survey that may come of a byte: those that are alike take next to nothing.
const POINTS_A_BYTE_MAX: usize = 1 << 12;
/// Points of a scan that are read.
const POINTS_MAX: usize = 1 << 20;
/// Bytes of a page of an E57 file, and of them the content, which a checksum follows.
const PAGE_BYTES: usize = 1024;
const CONTENT_BYTES: usize = 1020;
/// Pixels of an image that may come of a byte: zeros shrink to a thousandth.
const PIXELS_A_BYTE_MAX: usize = 1100;
/// Characters of a message, at most: a hostile file does not fill the log.
const MESSAGE_MAX: usize = 1500;

/// A LAS or LAZ file.
pub(super) fn las(bytes: &[u8]) {
    in_file("a.laz", bytes, |path| {
        let mut reader = match LasReader::open(path) {
            Ok(reader) => reader,
            Err(error) => return refused(&error),
        };
        let (claimed, mut read) = (reader.points(), 0);
        loop {
            match reader.next_points() {
                Ok(points) if points.is_empty() => break,
                Ok(points) => read += points.len(),
                Err(error) => return refused(&error),
            }
            assert!(read <= bytes.len() * POINTS_A_BYTE_MAX, "{read} points of {} bytes", bytes.len());
        }
        assert!(read as u64 <= claimed, "{read} of {claimed} points");
    });
}

/// An E57 file, whose checksums are made right.
pub(super) fn e57(bytes: &[u8]) {
    let pages = bytes.chunks(CONTENT_BYTES).flat_map(|content| {
        let mut page = content.to_vec();
        page.resize(CONTENT_BYTES, 0);
        let checksum = crc32c::crc32c(&page).to_be_bytes();
        page.extend(checksum);
        page
    });
    let file: Vec<u8> = pages.collect();
    assert_eq!(file.len() % PAGE_BYTES, 0);
    in_file("a.e57", &file, |path| {
        if let Err(error) = read_e57(path) {
            refused(&error);
        }
    });
}

fn read_e57(path: &Path) -> Result<(), SurveyError> {
    let mut reader = E57Reader::open(path)?;
    for k in 0..reader.scans()?.len() {
        let (mut points, mut read) = (reader.points(k)?, 0);
        loop {
            let part = points.next_points(1 << 12)?.len();
            read += part;
            if part == 0 || read > POINTS_MAX {
                break;
            }
        }
    }
    Ok(())
}

/// A depth image, PNG.
pub(super) fn depth_image(bytes: &[u8]) {
    let images = DepthImages {
        intrinsics: Intrinsics { focal: [525.0; 2], center: [319.5, 239.5] },
        steps_per_m: 1000.0,
    };
    in_file("a.png", bytes, |path| match images.read(path) {
        Ok(points) => {
            assert!(points.len() <= bytes.len() * PIXELS_A_BYTE_MAX);
            assert!(points.iter().all(|point| point.coords.iter().all(|c| c.is_finite()) && point.z >= 0.0));
        }
        Err(error) => check_message(&DepthImageError::to_string(&error)),
    });
}

/// Calls `read` with the path of a file of these bytes, which goes again.
fn in_file(name: &str, bytes: &[u8], read: impl FnOnce(&Path)) {
    let path = std::env::temp_dir().join(format!("mrol-fuzz-{}-{name}", std::process::id()));
    fs::write(&path, bytes).expect("room for temporary files");
    read(&path);
    let _ = fs::remove_file(path);
}

fn refused(error: &SurveyError) {
    check_message(&error.to_string());
}

fn check_message(message: &str) {
    assert!(message.chars().count() < MESSAGE_MAX, "{message}");
}
