"""Plans a handful of paths by every planner and every checker, and fails where one collides or none is found.

    python3 check_plans.py SERVER [--library LIBRARY] [--scans FOLDER]

It checks itself too: plans of a checker that takes every motion for free have to be found out.

What it needs: pip install -r examples/ompl/requirements.txt, from the root of the repository.
"""

import argparse
import sys
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import numpy as np

from batches import shorten
from checker import Bools, Checker, Places
from ground import CHECKERS, COLLIDES, PLANNERS, Ground, plan_by, told_freedom
from ompl_planning import Plan, set_seed
from oracle import Oracle
from serving import SCANS_OF_HALL, Server, server_with_maps

PAIRS = 5
TIME_LIMIT_S = 10.0
SEED = 7


class Careless:
    """A checker that says yes to everything."""

    def places_fit(self, places: Places) -> Bools:
        return np.ones(len(places), np.bool_)

    def motions_fit(self, motions: Places) -> Bools:
        return np.ones(len(motions), np.bool_)


@dataclass
class Verdict:
    """What came of some plans."""

    found: int
    faults: list[str]
    """Of paths that collide, or do not lead from start to goal."""

    def __str__(self) -> str:
        return "\n    ".join([f"{self.found} paths, {len(self.faults)} of them wrong", *self.faults])


def verdict(oracle: Oracle, plans: list[Plan], pairs: Places) -> Verdict:
    """What brute force says of plans for some pairs, in rounds."""
    faults = []
    for plan, (start, goal) in zip(plans, cycle(pairs)):
        if not plan.is_found:
            continue
        if not (np.allclose(plan.path[0], start) and np.allclose(plan.path[-1], goal)):
            faults.append("does not lead from start to goal")
        elif (said := told_freedom(oracle, plan.path)).startswith(COLLIDES):
            faults.append(said)
    return Verdict(sum(plan.is_found for plan in plans), faults)


def plans_by(planner: str, checker: Checker, ground: Ground, pairs: Places) -> list[Plan]:
    """A plan for each pair, and then the same shortened."""
    problem = ground.problem(checker)
    plans = [plan_by(planner, problem, pair, TIME_LIMIT_S, SEED) for pair in pairs]
    return plans + [shorten(checker, plan.path) if plan.is_found else plan for plan in plans]


def check_map(server: Server, name: str, library: str | None) -> bool:
    """Whether all planners find paths in a map, none is wrong, and those of a careless checker are."""
    ground = Ground.of(server.http, name)
    pairs, oracle = ground.pairs(PAIRS, SEED), ground.oracle()
    is_good = True
    for kind in CHECKERS:
        if kind == "replica" and library is None:
            print("skipped: no replica is asked, --library is not given", file=sys.stderr)
            continue
        checker = ground.checker(kind, server.grpc, library)
        for planner in PLANNERS:
            came = verdict(oracle, plans_by(planner, checker, ground, pairs), pairs)
            print(f"{name}, {planner}, {kind}: {came}", flush=True)
            is_good &= came.found > 0 and not came.faults
    for planner in PLANNERS:
        if not verdict(oracle, plans_by(planner, Careless(), ground, pairs), pairs).faults:
            print(f"{name}, {planner}: nobody notices that motions are not checked", file=sys.stderr)
            is_good = False
    return is_good


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary", help="the server")
    parser.add_argument("--library", help="of clients/c")
    parser.add_argument("--scans", type=Path, default=Path("../shared/data"), help="folder of the shared scans")
    chosen = parser.parse_args()
    set_seed(SEED)
    with server_with_maps(chosen.binary, chosen.scans) as server:
        if "hall" not in server.maps:
            hall = chosen.scans / SCANS_OF_HALL
            print(f"skipped: no plans in the hall, whose scans are not at {hall}", file=sys.stderr)
        is_good = all([check_map(server, name, chosen.library) for name in server.maps])
    if not is_good:
        raise SystemExit("a path is wrong, or a planner found none")


if __name__ == "__main__":
    main()
