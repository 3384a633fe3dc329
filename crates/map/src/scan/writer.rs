//! Writing scans to files.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

use crate::geometry::Point;

/// Writes `points` to `path` as binary little-endian `.ply`: x y z float, in meters.
///
/// # Errors
/// When the file cannot be written.
pub fn write_ply(path: &Path, points: &[Point]) -> io::Result<()> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nend_header\n",
        points.len()
    );
    let mut file = File::create(path)?;
    file.write_all(header.as_bytes())?;
    // A point in memory is a point in the file.
    file.write_all(bytemuck::cast_slice(points))
}

/// Writes `points` to `path` as raw little-endian f32 x y z, in meters.
///
/// # Errors
/// When the file cannot be written.
pub fn write_f32(path: &Path, points: &[Point]) -> io::Result<()> {
    fs::write(path, bytemuck::cast_slice(points))
}
