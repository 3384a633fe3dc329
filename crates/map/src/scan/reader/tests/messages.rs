//! What the errors say.

use super::files::*;

#[test]
fn an_error_names_line_or_element_and_what_is_needed() {
    let ply = |from: &str, to: &str| {
        error("ply", String::from_utf8(mixed_ascii_ply()).unwrap().replacen(from, to, 1).as_bytes())
    };
    for (error, expected) in [
        (error("xyz", b"1 2 3\n# c\n4 5\n"), "scan.xyz:3: 2 columns, x y z are needed"),
        (error("xyz", b"1,2,3\n1,,2,3\n"), "scan.xyz:2: \"\" is not a number"),
        (error("xyz", b"X Y W\n"), "scan.xyz:1: \"X\" is not a number (a comment starts with #)"),
        (error("xyz", b"1 2 3\n\xff\xfe\n"), "scan.xyz:2: not text"),
        (error("f32", &[0; 30]), "30 bytes are not whole points of 12 bytes, point 2"),
        (error("ply", b"solid\n"), "scan.ply:1: not a ply header"),
        (error("ply", b""), "not a ply header"),
        (ply("element vertex 50", "element vertex -4"), "\"element vertex -4"),
        (
            ply("property float x", "property int x"),
            "scan.ply:8: property \"x\": it is Int, float or double is needed",
        ),
        (ply("property float x", "property float u"), "no property x"),
        (ply("property double y", "property double x"), "property x twice"),
        (ply("element camera", "element face"), "twice"),
        (ply("element vertex", "element points"), "no element vertex"),
        (ply("0.6666667", "oops"), "scan.ply:18: \"oops\" is not a number"),
        (error("pcd", b"VERSION 0.7\n"), "not a pcd header"),
    ] {
        assert!(error.contains(expected), "{error:?} should contain {expected:?}");
    }
}

#[test]
fn a_pcd_error_names_the_field_or_the_point() {
    let pcd = |from: &str, to: &str| {
        error("pcd", String::from_utf8(ascii_pcd()).unwrap().replacen(from, to, 1).as_bytes())
    };
    for (error, expected) in [
        (pcd("FIELDS rgb x", "FIELDS rgb u"), "no field x"),
        (pcd("SIZE 4 4 8", "SIZE 4 2 8"), "field x is 1 of type F and size 2"),
        (pcd("COUNT 1 1 1 1 2", "COUNT 1 1 3 1 2"), "field y is 3 of type F and size 8"),
        (pcd("COUNT 1 1 1 1 2", "COUNT 18446744073709551615 1 1 1 18446744073709551615"), "2^64"),
        (pcd("0.6666667", "oops"), "scan.pcd:14: point 2 of 50: \"oops\" is not a number"),
        (pcd("0.6666667", ""), "point 2 of 50: fewer values"),
    ] {
        assert!(error.contains(expected), "{error:?} should contain {expected:?}");
    }
}

#[test]
fn a_message_repeats_only_the_start_of_a_long_line() {
    let long = "a".repeat(1_000_000);
    for extension in ["xyz", "ply", "pcd"] {
        assert!(error(extension, format!("ply\n{long}\n").as_bytes()).len() < 1000);
    }
}
