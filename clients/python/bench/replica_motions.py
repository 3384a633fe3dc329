"""Times motions of a ball, an edge a call, in the demo's building: bench/replica_motions.py ADDRESS MAP, while `mrol demo` serves.

Prints the microseconds of an edge by `motion_is_free`, by `check_motions` an edge a call, and by `check_motions` with all at once.
"""

import sys
import time
from collections.abc import Callable

import numpy as np

import mrol.replica

EDGES = 20_000
LENGTH_M = 0.5
RADIUS_M = 0.3


def microseconds_an_edge(ask: Callable[[], int], edges: int) -> tuple[float, int]:
    """The time of an edge the second time, and how many are free."""
    ask()
    begin = time.perf_counter()
    free = ask()
    return (time.perf_counter() - begin) / edges * 1e6, free


def main() -> None:
    address, name = sys.argv[1:]
    replica = mrol.replica.Replica(address, name)
    body = mrol.replica.PreparedBody([[0.0, 0.0, 0.0, RADIUS_M]])
    rng = np.random.default_rng(1)
    edges = np.zeros((EDGES, 2, 7), np.float32)
    edges[:, 0, :3] = rng.uniform([1, 1, 0.5], [19, 13, 2], (EDGES, 3))
    edges[:, 1, :3] = edges[:, 0, :3]
    edges[np.arange(EDGES), 1, rng.integers(0, 3, EDGES)] += LENGTH_M
    edges[..., 6] = 1
    one_by_one = list(edges)
    is_free = replica.motion_is_free
    ways = {
        "motion_is_free": lambda: sum(is_free(body, edge) for edge in one_by_one),
        "check_motions, an edge a call": lambda: sum(replica.check_motions(body, edge).count for edge in one_by_one),
        "check_motions, all at once": lambda: replica.check_motions(body, edges).count,
    }
    for way, ask in ways.items():
        took, free = microseconds_an_edge(ask, EDGES)
        print(f"{way}: {took:.2f} us an edge, {free} of {EDGES} free")


main()
