//! Arrays of numpy, read and written.

use std::io::{Cursor, Write};

use mrol_files::npz::{NpzContent, NpzReader, VoxelArrays};
use mrol_map::map::MapOrigin;
use mrol_map::voxel::{INDEX_MAX, INDEX_MIN, VoxelKey, VoxelSet};
use proptest::prelude::*;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::support::{fixture, random};

fn written(keys: &[VoxelKey], origin: Option<MapOrigin>) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let arrays = VoxelArrays { keys, resolution_m: 0.25, origin, level: 3, revision: 9 };
    arrays.write(&mut file, |_| {}).unwrap();
    file.into_inner()
}

fn voxels_of(bytes: &[u8], coarser: u32) -> Result<VoxelSet, String> {
    let mut reader = NpzReader::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
    reader.read_voxels(coarser, |_| {}).map_err(|error| error.to_string())
}

fn points_of(bytes: &[u8]) -> Result<Vec<[f64; 3]>, String> {
    let mut reader = NpzReader::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
    let mut points = Vec::new();
    reader.read_points(|part, _| points.extend_from_slice(part)).map_err(|error| error.to_string())?;
    Ok(points)
}

/// The voxels of the fixtures.
fn of_fixtures() -> Vec<VoxelKey> {
    (0..30).map(|k| VoxelKey::new([k % 5 - 2, -k, 3 * k - 40]).unwrap()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn voxels_come_back(
        indices in prop::collection::vec(prop::array::uniform3(INDEX_MIN..=INDEX_MAX), 0..200),
        origin_m: Option<[i32; 3]>,
    ) {
        let voxels: VoxelSet = indices.into_iter().map(|index| VoxelKey::new(index).unwrap()).collect();
        let keys: Vec<VoxelKey> = voxels.iter().collect();
        let origin = origin_m.map(|at| MapOrigin::new(at.map(f64::from)).unwrap());
        let bytes = written(&keys, origin);
        let reader = NpzReader::new(Cursor::new(&bytes)).unwrap();
        prop_assert_eq!(reader.content, NpzContent::Voxels { resolution_m: 0.25 });
        prop_assert_eq!(reader.origin_m, origin.map_or([0.0; 3], |origin| origin.position_m));
        prop_assert_eq!(voxels_of(&bytes, 0).unwrap(), voxels);
        let coarse: VoxelSet = keys.iter().map(|key| key.ancestor(2)).collect();
        prop_assert_eq!(voxels_of(&bytes, 2).unwrap(), coarse);
    }
}

#[test]
fn more_rows_than_are_read_at_once_come_back() {
    let keys: Vec<VoxelKey> = (0..40_000).map(|k| VoxelKey::new([k, -k, k % 100]).unwrap()).collect();
    let bytes = written(&keys, None);
    assert_eq!(voxels_of(&bytes, 0).unwrap(), keys.iter().copied().collect());
    let points = points_of(&bytes).unwrap();
    assert_eq!((points.len(), points[39_999]), (40_000, [9999.875, -9999.625, 24.875]));
}

#[test]
fn arrays_that_numpy_wrote_are_read_of_every_type_and_compressed() {
    let expected: VoxelSet = of_fixtures().into_iter().collect();
    for (name, origin_m) in [("wide.npz", [1000.0, 2000.0, -5.0]), ("compressed.npz", [0.0; 3])] {
        let bytes = fixture(name);
        assert_eq!(voxels_of(&bytes, 0).unwrap(), expected, "{name}");
        assert_eq!(NpzReader::new(Cursor::new(&bytes)).unwrap().origin_m, origin_m, "{name}");
    }
    let bytes = fixture("points.npz");
    assert_eq!(NpzReader::new(Cursor::new(&bytes)).unwrap().content, NpzContent::Points);
    let points = points_of(&bytes).unwrap();
    assert_eq!((points.len(), points[1]), (30, [999.875, 1999.875, -14.125]));
    let by_columns = points_of(&fixture("by_columns.npz")).unwrap_err();
    assert!(
        by_columns.contains("array points: shape [30, 3] by columns, where (n, 3) by rows"),
        "{by_columns}"
    );
}

#[test]
fn a_file_that_is_cut_off_anywhere_is_refused() {
    for name in ["wide.npz", "compressed.npz"] {
        let bytes = fixture(name);
        for length in 0..bytes.len() {
            let refused = voxels_of(&bytes[..length], 0).expect_err("a part of an archive is none");
            assert!(
                refused.starts_with("no .npz of numpy: ") || refused.starts_with("it has neither"),
                "{refused}"
            );
        }
    }
}

#[test]
fn a_file_with_changed_bytes_is_refused_or_has_no_more_voxels_than_rows() {
    let mut state = 1;
    let mut refused = 0;
    for name in ["wide.npz", "compressed.npz"] {
        let bytes = fixture(name);
        for _ in 0..3000 {
            let mut changed = bytes.clone();
            let at = random(&mut state) as usize % changed.len();
            changed[at] ^= 1 << (random(&mut state) % 8);
            match voxels_of(&changed, 0) {
                Ok(voxels) => assert!(voxels.len() <= 30),
                Err(error) => {
                    refused += 1;
                    assert!(error.len() < 1000, "{error}");
                }
            }
        }
    }
    assert!(refused > 100, "{refused} refused");
}

/// An archive of arrays, each of which is its name, type, shape and numbers.
fn archive(arrays: &[(&str, &str, &str, &[u8])]) -> Vec<u8> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, descr, shape, numbers) in arrays {
        archive.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
        archive.write_all(b"\x93NUMPY\x01\x00").unwrap();
        archive.write_all(&(header.len() as u16).to_le_bytes()).unwrap();
        archive.write_all(header.as_bytes()).unwrap();
        archive.write_all(numbers).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

#[test]
fn what_is_no_map_is_named() {
    assert!(voxels_of(b"not a zip", 0).unwrap_err().starts_with("no .npz of numpy: "));
    let one = 1.0_f64.to_le_bytes();
    let lacking =
        voxels_of(&archive(&[("indexes", "<f8", "()", &one), ("resolution", "<f8", "()", &one)]), 0);
    assert!(lacking.unwrap_err().contains("it has indexes.npy, resolution.npy"));
    let side = f64::NAN.to_le_bytes();
    let no_side =
        voxels_of(&archive(&[("indices", "<f8", "(0, 3)", &[]), ("resolution", "<f8", "()", &side)]), 0);
    assert_eq!(no_side.unwrap_err(), "resolution NaN m: that of a map is 0.001 to 100 m");
    for (index, told) in [([1e9, 0.0, 0.0], "1000000000.0"), ([0.5, 0.0, 0.0], "0.5"), ([f64::NAN; 3], "NaN")]
    {
        let numbers = index.map(f64::to_le_bytes);
        let bytes = archive(&[
            ("indices", "<f8", "(1, 3)", numbers.as_flattened()),
            ("resolution", "<f8", "()", &one),
        ]);
        let refused = voxels_of(&bytes, 0).unwrap_err();
        assert!(refused.starts_with("array indices, row 0: [") && refused.contains(told), "{refused}");
    }
    let text =
        voxels_of(&archive(&[("indices", "<U3", "(1, 3)", &[0; 36]), ("resolution", "<f8", "()", &one)]), 0);
    assert!(text.unwrap_err().starts_with("array indices: an array of "));
}

#[test]
fn a_claim_of_two_billion_rows_takes_no_memory_and_is_cut_off() {
    let one = 1.0_f64.to_le_bytes();
    let bytes =
        archive(&[("indices", "<i4", "(2147483648, 3)", &[0; 24]), ("resolution", "<f8", "()", &one)]);
    assert_eq!(
        voxels_of(&bytes, 0).unwrap_err(),
        "array indices: it ends after 2 of the 2147483648 rows that its header names: it was cut off"
    );
}
