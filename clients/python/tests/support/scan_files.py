"""Scan files of every format, built byte by byte, as `crates/map/src/scan/reader/tests` builds them."""

import struct
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]


def sample() -> F32:
    """Points with every kind of number that must survive: fractions, exponents, "no return", zeros."""
    i = np.arange(50, dtype=np.float32)
    points = np.stack([i / np.float32(3), np.float32(-0.1) * i, np.float32(1e-7) * i], axis=1)
    points[7] = np.nan
    points[8] = [np.inf, -np.inf, 0]
    points[9] = 0
    return points.astype(np.float32)


def text_lines(prefix: str = "", suffix: str = "") -> bytes:
    """A point a line, with the shortest digits that are read as the same numbers."""
    rows = (" ".join(str(c) for c in point) for point in sample())
    return "".join(f"{prefix}{row}{suffix}\n" for row in rows).encode()


def mixed_ply(form: str, entries: bytes, before: bytes) -> bytes:
    """Other properties around the coordinates, a double among them, and an element before the vertices."""
    header = (
        f"ply\r\nformat {form} 1.0\r\ncomment made by a test\r\nelement camera 1\r\nproperty list uchar int v\r\n"
        "element vertex 50\r\nproperty uchar red\r\nproperty float x\r\nproperty double y\r\nproperty float z\r\n"
        "property list uchar short tags\r\nelement face 0\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
    )
    return header.encode() + before + entries


def ascii_ply() -> bytes:
    """Text with lists."""
    return mixed_ply("ascii", text_lines("200 ", " 2 -1 5"), b"3 1 2 3\r\n")


def binary_ply(order: str) -> bytes:
    """Binary with lists, of an order of bytes."""
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    entries = (struct.pack(f"{order}BfdfBh", 200, *map(float, point), 1, 5) for point in sample())
    return mixed_ply(name, b"".join(entries), struct.pack(f"{order}Bi", 1, 9))


def packed_ply(order: str = "<") -> bytes:
    """Binary of coordinates alone."""
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    properties = "property float x\nproperty float y\nproperty float z\n"
    return f"ply\nformat {name} 1.0\nelement vertex 50\n{properties}end_header\n".encode() + sample().astype(f"{order}f4").tobytes()


def plain_ascii_ply() -> bytes:
    """Text of coordinates and an intensity alone, which is read at once."""
    properties = "property float y\nproperty float x\nproperty float z\nproperty float i\n"
    rows = "".join(f"{y} {x} {z} 0.5\n" for x, y, z in sample())
    return f"ply\nformat ascii 1.0\nelement vertex 50\n{properties}end_header\n{rows}".encode()


def pcd_header(kind: str) -> bytes:
    """The header of other fields around x y z, a double among them."""
    return (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z _\nSIZE 4 4 8 4 1\nTYPE U F F F U\nCOUNT 1 1 1 1 2\n"
        f"WIDTH 50\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 50\nDATA {kind}\n"
    ).encode()


def ascii_pcd() -> bytes:
    """Text."""
    return pcd_header("ascii") + text_lines("1234 ", " 0 0")


def binary_pcd() -> bytes:
    """Binary, record by record."""
    entries = (struct.pack("<4Bfdf2B", 1, 2, 3, 4, *map(float, point), 0, 0) for point in sample())
    return pcd_header("binary") + b"".join(entries)


def columns_of_pcd() -> bytes:
    """The fields, one behind the other, each of all points."""
    points = sample()
    x, y, z = points[:, 0].tobytes(), points[:, 1].astype("<f8").tobytes(), points[:, 2].tobytes()
    return bytes([1, 2, 3, 4]) * 50 + x + y + z + bytes([0, 0]) * 50


def literal_lzf(data: bytes) -> bytes:
    """Compressed data of literal runs alone."""
    return b"".join(bytes([len(data[at : at + 32]) - 1]) + data[at : at + 32] for at in range(0, len(data), 32))


def greedy_lzf(data: bytes) -> bytes:
    """Compressed data with what repeats itself, some of it within itself."""
    made, literal, seen, at = bytearray(), bytearray(), dict[bytes, int](), 0
    while at < len(data):
        found = seen.get(data[at : at + 3], -1)
        seen[data[at : at + 3]] = at
        if found < 0 or at - found > 8192 or at + 3 > len(data):
            literal.append(data[at])
            at += 1
            continue
        length = 3
        while length < 264 and at + length < len(data) and data[found + length] == data[at + length]:
            length += 1
        made += literal_lzf(bytes(literal))
        literal.clear()
        back, count = at - found - 1, length - 2
        made += bytes([(min(count, 7) << 5) + (back >> 8), *([count - 7] if count >= 7 else []), back & 255])
        at += length
    return bytes(made + literal_lzf(bytes(literal)))


