"""The examples, run as programs."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mrol

from .support.scenes import room

EXAMPLES = Path(__file__).parent.parent / "examples"


def example(name: str, *arguments: object) -> str:
    """What an example prints."""
    command = [sys.executable, str(EXAMPLES / name), *(str(argument) for argument in arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_robot_maps_a_folder(client: mrol.Client, tmp_path: Path) -> None:
    np.save(tmp_path / "scan1.npy", room((0, 0, 0), 20_000))
    np.savetxt(tmp_path / "scan10.xyz", room((0.4, 0.1, 0), 20_000, 3))
    room((0.2, 0, 0), 20_000, 2).tofile(tmp_path / "scan2.f32")
    (tmp_path / "poses.txt").write_text("0 0 0 0 0 0 0 1\n")
    said = example("map_folder.py", tmp_path, "--server", client.address, "--map", "folder")
    assert said.startswith("3 scans, in this order: scan1.npy scan2.f32 scan10.xyz\n")
    assert "3 of 3 scans are in the map" in said
    positions = client.map("folder").trajectory().positions_m
    np.testing.assert_allclose(positions, [[0, 0, 0], [0.2, 0, 0], [0.4, 0.1, 0]], atol=0.05)
    client.delete_map("folder")


def test_a_folder_that_cannot_be_mapped_is_an_error(client: mrol.Client, tmp_path: Path) -> None:
    def failed(folder: Path, *arguments: str, server: str = client.address) -> tuple[int, str]:
        command = [sys.executable, str(EXAMPLES / "map_folder.py"), str(folder), "--map", "folder", "--server", server, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.stderr.startswith("error: ")
        assert done.stderr.count("\n") == 1
        return done.returncode, done.stderr

    code, said = failed(tmp_path / "nowhere")
    assert code == 2
    assert "No such file or directory" in said
    assert "nowhere" in said
    code, said = failed(tmp_path)
    assert code == 2
    assert f"{tmp_path}: no scan file in this folder" in said
    assert [of.name for of in client.maps().maps if of.name == "folder"] == []
    (tmp_path / "scan1.ply").write_text("solid\n")
    code, said = failed(tmp_path)
    assert code == 2
    assert "scan1.ply:1: not a ply header" in said
    code, said = failed(tmp_path, "--columns", "x y")
    assert code == 2
    assert "columns must be" in said
    code, said = failed(tmp_path, server="127.0.0.1:1")
    assert code == 1
    assert "is `mrol serve` running there?" in said
    client.delete_map("folder")


@pytest.mark.parametrize(
    ("name", "lacking", "install"),
    [
        ("map_folder.py", "mrol", "pip install ./clients/python,"),
        ("picture.py", "matplotlib", "pip install './clients/python[pictures]',"),
        ("plan.py", "ompl", "pip install ./clients/python ompl,"),
        ("follow_in_rerun.py", "rerun", "pip install './clients/python[rerun]',"),
    ],
)
def test_an_example_names_what_to_install(name: str, lacking: str, install: str) -> None:
    path = EXAMPLES / name
    without = f"import runpy, sys; sys.modules[{lacking!r}] = None; runpy.run_path({str(path)!r}, run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", without], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert done.stderr == f"{lacking} is not there: {install} from the root of the repository\n"
    assert install in path.read_text()


@pytest.mark.skipif(importlib.util.find_spec("ompl") is None, reason="ompl is not installed")
def test_a_planner_of_ompl_flies_round_the_post(client: mrol.Client, hall: mrol.Map) -> None:
    arguments = ["--server", client.address, "--map", hall.name, "--from", 0.5, 1, 0, "--to", 2.6, 1, 0, "--radius", 0.25]
    said = example("plan.py", *arguments).splitlines()
    # OMPL has words of its own.
    corners = said[next(at for at, line in enumerate(said) if line.startswith("shortened:")) + 1 :]
    path = np.array([[float(number) for number in line.split()] for line in corners])
    np.testing.assert_allclose(path[[0, -1]], [[0.5, 1, 0], [2.6, 1, 0]], atol=1e-3)
    # The straight way leads through the post.
    assert len(path) > 2
    ball = [[0.0, 0.0, 0.0, 0.25]]
    assert not hall.check_motions(ball, [path[[0, -1]]]).free[0]
    assert hall.check_motions(ball, np.stack([path[:-1], path[1:]], axis=1), step_m=0.01).free.all()


@pytest.mark.skipif(importlib.util.find_spec("matplotlib") is None, reason="matplotlib is not installed")
def test_a_picture_is_drawn(client: mrol.Client, hall: mrol.Map, tmp_path: Path) -> None:
    band = ("--band", -1, 1, "--band-from", "map")
    example("picture.py", "--server", client.address, "--map", hall.name, "--out", tmp_path / "map.png", *band)
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_the_package_tells_how_to_start(client: mrol.Client, hall: mrol.Map) -> None:
    def said(*arguments: str) -> str:
        return subprocess.run([sys.executable, "-m", "mrol", *arguments], capture_output=True, text=True, check=False).stdout

    assert "mrol serve" in said()
    assert "mrol.connect(" in said()
    assert f"{hall.name}: revision 2, 2 scans" in said(client.address)
