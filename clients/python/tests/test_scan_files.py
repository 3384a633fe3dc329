"""Scan files: read as the program reads them, and found in folders."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import mrol

from .support.scan_files import BROKEN, FORMATS, TEXTS, odd_headers, sample
from .support.scenes import room
from .support.server import Server, binary

ODD_HEADERS = odd_headers()
TWO = np.array([[1.5, 2, 3], [4, -5.25, 6]])
XYZI = 'columns="x y z i"'


def written(folder: Path, extension: str, data: bytes) -> Path:
    """A file."""
    path = folder / f"scan.{extension}"
    path.write_bytes(data)
    return path


def inserted_by_the_program(path: Path, server: Server, name: str) -> subprocess.CompletedProcess[str]:
    """What the program says that inserts a file into a map of its own."""
    options = ["--map", name, "--server", f"http://{server.grpc}", "--create", "--resolution", "0.001", "--levels", "1"]
    return subprocess.run([binary(), "insert", str(path), *options], capture_output=True, text=True, check=False)


def assert_read_as_by_the_program(client: mrol.Client, server: Server, path: Path) -> None:
    """Reads a file in both ways, into maps of voxels of a millimeter, which have to be the same."""
    done = inserted_by_the_program(path, server, "by-program")
    try:
        assert done.returncode == 0, done.stderr
        m = client.map("by-package", resolution=0.001, levels=1)
        answer = m.insert(mrol.read_scan(path), align=False)
        theirs = client.map("by-program").describe()
        assert (answer.version.content_hash, answer.new_voxels) == (theirs.version.content_hash, theirs.voxels[0])
    finally:
        for of in client.maps().maps:
            if of.name in ("by-package", "by-program"):
                client.delete_map(of.name)


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_has_the_same_points(client: mrol.Client, server: Server, tmp_path: Path, name: str) -> None:
    path = written(tmp_path, *FORMATS[name])
    points = mrol.read_scan(path)
    assert (points.dtype, points.flags.c_contiguous) == (np.dtype("<f4"), True)
    np.testing.assert_array_equal(points, sample())
    exact = mrol.read_scan(path, exact=True)
    assert exact.dtype == np.float64
    np.testing.assert_allclose(exact, sample(), rtol=1e-6)
    assert_read_as_by_the_program(client, server, path)


@pytest.mark.parametrize("name", ODD_HEADERS)
def test_headers_of_other_programs_are_read(client: mrol.Client, server: Server, tmp_path: Path, name: str) -> None:
    path = written(tmp_path, *ODD_HEADERS[name])
    np.testing.assert_array_equal(mrol.read_scan(path), sample())
    assert_read_as_by_the_program(client, server, path)


@pytest.mark.parametrize("text", TEXTS)
def test_texts_of_other_programs_are_read(client: mrol.Client, server: Server, tmp_path: Path, text: bytes) -> None:
    path = written(tmp_path, "xyz", text)
    np.testing.assert_array_equal(mrol.read_scan(path), TWO)
    for extension in ("txt", "CSV"):
        np.testing.assert_array_equal(mrol.read_scan(written(tmp_path, extension, text)), TWO)
    assert_read_as_by_the_program(client, server, path)


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_is_refused_with_its_line(server: Server, tmp_path: Path, name: str) -> None:
    path = written(tmp_path, *BROKEN[name])
    with pytest.raises(mrol.ScanFileError) as refused:
        mrol.read_scan(path)
    error = refused.value
    assert str(error).startswith(f"{path}{'' if error.line is None else f':{error.line}'}: ")
    assert error.path == str(path)
    assert error.problem
    done = inserted_by_the_program(path, server, "never")
    assert done.returncode != 0
    at_line = re.search(rf"{re.escape(str(path))}:(\d+): ", done.stderr)
    assert error.line == (None if at_line is None else int(at_line[1])), done.stderr


def test_a_file_cut_anywhere_is_refused_or_has_fewer_points(tmp_path: Path) -> None:
    for extension, data in FORMATS.values():
        for end in range(0, len(data), 7):
            path = written(tmp_path, extension, data[:end])
            try:
                points = mrol.read_scan(path)
            except mrol.ScanFileError:
                continue
            assert len(points) <= 50
            # A header says how many there are: at most the last digits are gone.
            assert extension in ("xyz", "f32") or end + 8 > len(data), (extension, end)


def test_garbage_in_any_place_is_no_other_error(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    for extension, data in FORMATS.values():
        for _ in range(300):
            broken = bytearray(data)
            end = min(len(data), 300) if rng.random() < 0.7 else len(data)
            for at in rng.integers(0, end, rng.integers(1, 6)):
                broken[at] = rng.integers(48, 58) if rng.random() < 0.5 else rng.integers(0, 256)
            try:
                points = mrol.read_scan(written(tmp_path, extension, bytes(broken)))
            except mrol.ScanFileError:
                continue
            assert points.shape[1:] == (3,)


def test_long_texts_are_read_at_once_as_line_by_line(tmp_path: Path) -> None:
    points = room(count=20_000)
    rows = "\n".join(f"{x} {y} {z} 17" for x, y, z in points.astype(float).tolist())
    plain = mrol.read_scan(written(tmp_path, "xyz", rows.encode()))
    np.testing.assert_array_equal(plain, points)
    # A word behind the coordinates, and a comma between them, are read in other ways.
    np.testing.assert_array_equal(mrol.read_scan(written(tmp_path, "xyz", f"{rows} end".encode())), points)
    np.testing.assert_array_equal(mrol.read_scan(written(tmp_path, "csv", rows.replace(" ", ",").encode())), points)
    with pytest.raises(mrol.ScanFileError) as refused:
        mrol.read_scan(written(tmp_path, "xyz", f"{rows}\n1 2\n".encode()))
    assert refused.value.line == len(points) + 1


def test_columns_are_those_that_are_named(tmp_path: Path) -> None:
    rows = np.array([[9, 1, 2, 3, 8], [9, 4, 5, 6, 8]], np.float32)
    expected = rows[:, [3, 1, 2]]
    named = "t y z x i"
    for extension in ("f32", "bin"):
        np.testing.assert_array_equal(mrol.read_scan(written(tmp_path, extension, rows.tobytes()), named), expected)
    np.save(tmp_path / "scan.npy", rows)
    np.testing.assert_array_equal(mrol.read_scan(tmp_path / "scan.npy", named.split()), expected)
    text = b"9 1 2 3 8\n9 4 5 6 8\n"
    np.testing.assert_array_equal(mrol.read_scan(written(tmp_path, "txt", text), "t,y,z,x,i"), expected)
    with pytest.raises(mrol.ArgumentError, match=r"columns must be left out for \.ply files"):
        mrol.read_scan(written(tmp_path, *FORMATS["ply, packed"]), "x y z")
    for bad in ("x y", "x y z z", "", 7, ["x", "y", 3]):
        with pytest.raises(mrol.ArgumentError, match="columns must be names of columns"):
            mrol.read_scan(tmp_path / "scan.npy", bad)


@pytest.mark.parametrize("kind", ["<f4", "<f8", ">f4", "<f2", "<i4"])
def test_arrays_of_numpy_are_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "scan.npy"
    points = np.array([[1, 2, 3], [4, 5, 6]], kind)
    for array in (points, np.asfortranarray(points), np.hstack([points, points]), points.reshape(2, 1, 3)):
        np.save(path, array)
        np.testing.assert_array_equal(mrol.read_scan(path), [[1, 2, 3], [4, 5, 6]])
    np.save(path, np.rec.fromarrays([points[:, 2], points[:, 1], points[:, 0]], names="z,y,x"))
    np.testing.assert_array_equal(mrol.read_scan(path), [[1, 2, 3], [4, 5, 6]])


def test_what_is_no_array_of_points_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scan.npy"
    for array, problem in (
        (np.zeros((3, 2)), r"shape \(3, 2\)"),
        (np.zeros((3, 100)), r"shape \(3, 100\)"),
        (np.zeros(()), r"shape \(\)"),
        (np.zeros((2, 3), complex), "complex"),
        (np.array([["a", "b", "c"]]), "<U1"),
    ):
        np.save(path, array)
        with pytest.raises(mrol.ScanFileError, match=problem):
            mrol.read_scan(path)
    np.save(path, np.array([[{}, 1, 2]], object), allow_pickle=True)
    with pytest.raises(mrol.ScanFileError, match="no array of numpy"):
        mrol.read_scan(path)
    path.write_bytes(b"\x93NUMPY")
    with pytest.raises(mrol.ScanFileError, match="no array of numpy"):
        mrol.read_scan(path)
    with (tmp_path / "scan.npy").open("wb") as file:
        np.savez(file, a=np.zeros((1, 3)))
    with pytest.raises(mrol.ScanFileError, match="an archive of arrays"):
        mrol.read_scan(path)


def scanner(kind: str) -> np.ndarray:
    """A sensor's points in the order in which it turns, with an intensity."""
    turn = np.linspace(0, 2 * np.pi, 3000, endpoint=False)
    points = np.stack([8 * np.cos(turn), 5 * np.sin(turn), -1 + 0.2 * np.sin(9 * turn)], axis=1)
    intensity = {
        "0 to 1": np.random.default_rng(1).uniform(0, 1, 3000),
        "0 to 255": np.random.default_rng(1).integers(0, 256, 3000),
        "negative": -40 + 3 * np.sin(5 * turn),
        "none": np.zeros(3000),
    }[kind]
    return np.column_stack([points, intensity]).astype(np.float32)