def compressed_pcd(compress: Callable[[bytes], bytes] = literal_lzf) -> bytes:
    """Compressed, field by field."""
    columns = columns_of_pcd()
    data = compress(columns)
    return pcd_header("binary_compressed") + struct.pack("<II", len(data), len(columns)) + data


def xyz() -> bytes:
    """Text."""
    return b"# x y z\n\n" + text_lines("  ", " 0.5")


FORMATS: dict[str, tuple[str, bytes]] = {
    "ply, text": ("ply", ascii_ply()),
    "ply, plain text": ("ply", plain_ascii_ply()),
    "ply, little-endian": ("ply", binary_ply("<")),
    "ply, big-endian": ("ply", binary_ply(">")),
    "ply, packed": ("ply", packed_ply()),
    "ply, packed big-endian": ("ply", packed_ply(">")),
    "pcd, text": ("pcd", ascii_pcd()),
    "pcd, binary": ("pcd", binary_pcd()),
    "pcd, compressed": ("pcd", compressed_pcd()),
    "pcd, compressed with references": ("pcd", compressed_pcd(greedy_lzf)),
    "xyz": ("xyz", xyz()),
    "f32": ("f32", sample().astype("<f4").tobytes()),
}
"""Files that all have the sample's points."""


def replaced(data: bytes, old: str, new: str | bytes) -> bytes:
    """Bytes in which a text is there, with another one in its place."""
    assert old.encode() in data, old
    return data.replace(old.encode(), new if isinstance(new, bytes) else new.encode(), 1)


def odd_headers() -> dict[str, tuple[str, bytes]]:
    """Files with the sample's points, under headers as other programs write them."""
    found: dict[str, tuple[str, bytes]] = {}
    for name, data in (("text", ascii_pcd()), ("binary", binary_pcd()), ("compressed", compressed_pcd())):
        changes: dict[str, list[tuple[str, str | bytes]]] = {
            "capitals": [("FIELDS rgb x y z", "FIELDS RGB X Y Z")],
            "columns": [("FIELDS", "COLUMNS")],
            "no version": [("VERSION 0.7\n", "")],
            "no points": [("POINTS 50\n", "")],
            "no points and no height": [("POINTS 50\n", ""), ("HEIGHT 1\n", "")],
            "no width": [("WIDTH 50\n", ""), ("HEIGHT 1\n", "")],
            "blank lines": [("VERSION 0.7\n", b"\n  \r\nVERSION .7\r\n")],
            "another encoding": [("# .PCD v0.7\n", b"\xef\xbb\xbf# .PCD v0.7 Geb\xe4ude\n")],
            "a field of no value": [
                ("FIELDS rgb x", "FIELDS _ rgb _ x"),
                ("SIZE 4 4", "SIZE 1 4 8 4"),
                ("TYPE U F", "TYPE U U F F"),
                ("COUNT 1 1", "COUNT 0 1 0 1"),
            ],
        }
        for change, pairs in changes.items():
            changed = data
            for old, new in pairs:
                changed = replaced(changed, old, new)
            found[f"pcd, {name}, {change}"] = "pcd", changed
    for name, data in (("text", ascii_ply()), ("little-endian", binary_ply("<")), ("big-endian", binary_ply(">"))):
        for old, new in (
            ("uchar red", "uchar scalar_Intensity_(dB)"),
            ("uchar red", "uchar gps time"),
            ("uchar red", b"uchar gr\xfcn"),
            ("comment made by a test", "obj_info num_cols 5.\r\ncomment"),
            ("comment made by a test\r\n", "\r\n"),
            ("float x", "float X"),
            ("double y", "float64 Y"),
            ("ply\r\n", b"\xef\xbb\xbfply \r\n"),
        ):
            found[f"ply, {name}, {new!r}"] = "ply", replaced(data, old, new)
        end = data.index(b"end_header\r\n") + 12
        found[f"ply, {name}, CR alone"] = "ply", data[:end].replace(b"\r\n", b"\r") + data[end:]
    found["ply, text, a type that nothing is known of"] = "ply", replaced(ascii_ply(), "uchar red", "uint128 red")
    found["ply, text, blank lines"] = "ply", replaced(ascii_ply(), "end_header\r\n", "end_header\r\n\r\n\n")
    found["pcd, text, blank lines behind the header"] = "pcd", replaced(ascii_pcd(), "DATA ascii\n", "DATA ASCII\n\n\n")
    return found


def with_size(at: int, value: int) -> bytes:
    """Compressed, with another number in the place of a size."""
    data, begin = compressed_pcd(), len(pcd_header("binary_compressed")) + at
    return data[:begin] + struct.pack("<I", value) + data[begin + 4 :]


