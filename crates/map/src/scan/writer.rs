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
    write(path, &header, points)
}

/// Writes `points` to `path` as binary little-endian `.pcd`, unorganized: x y z float, in meters.
///
/// # Errors
/// When the file cannot be written.
pub fn write_pcd(path: &Path, points: &[Point]) -> io::Result<()> {
    let header = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n\
         WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
        points.len()
    );
    write(path, &header, points)
}

fn write(path: &Path, header: &str, points: &[Point]) -> io::Result<()> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::read_points;

    #[test]
    fn what_is_written_is_read_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        for count in [0_u16, 1, 1000] {
            let point = |k: u16| {
                let k = f32::from(k);
                Point::new(0.1 * k, -1e-7 * k, 12345.678 - k)
            };
            let points: Vec<Point> = (0..count).map(point).collect();
            type Write = fn(&Path, &[Point]) -> io::Result<()>;
            for (name, write) in [("a.ply", write_ply as Write), ("a.pcd", write_pcd), ("a.f32", write_f32)] {
                let path = folder.path().join(name);
                write(&path, &points).unwrap();
                assert_eq!(read_points(&path).unwrap(), points, "{count} points of {name}");
            }
        }
    }
}
