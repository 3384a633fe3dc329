"""The content of OctoMap's binary trees, as `octomap_msgs/Octomap` and files `.bt` have it behind their heads.

A tree has 16 levels below its root. A node is two bits for each of its eight children: 00 unknown, 01 free, 10 occupied, 11 a node,
the lowest bits for the first child. Nodes follow one another depth first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

DEPTH = 16
CENTER = 1 << (DEPTH - 1)
"""The key of the cells that begin at 0."""

FREE, OCCUPIED, NODE = 1, 2, 3

EACH = 0x5555
"""A state times this is the word of a node whose children all have it."""

RANKS = np.array([3, 2, 0, 1], np.uint8)
"""Which state counts first where two cells are the same one."""


@dataclass(frozen=True, eq=False)
class Leaves:
    """Cells of one level and one state.

    Cell i j k of level n spans `[i, i + 1) * 2^n * resolution` in x, and so on.
    """

    indices: NDArray[Any]
    """Shape (n, 3)."""
    level: int
    state: int
    """`OCCUPIED` or `FREE`."""


def octree_data(leaves: Sequence[Leaves]) -> tuple[bytes, int]:
    """The tree of cells, and how many of them lie outside of it and are left out.

    Where cells overlap, occupied ones count first, then finer ones. Eight equal children become one leaf, as OctoMap prunes them.
    """
    codes, states, outside = np.zeros(0, np.uint64), np.zeros(0, np.uint8), 0
    nodes: list[tuple[NDArray[Any], NDArray[Any], NDArray[Any]]] = []
    for level in range(DEPTH):
        of_level = [of for of in leaves if of.level == level]
        if of_level:
            found = [_codes(of.indices, level) for of in of_level]
            outside += sum(count for _, count in found)
            codes = np.concatenate([codes, *(of for of, _ in found)])
            states = np.concatenate(
                [states, *(np.full(len(of), leaf.state, np.uint8) for (of, _), leaf in zip(found, of_level, strict=True))]
            )
            # The first of equal codes is kept.
            order = np.lexsort((RANKS[states], codes))
            codes, states = codes[order], states[order]
            is_first = np.append(True, codes[1:] != codes[:-1])[: len(codes)]
            codes, states = codes[is_first], states[is_first]
        if len(codes) == 0:
            continue
        # Codes ascend, so those of one parent follow one another.
        parents = codes >> np.uint64(3)
        first = np.flatnonzero(np.append(True, parents[1:] != parents[:-1]))
        parents = parents[first]
        shifts = ((codes & np.uint64(7)) * np.uint64(2)).astype(np.uint16)
        bits = np.bitwise_or.reduceat(states.astype(np.uint16) << shifts, first)
        states = np.where(bits == OCCUPIED * EACH, OCCUPIED, np.where(bits == FREE * EACH, FREE, NODE)).astype(np.uint8)
        # The root is written as a node, whatever its children are.
        is_node = (states == NODE) | (level == DEPTH - 1)
        place = parents[is_node] << np.uint64(3 * (level + 1))
        nodes.append((place, np.full(len(place), DEPTH - level, np.uint8), bits[is_node]))
        codes = parents
    if not nodes:
        return b"", outside
    places, depths, words = (np.concatenate(parts) for parts in zip(*nodes, strict=True))
    return words[np.lexsort((depths, places))].astype("<u2").tobytes(), outside


def octree_cells(data: bytes) -> NDArray[np.int32]:
    """The leaves of a tree: indices i j k in cells of their level, the level and the state, shape (n, 5).

    Raises `ValueError` for bytes that are no tree.
    """
    found: list[tuple[int, int, int, int, int]] = []
    words = np.frombuffer(data, "<u2").tolist()
    waiting, read = ([(0, 0, 0, DEPTH)] if data else []), 0
    while waiting:
        *corner, level = waiting.pop()
        if read == len(words) or level == 0:
            raise ValueError(f"the tree has more than {DEPTH} levels, or ends after {read} nodes")
        word, below = words[read], []
        read += 1
        for child in range(8):
            state = word >> (2 * child) & 3
            x, y, z = (2 * of + (child >> axis & 1) for axis, of in enumerate(corner))
            if state == NODE:
                below.append((x, y, z, level - 1))
            elif state:
                begin = CENTER >> (level - 1)
                found.append((x - begin, y - begin, z - begin, level - 1, state))
        waiting += reversed(below)
    if read != len(words):
        raise ValueError(f"{len(words) - read} nodes follow the end of the tree")
    return np.array(found, np.int32).reshape(-1, 5)


def _codes(indices: NDArray[Any], level: int) -> tuple[NDArray[np.uint64], int]:
    """Ascending Morton codes of cells of a level, each once, and how many cells lie outside of the tree."""
    keys = indices.astype(np.int64) + (CENTER >> level)
    is_inside = ((keys >= 0) & (keys < (2 * CENTER >> level))).all(axis=1)
    x, y, z = keys[is_inside].T.astype(np.uint64)
    codes = _spread(x) | _spread(y) << np.uint64(1) | _spread(z) << np.uint64(2)
    return np.unique(codes), int(len(indices) - is_inside.sum())


def _spread(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The 16 bits of each value, three places apart."""
    for shift, mask in (
        (32, 0xFFFF00000000FFFF),
        (16, 0x00FF0000FF0000FF),
        (8, 0xF00F00F00F00F00F),
        (4, 0x30C30C30C30C30C3),
        (2, 0x9249249249249249),
    ):
        values = (values | values << np.uint64(shift)) & np.uint64(mask)
    return values
