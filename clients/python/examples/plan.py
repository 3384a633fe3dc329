"""A planner of OMPL that asks a map: plan.py --map NAME --from 1 1 1 --to 8 5 1.

A drone, a ball, flies through the map by RRT-Connect: each edge that the planner tries is one `check_motions`, and the path that it
finds is shortened by one more, which asks for all shortcuts at once. `examples/ompl` of the repository has more: a copy of the map
in the planner's process, batches, and checks of the paths by brute force.

It needs the package `mrol` and OMPL: pip install ./clients/python ompl, from the root of the repository.
"""

import argparse
import itertools

try:
    import numpy as np
    from numpy.typing import NDArray
    from ompl import base, geometric

    import mrol
except ImportError as missing:
    raise SystemExit(f"{missing.name} is not there: pip install ./clients/python ompl, from the root of the repository") from None

Path = NDArray[np.float64]


class Edges(base.MotionValidator):
    """Says whether the drone fits all along an edge."""

    def __init__(self, space: base.SpaceInformation, m: mrol.Map, body: mrol.Link) -> None:
        super().__init__(space)
        self.m, self.body = m, body

    def checkMotion(self, start: base.State, end: base.State) -> bool:  # noqa: N802
        """Asks the server."""
        edge = [[[state[axis] for axis in range(3)] for state in (start, end)]]
        return bool(self.m.check_motions(self.body, edge).free[0])


class Places(base.StateValidityChecker):
    """Says whether the drone fits at a place."""

    def __init__(self, space: base.SpaceInformation, m: mrol.Map, body: mrol.Link) -> None:
        super().__init__(space)
        self.m, self.body = m, body

    def isValid(self, state: base.State) -> bool:  # noqa: N802
        """Asks the server."""
        return bool(self.m.check_poses(self.body, [[state[axis] for axis in range(3)]]).fits[0])


def plan(m: mrol.Map, body: mrol.Link, start: list[float], goal: list[float], seconds: float) -> Path | None:
    """A path as rows of x y z, or None where none was found in time."""
    seen = m.voxels(2).centers_m
    space = base.RealVectorStateSpace(3)
    bounds = base.RealVectorBounds(3)
    for axis in range(3):
        bounds.setLow(axis, min(seen[:, axis].min(), start[axis], goal[axis]))
        bounds.setHigh(axis, max(seen[:, axis].max(), start[axis], goal[axis]))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    # They are held here: OMPL knows them by address alone.
    edges, places = Edges(information, m, body), Places(information, m, body)
    information.setMotionValidator(edges)
    setup.setStateValidityChecker(places)
    ends = [space.allocState(), space.allocState()]
    for state, place in zip(ends, (start, goal), strict=True):
        for axis in range(3):
            state[axis] = place[axis]
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(information))
    if not setup.solve(seconds) or not setup.haveExactSolutionPath():
        return None
    return np.array([[state[axis] for axis in range(3)] for state in setup.getSolutionPath().getStates()])


def shortened(m: mrol.Map, body: mrol.Link, path: Path) -> Path:
    """The path by its shortcuts: all of them are asked for at once, and from each corner the farthest free one is taken."""
    pairs = np.array(list(itertools.combinations(range(len(path)), 2)))
    free = m.check_motions(body, path[pairs]).free
    farthest = {int(begin): int(end) for begin, end in pairs[free]}
    corners = [0]
    while corners[-1] < len(path) - 1:
        corners.append(farthest.get(corners[-1], corners[-1] + 1))
    return path[corners]


def main() -> int:
    """Prints the path; 1 where none was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--server", default="localhost:7333")
    parser.add_argument("--map", required=True)
    parser.add_argument("--from", dest="start", type=float, nargs=3, required=True, metavar="N")
    parser.add_argument("--to", dest="goal", type=float, nargs=3, required=True, metavar="N")
    parser.add_argument("--radius", type=float, default=0.2)
    parser.add_argument("--seconds", type=float, default=10.0)
    chosen = parser.parse_args()
    m = mrol.connect(chosen.server).map(chosen.map)
    # Between two checks no point moves by more than half a voxel: with this padding what is free at the checks is free in between.
    padding_m = m.describe().resolution_m / 4
    body = mrol.Link(spheres=[[0, 0, 0, chosen.radius]], padding_m=padding_m)
    path = plan(m, body, chosen.start, chosen.goal, chosen.seconds)
    if path is None:
        print("no path was found")
        return 1
    short = shortened(m, body, path)
    for name, of in (("found", path), ("shortened", short)):
        length_m = np.linalg.norm(np.diff(of, axis=0), axis=1).sum()
        print(f"{name}: {length_m:.2f} m, {len(of)} corners")
    print("\n".join(" ".join(f"{x:.3f}" for x in corner) for corner in short))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
