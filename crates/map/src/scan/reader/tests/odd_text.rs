//! Text as other programs write it.

use super::files::*;
use crate::geometry::Point;

fn points(text: &[u8]) -> Vec<[f32; 3]> {
    read("xyz", text)
        .unwrap_or_else(|error| panic!("{error}: {:?}", String::from_utf8_lossy(text)))
        .into_iter()
        .map(Point::xyz)
        .collect()
}

const TWO: [[f32; 3]; 2] = [[1.5, 2.0, 3.0], [4.0, -5.25, 6.0]];

#[test]
fn text_of_other_programs_gives_the_same_points() {
    let texts: [&[u8]; 24] = [
        b"1.5 2 3\n4 -5.25 6\n",
        b"//X Y Z\n1.5 2 3\n4 -5.25 6\n",
        b"// X Y Z R G B\n1.5 2 3 7 7 7\n4 -5.25 6 8 8 8",
        b"2\n1.5 2 3\n4 -5.25 6\n",
        b"//X Y Z\r\n2\r\n1.5 2 3\r\n4 -5.25 6\r\n",
        b"1.5;2;3\n4;-5.25;6\n",
        b"1.5 ; 2 ; 3 ;\n4;-5.25;6;\n",
        b"1,5;2,0;3\n4;-5,25;6\n",
        b"1.5,2,3\n4, -5.25 ,6",
        b"1.5\t2\t3\t9\n4\t-5.25\t6\t9\n",
        b"\xef\xbb\xbf1.5 2 3\n4 -5.25 6\n",
        b"\xef\xbb\xbf# x y z\n1.5 2 3\n4 -5.25 6\n",
        b"\n\n  \r\n1.5 2 3\n\n4 -5.25 6\n\n",
        b"1.5 2 3\r4 -5.25 6\r",
        b"1.5 2 3\r4 -5.25 6",
        b"1.5 2 3\r\n4 -5.25 6\r\n",
        b"# Geb\xe4ude\n1.5 2 3 M\xfcnchen\n4 -5.25 6 K\xf6ln\n",
        b"X Y Z\n1.5 2 3\n4 -5.25 6\n",
        b"\"x\",\"y\",\"z\"\n1.5,2,3\n4,-5.25,6\n",
        b"x;y;z;intensity\n1.5;2;3;0\n4;-5.25;6;0\n",
        b"time x y z\n77 1.5 2 3\n78 4 -5.25 6\n",
        b"# t X Y Z\n77 1.5 2 3\n78 4 -5.25 6\n",
        b"//Z,Y,X\n3,2,1.5\n6,-5.25,4\n",
        b"# the x y z of a room\n1.5 2 3\n4 -5.25 6\n",
    ];
    for text in texts {
        assert_eq!(points(text), TWO, "{:?}", String::from_utf8_lossy(text));
    }
}

#[test]
fn cr_alone_ends_every_line() {
    let text: String = (0..256).map(|i| format!("{i} 2 3\r")).collect();
    assert_eq!(points(text.as_bytes()).len(), 256);
    assert!(error("xyz", b"1 2 3\r4 5 6\r7 8\r").contains("scan.xyz:3: 2 columns"));
    assert!(error("xyz", b"1 2 3\r\n4 5 6\r\n7 8\r\n").contains("scan.xyz:3: 2 columns"));
}

#[test]
fn what_is_refused_of_a_text_is_named_with_its_line() {
    for (text, expected) in [
        (&b"3\n1 2 3\n4 5 6\n"[..], "scan.xyz:1: 3 points are declared, 2 follow"),
        (b"1\n1 2 3\n4 5 6\n", "scan.xyz:1: 1 points are declared, 2 follow"),
        (b"7\n", "scan.xyz:1: 1 columns"),
        (b"1 2 3\n2\n1 2 3\n", "scan.xyz:2: 1 columns"),
        (b"x y w\n1 2 3\n", "scan.xyz:1: \"x\" is not a number"),
        (b"1 2 3\nx y z\n1 2 3\n", "scan.xyz:2: \"x\" is not a number"),
        (b"time x y z\n7 1 2\n", "scan.xyz:2: 3 columns, column 4 is needed"),
        (b"1,5 2,5 3,5\n", "scan.xyz:1: \"5 2\" is not a number"),
        (b"1.000,5;2;3\n", "scan.xyz:1: \"1.000,5\" is not a number"),
        (b"\xff\xfe1\0 \x002\0", "scan.xyz:1: UTF-16"),
        (b"1 2 3\n1 2 \x80\x03\n", "scan.xyz:2: not text"),
    ] {
        let error = error("xyz", text);
        assert!(error.contains(expected), "{error:?} should contain {expected:?}");
    }
}
