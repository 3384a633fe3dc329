//! Truncated, corrupt and hostile files.

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::files::*;
use crate::geometry::Point;
use crate::scan::reader::format::Format;
use crate::scan::reader::supported::EXTENSIONS;

#[test]
fn a_file_cut_anywhere_is_an_error_or_fewer_points_but_never_a_panic() {
    for (extension, bytes) in every_format() {
        let format = Format::named_by(Path::new(&format!("a.{extension}"))).unwrap();
        for end in 0..bytes.len() {
            if let Ok(points) = format.points::<Point>(&bytes[..end], None) {
                let declared = matches!(format, Format::Ply | Format::Pcd | Format::Npy);
                let last_line = end + 8 > bytes.len();
                assert!(!declared || last_line, "{end} of {} bytes of {extension}", bytes.len());
                assert!(points.len() <= sample().len());
            }
        }
    }
}

#[test]
fn garbage_in_any_place_never_panics() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (extension, bytes) in every_format() {
        let format = Format::named_by(Path::new(&format!("a.{extension}"))).unwrap();
        for _ in 0..2000 {
            let mut broken = bytes.clone();
            // Mostly in the header, where a byte does most harm.
            let end = if rng.random_bool(0.7) { bytes.len().min(300) } else { bytes.len() };
            for _ in 0..rng.random_range(1..6) {
                broken[rng.random_range(0..end)] = garbage(&mut rng);
            }
            let _ = format.points::<Point>(&broken, None);
        }
    }
}

/// A byte, a digit as often as any other, so that counts grow.
fn garbage(rng: &mut ChaCha8Rng) -> u8 {
    if rng.random_bool(0.5) { rng.random_range(b'0'..=b'9') } else { rng.random() }
}

#[test]
fn bytes_of_no_format_never_panic() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for extension in EXTENSIONS {
        let format = Format::named_by(Path::new(&format!("a{extension}"))).unwrap();
        for length in 0..500 {
            let bytes: Vec<u8> = (0..length).map(|_| rng.random()).collect();
            let _ = format.points::<Point>(&bytes, None);
        }
    }
}

#[test]
fn a_header_that_declares_more_than_the_file_holds_is_refused_before_anything_is_allocated() {
    for count in ["51", "99999999", "100000001", "1000000000000", "18446744073709551615"] {
        for (extension, bytes) in every_format().into_iter().filter(|(e, _)| ["ply", "pcd"].contains(e)) {
            let text = bytes.iter().map(|b| *b as char).collect::<String>();
            let text = text.replace("vertex 50", &format!("vertex {count}"));
            let text = text.replace("POINTS 50", &format!("POINTS {count}"));
            let bytes: Vec<u8> = text.chars().map(|c| c as u8).collect();
            let error = error(extension, &bytes);
            assert!(error.contains(count) || error.contains("50 of 51"), "{error}");
        }
    }
}

#[test]
fn compressed_sizes_that_contradict_the_header_are_refused() {
    let bytes = compressed_pcd();
    let sizes = pcd_header("binary_compressed").len();
    for (at, value) in [(0, u32::MAX), (0, 0), (0, 3), (4, u32::MAX), (4, 0), (4, 1099)] {
        let mut broken = bytes.clone();
        broken[sizes + at..sizes + at + 4].copy_from_slice(&value.to_le_bytes());
        let error = error("pcd", &broken);
        assert!(error.contains("compressed data") || error.contains("LZF"), "{error}");
    }
}
