"""Shows a map as it grows in the viewer of rerun: follow_in_rerun.py --map NAME.

With `--save map.rrd` it writes what the viewer reads, and ends after `--changes` changes.

It needs the package `mrol` and rerun: pip install './clients/python[rerun]', from the root of the repository.
"""

import argparse

try:
    import numpy as np
    import rerun as rr

    import mrol
except ImportError as missing:
    install = "pip install './clients/python[rerun]', from the root of the repository"
    raise SystemExit(f"{missing.name} is not there: {install}") from None

Voxels = set[tuple[int, ...]]


def main() -> None:
    """Follows the map by `watch`, and logs its voxels after each change."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--server", default="localhost:7333")
    parser.add_argument("--map", required=True)
    parser.add_argument("--level", type=int, default=0)
    parser.add_argument("--save", help="a file instead of the viewer")
    parser.add_argument("--changes", type=int, help="end after so many")
    chosen = parser.parse_args()
    m = mrol.connect(chosen.server).map(chosen.map)
    rr.init("mrol", spawn=not chosen.save)
    if chosen.save:
        rr.save(chosen.save)
    resolution_m = m.describe().levels[chosen.level].resolution_m
    voxels: Voxels = set()
    for number, event in enumerate(m.watch(delta_level=chosen.level)):
        if isinstance(event, mrol.WatchedState):
            voxels = set(map(tuple, event.indices().tolist()))
        elif isinstance(event, mrol.WatchedChange):
            voxels -= set(map(tuple, event.removed().tolist()))
            voxels |= set(map(tuple, event.added().tolist()))
            if isinstance(event.cause, mrol.WatchedScan):
                position = event.cause.map_from_sensor.translation_m
                rr.log(f"robots/{event.cause.robot}", rr.Points3D([position], radii=0.1, colors=[255, 0, 0]))
        rr.set_time("revision", sequence=event.revision)
        centers = (np.array(sorted(voxels)).reshape(-1, 3) + 0.5) * resolution_m
        rr.log("voxels", rr.Points3D(centers, radii=resolution_m / 2))
        if chosen.changes is not None and number >= chosen.changes:
            return


if __name__ == "__main__":
    main()