@pytest.mark.parametrize("kind", ["0 to 1", "0 to 255", "negative", "none"])
def test_bare_floats_with_intensities_are_no_points(tmp_path: Path, kind: str) -> None:
    rows = scanner(kind)
    orders = [rows] if kind == "negative" else [rows, np.random.default_rng(2).permutation(rows)]
    for given in orders:
        with pytest.raises(mrol.ScanFileError, match=rf"look like rows of 4 \(x y z i\), not of 3 \(x y z\): give {XYZI}, or"):
            mrol.read_scan(written(tmp_path, "f32", given.tobytes()))
        np.testing.assert_array_equal(mrol.read_scan(tmp_path / "scan.f32", "x y z i"), given[:, :3])
        assert mrol.read_scan(tmp_path / "scan.f32", "x y z").shape == (4000, 3)
        np.testing.assert_array_equal(mrol.read_scan(written(tmp_path, "bin", given.tobytes())), given[:, :3])
    # A length that divides by 16 alone.
    with pytest.raises(mrol.ScanFileError, match=rf"not whole points of 12 bytes.*they may be rows of 4 numbers: give {XYZI}"):
        mrol.read_scan(written(tmp_path, "f32", rows[:2999].tobytes()))
    # Points without intensities under the name of such with them.
    points = np.ascontiguousarray(rows[:, :3])
    np.testing.assert_array_equal(mrol.read_scan(written(tmp_path, "f32", points.tobytes())), points)
    with pytest.raises(mrol.ScanFileError, match='look like rows of 3.*give columns="x y z"'):
        mrol.read_scan(written(tmp_path, "bin", points.tobytes()))


