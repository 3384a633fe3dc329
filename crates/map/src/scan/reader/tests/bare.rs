//! Bare floats and arrays: rows whose length nobody says.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::files::{comparable, error, npy, read};
use crate::scan::reader::columns::Columns;
use crate::scan::reader::format::Format;

/// A sensor's points in the order in which it turns, each with an intensity.
fn scanner(intensity: impl Fn(&mut ChaCha8Rng, f32) -> f32) -> Vec<[f32; 4]> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let turn = |i: u16| f32::from(i) / 3000.0 * std::f32::consts::TAU;
    let point = |turn: f32| [8.0 * turn.cos(), 5.0 * turn.sin(), -1.0 + 0.2 * (9.0 * turn).sin()];
    let mut row = |turn: f32| {
        let [x, y, z] = point(turn);
        [x, y, z, intensity(&mut random, turn)]
    };
    (0..3000).map(|i| row(turn(i))).collect()
}

fn points(extension: &str, bytes: &[u8]) -> Vec<[f32; 3]> {
    read(extension, bytes).unwrap().iter().map(|point| point.xyz()).collect()
}

fn bytes<const N: usize>(rows: &[[f32; N]]) -> Vec<u8> {
    rows.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn xyz(rows: &[[f32; 4]]) -> Vec<[f32; 3]> {
    rows.iter().map(|[x, y, z, _]| [*x, *y, *z]).collect()
}

fn by(format: Format, bytes: &[u8], columns: &str) -> Vec<[f32; 3]> {
    let columns: Columns = columns.parse().unwrap();
    let points: Vec<crate::geometry::Point> = format.points(bytes, Some(columns)).unwrap();
    points.iter().map(|point| point.xyz()).collect()
}

#[test]
fn bare_floats_with_intensities_are_no_points() {
    let kinds = [
        scanner(|random, _| random.random_range(0.0..1.0)),
        scanner(|random, _| f32::from(random.random_range(0..=255u8))),
        scanner(|_, _| 0.0),
        // Told by the steps alone.
        scanner(|_, turn| -40.0 + 3.0 * (5.0 * turn).sin()),
    ];
    for (kind, rows) in kinds.iter().enumerate() {
        let mut orders = vec![rows.clone()];
        if kind < 3 {
            let mut mixed = rows.clone();
            mixed.shuffle(&mut ChaCha8Rng::seed_from_u64(2));
            orders.push(mixed);
        }
        for rows in orders {
            let refused = error("f32", &bytes(&rows));
            let expected =
                "the numbers look like rows of 4 (x y z i), not of 3 (x y z): give --columns \"x y z i\", or";
            assert!(refused.contains(expected), "{kind}: {refused}");
            assert_eq!(points("bin", &bytes(&rows)), xyz(&rows), "{kind}");
            assert_eq!(by(Format::F32, &bytes(&rows), "x y z i"), xyz(&rows));
            assert_eq!(by(Format::F32, &bytes(&rows), "x y z").len(), 4000);
        }
        // A length that divides by 16 alone.
        let refused = error("f32", &bytes(&rows[..2999]));
        assert!(refused.contains("they may be rows of 4 numbers: give --columns \"x y z i\""), "{refused}");
        let refused = error("bin", &bytes(&xyz(rows)));
        assert!(refused.contains("look like rows of 3"), "{refused}");
    }
}

#[test]
fn bare_floats_of_points_are_not_taken_for_others() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let ordered = xyz(&scanner(|_, _| 0.0));
    let mut mixed = ordered.clone();
    mixed.shuffle(&mut random);
    let positive: Vec<[f32; 3]> = ordered.iter().map(|point| point.map(f32::abs)).collect();
    let small: Vec<[f32; 3]> = (0..3000).map(|_| [(); 3].map(|()| random.random_range(0.0..1.0))).collect();
    let lost = vec![[f32::NAN; 3]; 60];
    for rows in [ordered, mixed, positive, small, vec![[0.0; 3]; 60], lost, Vec::new()] {
        let read = points("f32", &bytes(&rows));
        let bits = |points: &[[f32; 3]]| points.iter().map(|point| point.map(comparable)).collect::<Vec<_>>();
        assert_eq!(bits(&read), bits(&rows));
    }
}

