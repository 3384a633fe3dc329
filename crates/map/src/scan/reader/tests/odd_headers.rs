//! Headers as other programs write them.

use super::files::*;

/// `bytes` with the first `from` replaced by `to`; what is not text stays.
fn with(bytes: &[u8], from: &str, to: &[u8]) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|window| window == from.as_bytes());
    let at = at.unwrap_or_else(|| panic!("{from:?} is not in the file"));
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

#[track_caller]
fn assert_reads(extension: &str, bytes: &[u8]) {
    match read(extension, bytes) {
        Ok(points) => assert_same(&points, &sample()),
        Err(error) => panic!("{error}: {}", String::from_utf8_lossy(&bytes[..bytes.len().min(400)])),
    }
}

#[test]
fn a_field_of_count_0_takes_no_value() {
    for bytes in [ascii_pcd(), binary_pcd(), compressed_pcd()] {
        let padded = with(&bytes, "FIELDS rgb x", b"FIELDS _ rgb _ x");
        let padded = with(&padded, "SIZE 4 4", b"SIZE 1 4 8 4");
        let padded = with(&padded, "TYPE U F", b"TYPE U U F F");
        let padded = with(&padded, "COUNT 1 1", b"COUNT 0 1 0 1");
        assert_reads("pcd", &padded);
        let last = with(&bytes, "y z _\n", b"y z _ _\n");
        let last = with(&last, "8 4 1\n", b"8 4 1 4\n");
        let last = with(&last, "F F U\n", b"F F U U\n");
        assert_reads("pcd", &with(&last, "1 1 2\n", b"1 1 2 0\n"));
    }
}

#[test]
fn pcd_headers_of_other_programs_are_read() {
    for bytes in [ascii_pcd(), binary_pcd(), compressed_pcd()] {
        assert_reads("pcd", &with(&bytes, "FIELDS rgb x y z", b"FIELDS RGB X Y Z"));
        assert_reads("pcd", &with(&bytes, "FIELDS", b"COLUMNS"));
        assert_reads("pcd", &with(&bytes, "VERSION 0.7\n", b""));
        assert_reads("pcd", &with(&bytes, "VERSION 0.7", b"VERSION 1.0"));
        assert_reads("pcd", &with(&bytes, "POINTS 50\n", b""));
        assert_reads("pcd", &with(&with(&bytes, "POINTS 50\n", b""), "HEIGHT 1\n", b""));
        assert_reads("pcd", &with(&with(&bytes, "WIDTH 50\n", b""), "HEIGHT 1\n", b""));
        assert_reads("pcd", &with(&bytes, "VIEWPOINT 0 0 0 1 0 0 0\n", b""));
        assert_reads("pcd", &with(&bytes, "VERSION 0.7\n", b"\n  \r\nVERSION .7\r\n"));
        assert_reads("pcd", &with(&bytes, "# .PCD v0.7\n", b"\xef\xbb\xbf# .PCD v0.7 Geb\xe4ude\n"));
        // Fields that are skipped may be of any size.
        let wide = with(&bytes, "rgb x y z _\nSIZE 4", b"Intensit\xe4t x y z _\nSIZE 2");
        assert_reads("pcd", &with(&wide, "COUNT 1", b"COUNT 2").replaced_values());
    }
    let swapped = with(&ascii_pcd(), "DATA ascii\n", b"DATA ASCII\n\n\n");
    assert_reads("pcd", &swapped);
}

/// Two values of two bytes in the place of one of four: two tokens in text, the same bytes otherwise.
trait ReplacedValues {
    fn replaced_values(self) -> Vec<u8>;
}

impl ReplacedValues for Vec<u8> {
    fn replaced_values(self) -> Vec<u8> {
        match self.windows(10).any(|window| window == b"DATA ascii") {
            true => String::from_utf8_lossy(&self).replace("1234 ", "12 34 ").into_bytes(),
            false => self,
        }
    }
}

#[test]
fn fields_without_counts_have_one_value() {
    let one =
        |bytes: &[u8]| with(&with(bytes, "COUNT 1 1 1 1 2\n", b""), "SIZE 4 4 8 4 1", b"SIZE 4 4 8 4 2");
    assert_reads("pcd", &one(&binary_pcd()));
    assert_reads("pcd", &one(&compressed_pcd()));
}

#[test]
fn ply_headers_of_other_programs_are_read() {
    for bytes in [mixed_ascii_ply(), mixed_little_endian_ply(), mixed_big_endian_ply()] {
        for name in [
            "scalar_Coord._Z",
            "scalar_Intensity_(dB)",
            "2nd_return",
            "a/b",
            "gps time",
            "gr\u{fc}n",
            "-",
            "x.y",
        ] {
            assert_reads("ply", &with(&bytes, "uchar red", format!("uchar {name}").as_bytes()));
        }
        assert_reads("ply", &with(&bytes, "uchar red", b"uchar gr\xfcn"));
        assert_reads("ply", &with(&bytes, "made by a test", b"Geb\xe4ude in M\xfcnchen"));
        assert_reads("ply", &with(&bytes, "comment made by a test", b"obj_info num_cols 5.\r\ncomment"));
        assert_reads("ply", &with(&bytes, "comment made by a test\r\n", b"\r\n"));
        assert_reads("ply", &with(&bytes, "camera 1", b"2nd.camera 1"));
        assert_reads("ply", &with(&with(&bytes, "float x", b"float X"), "double y", b"float64 Y"));
        assert_reads("ply", &with(&bytes, "int vertex_indices", b"int 3.corners"));
        assert_reads("ply", &with(&bytes, "ply\r\n", b"\xef\xbb\xbfply \r\n"));
    }
}

