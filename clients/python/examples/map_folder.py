"""A robot that maps a folder of scans: map_folder.py FOLDER --map NAME --resolution 0.1.

Each scan file (.ply, .pcd, .xyz, .npy, .bin, .f32, as `help(mrol.read_scan)` says) is a scan in the sensor frame, meters. They are
taken in the natural order of their names, scan2 before scan10. The first scan of an empty map says where the map's origin is, and
each other one is aligned from the last accepted pose.

It needs the package `mrol`: pip install ./clients/python, from the root of the repository.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

try:
    import mrol
except ImportError as missing:
    raise SystemExit(f"{missing.name} is not there: pip install ./clients/python, from the root of the repository") from None

NAMES_MAX = 4
"""Names of files that are printed of the beginning of their order."""


def main() -> int:
    """Maps the folder; 3 where a scan did not fit, 2 for what cannot be read, 1 where the server refuses or is not there."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--server", default="localhost:7333")
    parser.add_argument("--map", required=True)
    parser.add_argument("--resolution", type=float, default=0.1, help="side of a voxel where the map is to be made, meters")
    parser.add_argument("--robot", default="mapper")
    parser.add_argument("--first-pose", type=float, nargs=7, metavar="N", help="x y z qx qy qz qw of the first scan")
    parser.add_argument("--columns", help='of bare floats, arrays and text, such as "x y z i"')
    chosen = parser.parse_args()
    try:
        files = mrol.scan_files(chosen.folder)
        print(told_order([file.name for file in files]))
        m = mrol.connect(chosen.server).map(chosen.map, resolution=chosen.resolution, robot=chosen.robot)
        refused = insert_all(m, files, chosen.columns, chosen.first_pose)
        print(f"{len(files) - refused} of {len(files)} scans are in the map, which has {m.describe().voxels[0]} voxels")
    except (mrol.ServerError, mrol.TransportError, mrol.BadAnswer) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except (mrol.MrolError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 3 if refused else 0


def told_order(names: Sequence[str]) -> str:
    """The order of the files, in a line."""
    shown = [*names[:NAMES_MAX], "...", names[-1]] if len(names) > NAMES_MAX + 1 else names
    return f"{len(names)} scans, in this order: {' '.join(shown)}"


def insert_all(m: mrol.Map, files: Sequence[Path], columns: str | None, first_pose: Sequence[float] | None) -> int:
    """Inserts each file; how many were refused."""
    refused = 0
    for number, file in enumerate(files):
        guess = first_pose if number == 0 else None
        answer = m.insert(mrol.read_scan(file, columns), guess=guess, recover=True)
        x, y, z = answer.map_from_sensor.translation_m
        told = f"at {x:.2f} {y:.2f} {z:.2f}, {answer.new_voxels} new voxels" if answer.accepted else answer.reason
        print(f"{file.name}: {answer.verdict}, {told}")
        refused += not answer.accepted
    return refused


if __name__ == "__main__":
    raise SystemExit(main())
