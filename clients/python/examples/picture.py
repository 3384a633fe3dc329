"""A picture of a map from above and aslant: picture.py --map NAME --out map.png.

It needs the package `mrol` and matplotlib: pip install './clients/python[pictures]', from the root of the repository.
"""

import argparse

try:
    import matplotlib as mpl
    import numpy as np

    import mrol

    mpl.use("Agg")
    from matplotlib import pyplot as plt
except ImportError as missing:
    install = "pip install './clients/python[pictures]', from the root of the repository"
    raise SystemExit(f"{missing.name} is not there: {install}") from None

SHOWN_MAX = 60_000
"""Voxels that are drawn: more take long and show no more."""


def main() -> None:
    """Draws it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--server", default="localhost:7333")
    parser.add_argument("--map", required=True)
    parser.add_argument("--out", default="map.png")
    parser.add_argument("--band", type=float, nargs=2, metavar="Z", help="heights above the floor between which the grid looks")
    parser.add_argument("--band-from", choices=["floor", "map"], default="floor", help="map: the band counts from the map's z = 0")
    chosen = parser.parse_args()
    m = mrol.connect(chosen.server).map(chosen.map)
    low, high = chosen.band or (None, None)
    grid = m.grid(min_z_m=low, max_z_m=high, band_from=chosen.band_from, tell_unknown=True)
    assert grid.free is not None
    figure = plt.figure(figsize=(13, 6))
    above = figure.add_subplot(1, 2, 1)
    shade = np.where(grid.occupied, 0.0, np.where(grid.free, 1.0, 0.8))
    above.imshow(shade, cmap="gray", vmin=0, vmax=1, origin="lower", extent=grid.extent_m)
    track = m.trajectory().positions_m
    above.plot(track[:, 0], track[:, 1], "r.-", linewidth=0.7, markersize=3)
    above.set(title=f"{m.name}, revision {grid.revision}: black occupied, white free, gray unknown", xlabel="x [m]", ylabel="y [m]")
    aslant = figure.add_subplot(1, 2, 2, projection="3d")
    centers = m.voxels().centers_m
    centers = centers[:: max(1, len(centers) // SHOWN_MAX)]
    aslant.scatter(*centers.T, c=centers[:, 2], s=1, cmap="viridis")
    aslant.set_aspect("equal")
    figure.tight_layout()
    figure.savefig(chosen.out, dpi=110)


if __name__ == "__main__":
    main()
