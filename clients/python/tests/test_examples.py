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
    np.save(tmp_path / "0.npy", room((0, 0, 0), 20_000))
    room((0.2, 0, 0), 20_000, 2).tofile(tmp_path / "1.f32")
    np.savetxt(tmp_path / "2.xyz", room((0.4, 0.1, 0), 20_000, 3))
    said = example("map_folder.py", tmp_path, "--server", client.address, "--map", "folder")
    assert "3 of 3 scans are in the map" in said
    positions = client.map("folder").trajectory().positions_m
    np.testing.assert_allclose(positions, [[0, 0, 0], [0.2, 0, 0], [0.4, 0.1, 0]], atol=0.05)
    client.delete_map("folder")


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
    example("picture.py", "--server", client.address, "--map", hall.name, "--out", tmp_path / "map.png", "--band", -1, 1)
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_the_package_tells_how_to_start(client: mrol.Client, hall: mrol.Map) -> None:
    def said(*arguments: str) -> str:
        return subprocess.run([sys.executable, "-m", "mrol", *arguments], capture_output=True, text=True, check=False).stdout

    assert "mrol serve" in said()
    assert "mrol.connect(" in said()
    assert f"{hall.name}: revision 2, 2 scans" in said(client.address)