TEXTS: list[bytes] = [
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
    b'"x","y","z"\n1.5,2,3\n4,-5.25,6\n',
    b"x;y;z;intensity\n1.5;2;3;0\n4;-5.25;6;0\n",
    b"time x y z\n77 1.5 2 3\n78 4 -5.25 6\n",
    b"# t X Y Z\n77 1.5 2 3\n78 4 -5.25 6\n",
    b"//Z,Y,X\n3,2,1.5\n6,-5.25,4\n",
    b"# the x y z of a room\n1.5 2 3\n4 -5.25 6\n",
    b"1.5 2 3 7\n4 -5.25 6\n",
    b"1.5 2 3\n# between\n4 -5.25 6\n",
    b"+1.5e0 2. 3\n.4E1 -5.25 6.0\n",
]
"""Texts as programs write them, all of the points 1.5 2 3 and 4 -5.25 6."""

BROKEN: dict[str, tuple[str, bytes]] = {
    **{
        f"xyz, {text!r}": ("xyz", text)
        for text in (
            b"3\n1 2 3\n4 5 6\n",
            b"1\n1 2 3\n4 5 6\n",
            b"7\n",
            b"1 2 3\n2\n1 2 3\n",
            b"x y w\n1 2 3\n",
            b"1 2 3\nx y z\n1 2 3\n",
            b"time x y z\n7 1 2\n",
            b"1,5 2,5 3,5\n",
            b"1.000,5;2;3\n",
            b"\xff\xfe1\0 \x002\0",
            b"1 2 3\n1 2 \x80\x03\n",
            b"1 2 3\n# c\n4 5\n",
            b"1,2,3\n1,,2,3\n",
            b"1 2 3\r4 5 6\r7 8\r",
            b"1 2 3\n1_0 2 3\n",
            b"1 2 3\n0x10 2 3\n",
            b"1 2 3\n1e 2 3\n",
        )
    },
    **{
        f"ply, {new!r} for {old!r}": ("ply", replaced(ascii_ply(), old, new))
        for old, new in (
            ("element vertex 50", "element vertex -4"),
            ("element vertex 50", "element vertex"),
            ("element vertex 50", "element vertex 51"),
            ("element vertex 50", "element vertex 99999999"),
            ("element vertex 50", "element vertex 18446744073709551615"),
            ("property float x", "property int x"),
            ("property float x", "property float u"),
            ("property double y", "property double x"),
            ("element camera", "element face"),
            ("element vertex", "element points"),
            ("0.6666667", "oops"),
            ("format ascii 1.0\r\n", ""),
            ("format ascii", "format text"),
            ("end_header\r\n", ""),
            ("element camera 1\r\n", ""),
            ("200 0.6666667", "200"),
        )
    },
    "ply, another file": ("ply", b"solid\n"),
    "ply, empty": ("ply", b""),
    "ply, a type that nothing is known of": ("ply", replaced(binary_ply("<"), "uchar red", "string red")),
    "ply, cut off": ("ply", binary_ply("<")[:-1]),
    "ply, packed, cut off": ("ply", packed_ply()[:-1]),
    **{
        f"pcd, {new!r} for {old!r}": ("pcd", replaced(ascii_pcd(), old, new))
        for old, new in (
            ("FIELDS rgb x", "FIELDS rgb u"),
            ("SIZE 4 4 8", "SIZE 4 2 8"),
            ("COUNT 1 1 1 1 2", "COUNT 1 1 3 1 2"),
            ("COUNT 1 1 1 1 2", "COUNT 18446744073709551615 1 1 1 18446744073709551615"),
            ("0.6666667", "oops"),
            ("0.6666667", ""),
            ("SIZE 4 4 8 4 1\n", ""),
            ("TYPE U F F F U\n", ""),
            ("SIZE 4 4 8 4 1", "SIZE 4 4 8 4"),
            ("COUNT 1 1 1 1 2", "COUNT 1 1 1"),
            ("SIZE 4 4 8", "SIZE 4 four 8"),
            ("COUNT 1 1 1", "COUNT 1 -1 1"),
            ("COUNT 1 1 1", "COUNT 1 0 1"),
            ("TYPE U F", "TYPE U Q"),
            ("rgb x y", "x x y"),
            ("POINTS 50", "POINTS many"),
            ("POINTS 50", "POINTS 51"),
            ("DATA ascii", "DATA zipped"),
        )
    },
    "pcd, no header": ("pcd", b"VERSION 0.7\n"),
    "pcd, cut off": ("pcd", binary_pcd()[:-1]),
    "pcd, compressed, cut off": ("pcd", compressed_pcd()[:-1]),
    **{
        f"pcd, compressed, {value} at {at}": ("pcd", with_size(at, value))
        for at, value in ((0, (1 << 32) - 1), (0, 0), (0, 3), (4, (1 << 32) - 1), (4, 0), (4, 1099))
    },
    "f32, cut off": ("f32", bytes(30)),
}
"""Files that are refused."""
