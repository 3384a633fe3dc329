"""Plans paths of a drone in a map of a server, by planners of OMPL or by a roadmap that asks in batches.

    python3 plan.py --map demo --from "1 7.6 1.2" --to "12.9 7.4 1.3" --picture path.png
    python3 plan.py --map demo --pairs 20 --planner bit-star --checker replica --library libmrol_replica.so

What it needs: pip install -r examples/ompl/requirements.txt, from the root of the repository.
"""

import argparse

import numpy as np

from batches import shorten
from checker import Places
from ground import CHECKERS, PLANNERS, Ground, plan_by, told_freedom
from ompl_planning import Plan, set_seed


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--server", default="http://127.0.0.1:7333", help="address of HTTP")
    parser.add_argument("--map", default="demo")
    parser.add_argument("--from", dest="start", help='where the path begins: "x y z"')
    parser.add_argument("--to", dest="goal", help="where it ends")
    parser.add_argument("--pairs", type=int, default=10, help="without --from and --to: how many random pairs")
    parser.add_argument("--heights", help='between which the drone flies: "low high", meters')
    parser.add_argument("--planner", choices=PLANNERS, default="rrt-connect")
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
    problem = ground.problem(ground.checker(chosen.checker, chosen.grpc, chosen.library))
    oracle, shown = ground.oracle(), None
    for start, goal in pairs_of(chosen, ground):
        plan = plan_by(chosen.planner, problem, np.array([start, goal]), chosen.time_limit, chosen.seed)
        if not plan.is_found:
            print(f"{text(start)} to {text(goal)}: no path in {plan.seconds:.1f} s and {plan.checks} checks")
            continue
        short = shorten(problem.checker, plan.path)
        shown = shown or (plan.path, short.path)
        said = told_freedom(oracle, short.path)
        print(f"{text(start)} to {text(goal)}: {told(plan)}; shortened: {told(short)}; {said}")
    if chosen.picture and shown:
        from picture import View, draw

        draw(ground.served, shown, chosen.picture, View(*numbers(chosen.view)), chosen.cut)


def pairs_of(chosen: argparse.Namespace, ground: Ground) -> Places:
    """The pair that was given, or random ones."""
    if chosen.start is None or chosen.goal is None:
        return ground.pairs(chosen.pairs, chosen.seed)
    return np.array([[numbers(chosen.start), numbers(chosen.goal)]])


def numbers(words: str) -> list[float]:
    return [float(word) for word in words.replace(",", " ").split()]


def text(place: Places) -> str:
    return "(" + " ".join(f"{number:.2f}" for number in place) + ")"


def told(plan: Plan) -> str:
    """A plan in words."""
    return f"{plan.length_m:.1f} m, {len(plan.path)} corners, {plan.seconds * 1e3:.1f} ms, {plan.checks} checks"


if __name__ == "__main__":
    main()
