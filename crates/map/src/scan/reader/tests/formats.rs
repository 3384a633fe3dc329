//! Every format gives the same points, and files are found.

use std::fs;
use std::path::Path;

use super::files::*;
use crate::scan::reader::format::Format;
use crate::scan::{ReadError, read_points, scan_files, write_f32, write_ply};

#[test]
fn every_format_gives_the_same_points() {
    for (extension, bytes) in every_format() {
        assert_same(&read(extension, &bytes).unwrap(), &sample());
    }
}

#[test]
fn what_the_writers_write_is_read_again() {
    let directory = tempfile::tempdir().unwrap();
    let [ply, f32] = ["a.ply", "a.f32"].map(|name| directory.path().join(name));
    for points in [sample(), vec![]] {
        write_ply(&ply, &points).unwrap();
        write_f32(&f32, &points).unwrap();
        assert_same(&read_points(&ply).unwrap(), &points);
        assert_same(&read_points(&f32).unwrap(), &points);
    }
}

#[test]
fn an_unsupported_extension_lists_the_supported_ones() {
    let error = read("las", b"").unwrap_err().to_string();
    assert!(error.contains("\"las\"") && error.contains(".ply .pcd .xyz .npy .bin .f32 .3d"), "{error}");
    assert!(matches!(read_points(Path::new("scan")), Err(ReadError::Extension { .. })));
    assert_eq!(Format::named_by(Path::new("SCAN.PLY")).unwrap(), Format::Ply);
}

#[test]
fn a_directory_gives_its_scan_files_by_name_and_a_file_itself() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    for name in ["b.ply", "a.PLY", "c.pcd", "poses.txt", "SOURCE.md"] {
        fs::write(path(name), b"").unwrap();
    }
    fs::create_dir(path("d.ply")).unwrap();
    let files = scan_files(&[path("c.pcd"), directory.path().to_owned()]).unwrap();
    assert_eq!(files, ["c.pcd", "a.PLY", "b.ply", "c.pcd"].map(path));
    assert!(matches!(scan_files(&[path("poses.txt")]), Err(ReadError::Extension { .. })));
    let error = scan_files(&[path("d.ply")]).unwrap_err().to_string();
    assert!(error.contains("no scan file"), "{error}");
    assert!(matches!(scan_files(&[path("none")]), Err(ReadError::Io { .. })));
}