#[test]
fn columns_are_those_that_are_named() {
    let rows = [[9.0, 1.0, 2.0, 3.0, 8.0], [9.0, 4.0, 5.0, 6.0, 8.0]];
    let expected = [[3.0, 1.0, 2.0], [6.0, 4.0, 5.0]];
    for format in [Format::F32, Format::Bin] {
        assert_eq!(by(format, &bytes(&rows), "t y z x i"), expected);
    }
    assert_eq!(by(Format::Npy, &npy("<f4", false, "(2, 5)", &bytes(&rows)), "t,y,z,x,i"), expected);
    assert_eq!(by(Format::Xyz, b"9 1 2 3 8\n9 4 5 6 8\n", "t y z x i"), expected);
    let of_ply = Format::Ply.points::<crate::geometry::Point>(b"ply\n", "x y z".parse().ok());
    assert!(of_ply.is_err_and(|problem| format!("{problem:?}").contains("leave --columns out")));
    for bad in ["", "x y", "x y z z", "x y z x"] {
        let refused = bad.parse::<Columns>().unwrap_err().to_string();
        assert!(refused.contains("columns must name x, y and z once each"), "{refused}");
    }
}

#[test]
fn arrays_of_numpy_are_read() {
    let numbers = [1i8, 2, 3, 4, 5, 6];
    let expected = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    let of = |f: &dyn Fn(i8) -> Vec<u8>| numbers.iter().flat_map(|n| f(*n)).collect::<Vec<u8>>();
    let kinds: [(&str, Vec<u8>); 7] = [
        ("<f4", of(&|n| f32::from(n).to_le_bytes().to_vec())),
        (">f4", of(&|n| f32::from(n).to_be_bytes().to_vec())),
        ("<f8", of(&|n| f64::from(n).to_le_bytes().to_vec())),
        (">f8", of(&|n| f64::from(n).to_be_bytes().to_vec())),
        ("<i2", of(&|n| i16::from(n).to_le_bytes().to_vec())),
        (">i4", of(&|n| i32::from(n).to_be_bytes().to_vec())),
        ("|u1", of(&|n| vec![n as u8])),
    ];
    for (descr, data) in kinds {
        for shape in ["(2, 3)", "(2, 1, 3)", "(1, 2, 3)"] {
            assert_eq!(points("npy", &npy(descr, false, shape, &data)), expected, "{descr} {shape}");
        }
    }
    let by_columns: Vec<u8> = [1f32, 4.0, 2.0, 5.0, 3.0, 6.0].iter().flat_map(|n| n.to_le_bytes()).collect();
    assert_eq!(points("npy", &npy("<f4", true, "(2, 3)", &by_columns)), expected);
    assert_eq!(points("npy", &npy("<i2", false, "(1, 3)", &[0xff, 0xff, 2, 0, 3, 0])), [[-1.0, 2.0, 3.0]]);
    // Of three indices the first runs fastest: element (i, j, k) is number i + 2 j + 4 k.
    let cube: Vec<u8> = (0..12u8).flat_map(|n| f32::from(n).to_le_bytes()).collect();
    let read = points("npy", &npy("<f4", true, "(2, 2, 3)", &cube));
    assert_eq!(read, [[0.0, 4.0, 8.0], [2.0, 6.0, 10.0], [1.0, 5.0, 9.0], [3.0, 7.0, 11.0]]);
}

#[test]
fn what_is_no_array_of_points_is_refused() {
    for (file, expected) in [
        (npy("<f4", false, "(3, 2)", &[0; 24]), "shape [3, 2]"),
        (npy("<f4", false, "(3, 100)", &[0; 1200]), "shape [3, 100]"),
        (npy("<f4", false, "()", &[0; 4]), "shape []"),
        (
            npy("<f4", false, "(3, 3)", &[0; 24]),
            "declares 3 points of at least 12 bytes each, but 24 bytes follow",
        ),
        (npy("<f4", false, "(18446744073709551615, 18446744073709551615, 3)", &[]), "fits into no file"),
        (npy("<f4", false, "(9999999999999, 3)", &[]), "9999999999999 points"),
        (npy("<c16", false, "(1, 3)", &[0; 48]), "an array of"),
        (npy("<f2", false, "(1, 3)", &[0; 6]), "numbers x y z are needed"),
        (npy("[('x', '<f4'), ('y', '<f4')]", false, "(1,)", &[0; 8]), "numpy.column_stack makes one"),
        (b"\x93NUMPY".to_vec(), "no array of numpy"),
        (b"\x93NUMPY\x01\x00\xff\xff".to_vec(), "cut short"),
        (b"PK\x03\x04".to_vec(), "no array of numpy"),
    ] {
        let refused = error("npy", &file);
        assert!(refused.contains(expected), "{refused} should contain {expected}");
    }
}
