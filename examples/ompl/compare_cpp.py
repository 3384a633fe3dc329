"""Compares planners in C++: a copy of the map by mrol.hpp, and FCL with an octree of OctoMap.

    python3 compare_cpp.py target/release/mrol build/plans --scans ../shared/data

`cpp/CMakeLists.txt` says how `plans` is built. Random pairs of start and goal in the building of `mrol demo`, and in a hall where its
scans are there; RRT-Connect, each in a process of its own with the same seed. Every path is checked again by brute force.

What it needs: pip install -r examples/ompl/requirements.txt, from the root of the repository.
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from checker import Places, padding_between_checks
from ground import Ground
from serving import server_with_maps


def planned(words: list[str]) -> tuple[list[float], list[Places | None]]:
    """Milliseconds and paths of all pairs."""
    lines = subprocess.run(words, check=True, capture_output=True, text=True).stdout.splitlines()
    numbers = [np.array(line.split(), np.float64) for line in lines]
    return [line[0] for line in numbers], [line[1:].reshape(-1, 3) if len(line) > 1 else None for line in numbers]


def compare(program: str, grpc: str, ground: Ground, pairs: int, seed: int) -> bool:
    """Prints a table of a map; whether no path collides."""
    resolution_m = ground.served.resolution_m
    asked = ground.pairs(pairs, seed)
    oracle = ground.oracle()
    print(f"\n{ground.served.name}: {pairs} pairs\n\n| asks | solved | median, ms | p95, ms | clearance, mm |\n|---|---|---|---|---|")
    least_m = np.inf
    with tempfile.TemporaryDirectory() as folder:
        places, voxels = Path(folder) / "places", Path(folder) / "voxels"
        places.write_bytes(np.concatenate([[ground.low], [ground.high], asked.reshape(-1, 3)]).astype("<f8").tobytes())
        voxels.write_bytes(((ground.voxels + 0.5) * resolution_m).astype("<f8").tobytes())
        numbers = [str(places), repr(resolution_m), repr(padding_between_checks(resolution_m / 2))]
        for name, who in (("mrol", [grpc, ground.served.name]), ("fcl", [str(voxels), "-"])):
            times, paths = planned([program, name, *who, *numbers])
            found = [path for path in paths if path is not None]
            clearance_m = min((oracle.contact(path).clearance_m for path in found), default=np.inf)
            least_m = min(least_m, clearance_m)
            figures = f"{np.median(times):.3f} | {np.percentile(times, 95):.2f} | {clearance_m * 1e3:.1f}"
            print(f"| {name} | {len(found)} of {len(paths)} | {figures} |", flush=True)
    return bool(least_m > 0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="target/release/mrol")
    parser.add_argument("plans", help="the program of cpp/")
    parser.add_argument("--scans", type=Path, default=Path("../shared/data"), help="folder with the scans of the hall")
    parser.add_argument("--pairs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    with server_with_maps(chosen.program, chosen.scans) as server:
        done = [
            compare(chosen.plans, server.grpc, Ground.of(server.http, name), chosen.pairs, chosen.seed)
            for name in server.maps
        ]
    if not all(done):
        raise SystemExit("a path collides")


main()