@pytest.mark.parametrize("scale", [0.1, 1.0, 100.0])
def test_bare_floats_of_points_are_not_taken_for_others(tmp_path: Path, scale: float) -> None:
    rng = np.random.default_rng(3)
    ordered = scanner("none")[:, :3]
    # A length that divides by rows of three, four and five numbers.
    walls = (room(count=16_000)[:18_000] + np.float32(5)) * np.float32(scale)
    for points in (ordered, rng.permutation(ordered), walls, np.abs(walls), rng.uniform(0, scale, (3000, 3)), np.zeros((60, 3))):
        given = np.ascontiguousarray(points, "<f4")
        np.testing.assert_array_equal(mrol.read_scan(written(tmp_path, "f32", given.tobytes())), given)


def test_what_is_no_scan_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(mrol.ArgumentError, match=r"path must be a scan file: \.ply \.pcd \.xyz .*, got .*scan\.las"):
        mrol.read_scan(written(tmp_path, "las", b""))
    with pytest.raises(FileNotFoundError):
        mrol.read_scan(tmp_path / "none.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(OSError, match="directory"):
        mrol.read_scan(tmp_path / "folder.ply")
    with (tmp_path / "large.f32").open("wb") as large:
        large.truncate((1 << 30) + 1)
    with pytest.raises(mrol.ScanFileError, match="larger than 1073741824 bytes"):
        mrol.read_scan(tmp_path / "large.f32")
    assert mrol.read_scan(written(tmp_path, "f32", b"")).shape == (0, 3)


def test_a_folder_has_its_scans_in_natural_order(tmp_path: Path) -> None:
    for name in ("scan10.ply", "scan2.ply", "scan1.PCD", "scan02.bin", "b.npy", "a9.xyz", "a10.f32", "poses.txt", "README.md"):
        (tmp_path / name).touch()
    (tmp_path / "folder.ply").mkdir()
    names = [path.name for path in mrol.scan_files(tmp_path)]
    assert names == ["a9.xyz", "a10.f32", "b.npy", "scan1.PCD", "scan02.bin", "scan2.ply", "scan10.ply"]
    with pytest.raises(mrol.ScanFileError, match="no scan file in this folder"):
        mrol.scan_files(tmp_path / "folder.ply")
    (tmp_path / "folder.ply" / "a.csv").touch()
    with pytest.raises(mrol.ScanFileError, match=r"1 of \.txt or \.csv are read by their names alone"):
        mrol.scan_files(tmp_path / "folder.ply")
    with pytest.raises(FileNotFoundError):
        mrol.scan_files(tmp_path / "nowhere")
    with pytest.raises(NotADirectoryError):
        mrol.scan_files(tmp_path / "README.md")
