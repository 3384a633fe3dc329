//! Real scans as bare floats: what is read as something else is refused.

use mrol::geometry::Point;
use mrol::scan::read_points;

use crate::support::shared_scans::{SETS, open};

/// x y z and an intensity, as scanners write them.
fn with_intensities(points: &[Point]) -> Vec<u8> {
    let rows = points.iter().enumerate().flat_map(|(i, point)| {
        let [x, y, z] = point.xyz();
        [x, y, z, (i * 37 % 100) as f32 / 100.0]
    });
    rows.flat_map(f32::to_le_bytes).collect()
}

#[test]
fn scans_with_intensities_are_refused_as_points_and_read_as_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    for set in SETS.into_iter().filter_map(open) {
        for k in [0, set.files.len() - 1] {
            let points = set.points(k);
            // A length that divides by 12 as well: otherwise it is refused for that.
            let points = &points[..points.len() / 3 * 3];
            let [bin, f32] = ["scan.bin", "scan.f32"].map(|name| folder.path().join(name));
            std::fs::write(&bin, with_intensities(points)).unwrap();
            std::fs::write(&f32, with_intensities(points)).unwrap();
            let bits =
                |points: &[Point]| points.iter().map(|p| p.xyz().map(f32::to_bits)).collect::<Vec<_>>();
            assert_eq!(bits(&read_points(&bin).unwrap()), bits(points), "{} {k}", set.name);
            let refused = read_points(&f32).unwrap_err().to_string();
            assert!(refused.contains("look like rows of 4 (x y z i)"), "{} {k}: {refused}", set.name);
            // And points alone are no rows of anything else.
            std::fs::write(&f32, bytemuck::cast_slice(points)).unwrap();
            assert_eq!(bits(&read_points(&f32).unwrap()), bits(points), "{} {k}", set.name);
        }
    }
}
