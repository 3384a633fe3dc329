"""Binary trees of OctoMap."""

import os
from pathlib import Path

import numpy as np
import pytest

from mrol_ros.octree import FREE, OCCUPIED, Leaves, octree_cells, octree_data

FIXTURES = Path(__file__).resolve().parents[4] / "crates/files/tests/fixtures"
SHARED = Path(os.environ.get("MROL_SHARED", Path(__file__).resolve().parents[4] / "../shared")) / "data/octomap/geb079.bt"


def leaves_of(cells):
    for level in range(16):
        for state in (FREE, OCCUPIED):
            of = cells[(cells[:, 3] == level) & (cells[:, 4] == state)]
            if len(of):
                yield Leaves(of[:, :3], level, state)


def test_voxels_come_back():
    rng = np.random.default_rng(1)
    voxels = np.unique(rng.integers(-40, 40, (5000, 3)), axis=0)
    data, outside = octree_data([Leaves(voxels, 0, OCCUPIED)])
    assert outside == 0
    cells = octree_cells(data)
    assert (cells[:, 4] == OCCUPIED).all()
    found = {tuple(cell[:3]) for cell in cells[cells[:, 3] == 0].tolist()}
    for *corner, level, _ in cells[cells[:, 3] > 0].tolist():
        side = 1 << level
        found |= {tuple(side * c + d for c, d in zip(corner, part, strict=True)) for part in np.ndindex(side, side, side)}
    assert found == set(map(tuple, voxels.tolist()))
    assert octree_data(list(leaves_of(cells)))[0] == data


def test_one_voxel_is_a_path_of_sixteen_nodes():
    data, _ = octree_data([Leaves(np.array([[0, 0, 0]]), 0, OCCUPIED)])
    # The first child but for the root's, which begins at 0 with its last one.
    words = np.frombuffer(data, "<u2").tolist()
    assert words == [3 << 14] + [3] * 14 + [OCCUPIED]


def test_eight_equal_children_are_one_leaf():
    cube = np.array(list(np.ndindex(4, 4, 4)))
    cells = octree_cells(octree_data([Leaves(cube, 0, OCCUPIED)])[0])
    assert cells.tolist() == [[0, 0, 0, 2, OCCUPIED]]


def test_free_space_is_told_around_what_is_occupied():
    free = np.array([[0, 0, 0], [1, 0, 0]])
    data, _ = octree_data([Leaves(np.array([[5, 1, 2]]), 0, OCCUPIED), Leaves(free, 2, FREE)])
    cells = octree_cells(data).tolist()
    # The second free cell has an occupied voxel in it, which counts.
    assert [0, 0, 0, 2, FREE] in cells
    assert [5, 1, 2, 0, OCCUPIED] in cells
    assert len(cells) == 2


def test_voxels_outside_of_the_tree_are_counted():
    far = np.array([[1 << 15, 0, 0], [-(1 << 15) - 1, 0, 0], [-(1 << 15), 0, 0], [(1 << 15) - 1, 0, 0]])
    data, outside = octree_data([Leaves(far, 0, OCCUPIED)])
    assert outside == 2
    assert sorted(octree_cells(data)[:, 0].tolist()) == [-(1 << 15), (1 << 15) - 1]
    assert octree_data([]) == (b"", 0)
    assert octree_cells(b"").shape == (0, 5)


def test_bytes_that_are_no_tree_are_refused():
    data, _ = octree_data([Leaves(np.array([[0, 0, 0]]), 0, OCCUPIED)])
    for broken in (data[:-2], data + b"\0\0", b"\x03\0" * 40):
        with pytest.raises(ValueError, match="tree"):
            octree_cells(broken)


def test_a_tree_of_octomap_has_the_leaves_that_it_lists_and_comes_back_byte_for_byte():
    # The program reads and writes the same file.
    _, _, tree = (FIXTURES / "certain.bt").read_bytes().partition(b"\ndata\n")
    cells = octree_cells(tree)
    listed = [line.split() for line in (FIXTURES / "leaves.txt").read_text().splitlines()]
    states = {"free": FREE, "occupied": OCCUPIED}
    assert {tuple(cell) for cell in cells.tolist()} == {(*map(int, at), states[state]) for *at, state in listed}
    assert octree_data(list(leaves_of(cells))) == (tree, 0)


@pytest.mark.skipif(not SHARED.exists(), reason=f"{SHARED} is not there")
def test_a_tree_of_octomap_comes_back_byte_for_byte():
    _, _, tree = SHARED.read_bytes().partition(b"\ndata\n")
    cells = octree_cells(tree)
    assert octree_data(list(leaves_of(cells))) == (tree, 0)
