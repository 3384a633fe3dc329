"""Plans paths of a drone in a map of a server, by planners of OMPL or by a roadmap that asks in batches.

    python3 plan.py --map demo --from "1 7.6 1.2" --to "12.9 7.4 1.3" --picture path.png
    python3 plan.py --map demo --pairs 20 --planner bit-star --checker replica --library libmrol_replica.so
"""

import argparse
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from batches import Roadmap, shorten
from checker import DRONE, Checker, Places
from ompl_planning import PLANNERS, Plan, Problem, set_seed
from oracle import Oracle
from pairs import draw_pairs, region_of
from server import ServedMap, ServerChecker

BATCHES = "roadmap"
CHECKERS = ("wire", "replica", "octree")
COLLIDES = "COLLIDES"


@dataclass
class Ground:
    """A map to plan in."""

    served: ServedMap
    voxels: NDArray[np.int64]
    low: Places
    high: Places

    @staticmethod
    def of(address: str, name: str) -> "Ground":
        served = ServedMap(address, name)
        voxels = served.voxels()
        return Ground(served, voxels, *region_of(voxels, served.resolution_m, DRONE))

    def checker(self, kind: str, grpc: str, library: str | None) -> Checker:
        """What answers the planner's questions: the server, a copy of the map in this process, or an octree."""
        if kind == "octree":
            from octree import OctreeChecker

            return OctreeChecker(self.voxels, self.served.resolution_m, DRONE)
        if kind == "replica":
            from replica import ReplicaChecker

            if library is None:
                raise SystemExit("--checker replica needs --library, the shared library of clients/c")
            return ReplicaChecker(library, grpc, self.served.name, self.served.resolution_m, DRONE)
        return ServerChecker(self.served, DRONE)

    def oracle(self) -> Oracle:
        """Who checks paths again."""
        return Oracle(self.voxels, self.served.resolution_m, DRONE)


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--server", default="http://127.0.0.1:7333", help="address of HTTP")
    parser.add_argument("--map", default="demo")
    parser.add_argument("--from", dest="start", help='where the path begins: "x y z"')
    parser.add_argument("--to", dest="goal", help="where it ends")
    parser.add_argument("--pairs", type=int, default=10, help="without --from and --to: how many random pairs")
    parser.add_argument("--heights", help='between which the drone flies: "low high", meters')
    parser.add_argument("--planner", choices=(*PLANNERS, BATCHES), default="rrt-connect")
    parser.add_argument("--checker", choices=CHECKERS, default="wire")
    parser.add_argument("--library", help="of clients/c, for --checker replica")
    parser.add_argument("--grpc", default="http://127.0.0.1:7334", help="address of gRPC, for --checker replica")
    parser.add_argument("--time-limit", type=float, default=5.0, help="seconds for a plan")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--picture", help="PNG of the first plan, as found and shortened")
    parser.add_argument("--view", default="-30 50", help="how the map is turned and tipped in it, degrees")
    parser.add_argument("--cut", type=float, default=np.inf, help="height above which it has no voxels, meters")
    return parser.parse_args()


def main() -> None:
    chosen = options()
    set_seed(chosen.seed)
    ground = Ground.of(chosen.server, chosen.map)
    if chosen.heights:
        ground.low[2], ground.high[2] = numbers(chosen.heights)
    checker = ground.checker(chosen.checker, chosen.grpc, chosen.library)
    problem, oracle = Problem(checker, ground.low, ground.high), ground.oracle()
    shown = None
    for start, goal in pairs_of(chosen, ground, checker):
        if chosen.planner == BATCHES:
            plan = Roadmap(checker, ground.low, ground.high, chosen.seed).plan(start, goal, chosen.time_limit)
        else:
            plan = problem.plan(chosen.planner, start, goal, chosen.time_limit)
        if plan.path is None:
            print(f"{text(start)} to {text(goal)}: no path in {plan.seconds:.1f} s and {plan.checks} checks")
            continue
        short = shorten(checker, plan.path)
        shown = shown or (plan.path, short.path)
        print(f"{text(start)} to {text(goal)}: {told(plan)}; shortened: {told(short)}; {freedom(oracle, short.path)}")
    if chosen.picture and shown:
        draw_picture(chosen, ground, [*shown])


def pairs_of(chosen: argparse.Namespace, ground: Ground, checker: Checker) -> Places:
    """The pair that was given, or random ones."""
    if chosen.start is None or chosen.goal is None:
        return draw_pairs(ground.served, checker, ground.low, ground.high, chosen.pairs, chosen.seed)
    return np.array([[numbers(chosen.start), numbers(chosen.goal)]])


def draw_picture(chosen: argparse.Namespace, ground: Ground, paths: list[Places]) -> None:
    from picture import View, draw

    turn, tip = numbers(chosen.view)
    draw(ground.served, paths, chosen.picture, View(turn, tip), chosen.cut)


def numbers(words: str) -> list[float]:
    return [float(word) for word in words.replace(",", " ").split()]


def text(place: Places) -> str:
    return "(" + " ".join(f"{number:.2f}" for number in place) + ")"


def told(plan: Plan) -> str:
    """A plan in words."""
    assert plan.path is not None
    length_m = np.linalg.norm(np.diff(plan.path, axis=0), axis=1).sum()
    return f"{length_m:.1f} m, {len(plan.path)} corners, {plan.seconds * 1e3:.1f} ms, {plan.checks} checks"


def freedom(oracle: Oracle, path: Places) -> str:
    """What brute force says of a path."""
    clearance_m = oracle.contact(path).clearance_m
    if clearance_m <= 0:
        return f"{COLLIDES} by {-clearance_m:.3f} m"
    return f"nothing within {clearance_m:.3f} m"


if __name__ == "__main__":
    main()
