//! Files of every format, built byte by byte.

use std::fs;

use crate::geometry::Point;
use crate::scan::{ReadError, read_points, write_ply};

/// Points with every kind of number that must survive: fractions, exponents, "no return".
pub(super) fn sample() -> Vec<Point> {
    let mut points: Vec<Point> =
        (0..50).map(|i| Point::new(i as f32 / 3.0, -0.1 * i as f32, 1e-7 * i as f32)).collect();
    points[7] = Point::new(f32::NAN, f32::NAN, f32::NAN);
    points[8] = Point::new(f32::INFINITY, f32::NEG_INFINITY, 0.0);
    points
}

pub(super) fn assert_same(read: &[Point], expected: &[Point]) {
    let bits = |points: &[Point]| points.iter().map(|p| p.xyz().map(comparable)).collect::<Vec<_>>();
    assert_eq!(bits(read), bits(expected));
}

/// Bits that make every NaN equal.
pub(super) fn comparable(c: f32) -> u32 {
    if c.is_nan() { u32::MAX } else { c.to_bits() }
}

pub(super) fn read(extension: &str, bytes: &[u8]) -> Result<Vec<Point>, ReadError> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(format!("scan.{extension}"));
    fs::write(&path, bytes).unwrap();
    read_points(&path)
}

pub(super) fn error(extension: &str, bytes: &[u8]) -> String {
    let error = read(extension, bytes).unwrap_err().to_string();
    assert!(error.contains(&format!("scan.{extension}")), "{error}");
    error
}

pub(super) fn text_lines(points: &[Point], prefix: &str, suffix: &str) -> String {
    let line = |point: &Point| {
        let [x, y, z] = point.xyz();
        format!("{prefix}{x} {y} {z}{suffix}\n")
    };
    points.iter().map(line).collect()
}

/// Other properties around the coordinates, a double among them, and an element before the vertices.
pub(super) fn mixed_ply(format: &str, entry: impl Fn(&Point) -> Vec<u8>, before: &[u8]) -> Vec<u8> {
    let points = sample();
    let header = format!(
        "ply\r\nformat {format} 1.0\r\ncomment made by a test\r\nelement camera 1\r\nproperty list uchar int v\r\n\
         element vertex {}\r\nproperty uchar red\r\nproperty float x\r\nproperty double y\r\nproperty float z\r\n\
         property list uchar short tags\r\nelement face 0\r\nproperty list uchar int vertex_indices\r\n\
         end_header\r\n",
        points.len()
    );
    [header.as_bytes(), before, &points.iter().flat_map(entry).collect::<Vec<u8>>()].concat()
}

pub(super) fn mixed_ascii_ply() -> Vec<u8> {
    let entry = |p: &Point| text_lines(&[*p], "200 ", " 2 -1 5").into_bytes();
    mixed_ply("ascii", entry, b"3 1 2 3\r\n")
}

pub(super) fn mixed_little_endian_ply() -> Vec<u8> {
    let entry = |p: &Point| {
        let [x, y, z] = p.xyz();
        let y = f64::from(y).to_le_bytes();
        [&[200], &x.to_le_bytes()[..], &y, &z.to_le_bytes(), &[1, 5, 0]].concat()
    };
    mixed_ply("binary_little_endian", entry, &[1, 9, 0, 0, 0])
}

pub(super) fn mixed_big_endian_ply() -> Vec<u8> {
    let entry = |p: &Point| {
        let [x, y, z] = p.xyz();
        let y = f64::from(y).to_be_bytes();
        [&[200], &x.to_be_bytes()[..], &y, &z.to_be_bytes(), &[1, 0, 5]].concat()
    };
    mixed_ply("binary_big_endian", entry, &[1, 0, 0, 0, 9])
}

pub(super) fn packed_ply() -> Vec<u8> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scan.ply");
    write_ply(&path, &sample()).unwrap();
    fs::read(path).unwrap()
}

pub(super) fn pcd_header(kind: &str) -> Vec<u8> {
    let points = sample().len();
    format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z _\nSIZE 4 4 8 4 1\nTYPE U F F F U\nCOUNT 1 1 1 1 2\n\
         WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {kind}\n"
    )
    .into_bytes()
}

pub(super) fn ascii_pcd() -> Vec<u8> {
    [pcd_header("ascii"), text_lines(&sample(), "1234 ", " 0 0").into_bytes()].concat()
}

pub(super) fn binary_pcd() -> Vec<u8> {
    let entry = |p: &Point| {
        let [x, y, z] = p.xyz();
        let y = f64::from(y).to_le_bytes();
        [&[1, 2, 3, 4], &x.to_le_bytes()[..], &y, &z.to_le_bytes(), &[0, 0]].concat()
    };
    [pcd_header("binary"), sample().iter().flat_map(entry).collect()].concat()
}

/// Columns one after another, then LZF of literal runs alone.
pub(super) fn compressed_pcd() -> Vec<u8> {
    let points = sample();
    let mut columns: Vec<u8> = [1, 2, 3, 4].repeat(points.len());
    columns.extend(points.iter().flat_map(|p| p.xyz()[0].to_le_bytes()));
    columns.extend(points.iter().flat_map(|p| f64::from(p.xyz()[1]).to_le_bytes()));
    columns.extend(points.iter().flat_map(|p| p.xyz()[2].to_le_bytes()));
    columns.extend([0, 0].repeat(points.len()));
    let lzf: Vec<u8> = columns.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
    let sizes = [lzf.len() as u32, columns.len() as u32].map(u32::to_le_bytes).concat();
    [pcd_header("binary_compressed"), sizes, lzf].concat()
}

pub(super) fn xyz() -> Vec<u8> {
    format!("# x y z\n\n{}", text_lines(&sample(), "  ", " 0.5")).into_bytes()
}

/// A file of numpy.
pub(super) fn npy(descr: &str, is_by_columns: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if is_by_columns { "True" } else { "False" };
    let descr = if descr.starts_with('[') { descr.to_owned() } else { format!("'{descr}'") };
    let header = format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
}

/// Bare floats x y z and an intensity.
fn with_intensities() -> Vec<u8> {
    let rows =
        sample().into_iter().flat_map(|point| point.xyz().into_iter().chain([0.5]).collect::<Vec<f32>>());
    rows.flat_map(f32::to_le_bytes).collect()
}

pub(super) fn every_format() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("ply", mixed_ascii_ply()),
        ("ply", mixed_little_endian_ply()),
        ("ply", mixed_big_endian_ply()),
        ("ply", packed_ply()),
        ("pcd", ascii_pcd()),
        ("pcd", binary_pcd()),
        ("pcd", compressed_pcd()),
        ("xyz", xyz()),
        ("npy", npy("<f4", false, "(50, 3)", bytemuck::cast_slice(&sample()))),
        ("bin", with_intensities()),
        ("f32", bytemuck::cast_slice(&sample()).to_vec()),
    ]
}
