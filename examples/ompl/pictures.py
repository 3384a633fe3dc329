"""Draws the pictures of the guide: a plan through the hall and one through the demonstration's building.

    python3 examples/ompl/pictures.py target/release/mrol ../shared/data .readme

What it needs: pip install -r examples/ompl/requirements.txt, from the root of the repository.
"""

import sys
from pathlib import Path

import numpy as np

from batches import shorten
from ground import Ground, plan_by
from ompl_planning import set_seed
from picture import View, draw
from serving import server_with_maps

# From, to, heights between which the drone flies, height above which no voxels are drawn, how the map is turned and tipped.
PLANS = {
    "hall": ((-19.0, -8.0, 2.0), (9.7, -2.4, 1.1), (-1.5, 2.0), 3.5, View(-35, 50)),
    "demo": ((1.5, 1.5, 1.2), (12.5, 8.0, 1.3), (0.4, 2.2), 2.3, View(-30, 50)),
}


def main() -> None:
    binary, scans, folder = sys.argv[1:]
    set_seed(1)
    with server_with_maps(binary, Path(scans)) as server:
        for name in server.maps:
            start, goal, heights, cut_m, view = PLANS[name]
            ground = Ground.of(server.http, name)
            ground.low[2], ground.high[2] = heights
            problem = ground.problem(ground.checker("wire", server.grpc, None))
            plan = plan_by("rrt-connect", problem, np.array([start, goal]), 10.0, 1)
            if not plan.is_found:
                raise SystemExit(f"no path through {name}")
            paths = (plan.path, shorten(problem.checker, plan.path).path)
            file = Path(folder) / f"ompl-{name}.png"
            draw(ground.served, paths, str(file), view, cut_m)
            print(f"{file}: {file.stat().st_size} bytes")


if __name__ == "__main__":
    main()