#[test]
fn a_ply_header_may_end_its_lines_with_cr_alone() {
    for bytes in [mixed_ascii_ply(), mixed_little_endian_ply(), mixed_big_endian_ply()] {
        let end = bytes.windows(12).position(|window| window == b"end_header\r\n").unwrap() + 12;
        let header = String::from_utf8_lossy(&bytes[..end]).replace("\r\n", "\r");
        assert_reads("ply", &[header.as_bytes(), &bytes[end..]].concat());
    }
    // The first byte of the data is that of a line feed.
    let header =
        b"ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar i\rproperty float x\r\
        property float y\rproperty float z\rend_header\r";
    let data = [&[10u8][..], &1f32.to_le_bytes(), &2f32.to_le_bytes(), &3f32.to_le_bytes()].concat();
    assert_same(&read("ply", &[&header[..], &data].concat()).unwrap(), &[[1.0, 2.0, 3.0].into()]);
}

#[test]
fn types_that_nothing_is_known_of_are_skipped_in_ascii() {
    let bytes = mixed_ascii_ply();
    for name in ["int64", "half", "real", "string", "uint128"] {
        assert_reads("ply", &with(&bytes, "uchar red", format!("{name} red").as_bytes()));
        assert_reads(
            "ply",
            &with(&bytes, "list uchar short tags", format!("list {name} {name} tags").as_bytes()),
        );
    }
    assert_reads("ply", &with(&bytes, "end_header\r\n", b"end_header\r\n\r\n\n"));
    let error = error("ply", &with(&mixed_little_endian_ply(), "uchar red", b"string red"));
    assert!(error.contains("scan.ply:7: ") && error.contains("\"string\""), "{error}");
}

#[test]
fn wide_properties_that_are_skipped_are_read_in_binary() {
    for (format, entry) in [("binary_little_endian", 0), ("binary_big_endian", 1)] {
        for (name, bytes) in [("int64", 8), ("uint64", 8), ("float16", 2)] {
            let one = |p: &crate::geometry::Point| {
                let number = |c: f32| if entry == 0 { c.to_le_bytes() } else { c.to_be_bytes() };
                [vec![7; bytes], p.xyz().map(number).concat()].concat()
            };
            let header = format!(
                "ply\nformat {format} 1.0\nelement vertex 50\nproperty {name} t\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n"
            );
            assert_reads("ply", &[header.into_bytes(), sample().iter().flat_map(one).collect()].concat());
        }
    }
}

#[test]
fn what_is_refused_of_a_header_is_named() {
    let pcd = |from: &str, to: &str| error("pcd", &with(&ascii_pcd(), from, to.as_bytes()));
    let ply = |from: &str, to: &str| error("ply", &with(&mixed_ascii_ply(), from, to.as_bytes()));
    for (error, expected) in [
        (pcd("SIZE 4 4 8 4 1\n", ""), "no SIZE line"),
        (pcd("TYPE U F F F U\n", ""), "no TYPE line"),
        (pcd("SIZE 4 4 8 4 1", "SIZE 4 4 8 4"), "scan.pcd:4: SIZE has 4 values, FIELDS 5"),
        (pcd("COUNT 1 1 1 1 2", "COUNT 1 1 1"), "scan.pcd:6: COUNT has 3 values, FIELDS 5"),
        (pcd("SIZE 4 4 8", "SIZE 4 four 8"), "scan.pcd:4: SIZE \"four\""),
        (pcd("COUNT 1 1 1", "COUNT 1 -1 1"), "scan.pcd:6: COUNT \"-1\""),
        (pcd("COUNT 1 1 1", "COUNT 1 0 1"), "field x is 0 of type F and size 4"),
        (pcd("TYPE U F", "TYPE U Q"), "field x is 1 of type Q and size 4"),
        (pcd("rgb x y", "x x y"), "field x is declared twice"),
        (pcd("POINTS 50", "POINTS many"), "scan.pcd:10: POINTS \"many\""),
        (pcd("DATA ascii", "DATA zipped"), "scan.pcd:11: DATA \"zipped\""),
        (ply("format ascii 1.0\r\n", ""), "no format line"),
        (ply("format ascii", "format text"), "scan.ply:2: format \"text\""),
        (ply("element vertex 50", "element vertex"), "scan.ply:6: "),
        (ply("end_header\r\n", ""), "scan.ply:14: \"3 1 2 3\""),
        (ply("element camera 1\r\n", ""), "scan.ply:4: "),
    ] {
        assert!(error.contains(expected), "{error:?} should contain {expected:?}");
    }
    let unsized_ = with(&with(&ascii_pcd(), "POINTS 50\n", b""), "WIDTH 50\n", b"");
    assert!(error("pcd", &unsized_).contains("neither POINTS nor WIDTH"));
}
