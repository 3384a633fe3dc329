"""A robot that maps a folder of scans: map_folder.py FOLDER --map NAME --resolution 0.1.

Each file is a scan in the sensor frame, meters: `.npy` (n, 3), raw `.f32`, or `.xyz` with a point a line; in the order of their
names. The first scan of an empty map says where the map's origin is, and each other one is aligned from the last accepted pose.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import mrol

SUFFIXES = (".npy", ".f32", ".xyz")


def main() -> int:
    """Maps the folder; 3 where a scan did not fit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--server", default="localhost:7333")
    parser.add_argument("--map", required=True)
    parser.add_argument("--resolution", type=float, default=0.1, help="side of a voxel where the map is to be made, meters")
    parser.add_argument("--robot", default="mapper")
    parser.add_argument("--first-pose", type=float, nargs=7, metavar="N", help="x y z qx qy qz qw of the first scan")
    chosen = parser.parse_args()
    m = mrol.connect(chosen.server).map(chosen.map, resolution=chosen.resolution, robot=chosen.robot)
    files = sorted(file for file in chosen.folder.iterdir() if file.suffix in SUFFIXES)
    refused = 0
    for number, file in enumerate(files):
        guess = chosen.first_pose if number == 0 else None
        answer = m.insert(scan_of(file), guess=guess, recover=True)
        x, y, z = answer.map_from_sensor.translation_m
        told = f"at {x:.2f} {y:.2f} {z:.2f}, {answer.new_voxels} new voxels" if answer.accepted else answer.reason
        print(f"{file.name}: {answer.verdict}, {told}")
        refused += not answer.accepted
    print(f"{len(files) - refused} of {len(files)} scans are in the map, which has {m.describe().voxels[0]} voxels")
    return 3 if refused else 0


def scan_of(file: Path) -> NDArray[np.float32]:
    """The points of a file."""
    if file.suffix == ".npy":
        points = np.load(file)
    elif file.suffix == ".f32":
        points = np.fromfile(file, "<f4").reshape(-1, 3)
    else:
        points = np.loadtxt(file, ndmin=2)[:, :3]
    return points.astype(np.float32)


if __name__ == "__main__":
    raise SystemExit(main())
