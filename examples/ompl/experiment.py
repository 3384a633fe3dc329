"""Compares what planners ask: requests to a server, a copy of its map, and an octree of FCL.

    python3 experiment.py target/release/mrol --library target/release/libmrol_replica.so --scans ../shared/data

Random pairs of start and goal in the building of `mrol demo`, and in a hall where its scans are there. Every path is checked
again by brute force. Each checker has a process of its own, which begins with the same seed: as long as all answers are the
same, planners draw the same states and ask the same questions, so that times compare the checkers alone.

What it needs: pip install -r examples/ompl/requirements.txt, from the root of the repository.
"""

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from batches import shorten
from checker import DRONE, Checker, Places
from ground import CHECKERS, PLANNERS, Ground, plan_by
from ompl_planning import Plan, set_seed
from oracle import Oracle
from reach import Reach
from serving import Server, server_with_maps

SHORTENED_PLANNER = "rrt-connect"
SHORTENERS = ("OMPL's simplifier", "shorten")
PATHS_FOR_SHORTENERS = 30
MOTIONS_FIRST, MOTIONS_ALONE, MOTIONS_AT_ONCE = 2000, 300, 1000


@dataclass
class Task:
    """What one process measures: all planners over one checker in one map."""

    server: Server
    library: str | None
    map: str
    checker: str
    pairs: Places
    time_limit_s: float
    seed: int


@dataclass
class Measured:
    """What a process measured."""

    plans: dict[str, list[Plan]]
    """Of each planner, pair by pair."""
    shortened: dict[str, list[Plan]]
    first_ms: float
    """Time of the first questions, for which the server and the replica make the distance field of the map."""
    motion_us: float
    """Time of a motion of 1 m that is asked about alone, in the median."""
    motion_of_many_us: float
    """The same where many are asked about at once."""


def measure(task: Task) -> Measured:
    """Plans for all pairs; in a process of its own."""
    set_seed(task.seed)
    ground = Ground.of(task.server.http, task.map)
    checker = ground.checker(task.checker, task.server.grpc, task.library)
    first_ms = timed(partial(checker.motions_fit, anywhere(ground, task.seed))) / 1e3
    problem = ground.problem(checker)
    plans = {
        planner: [plan_by(planner, problem, pair, task.time_limit_s, seed) for seed, pair in enumerate(task.pairs)]
        for planner in PLANNERS
    }
    paths = [plan.path for plan in plans[SHORTENED_PLANNER] if plan.is_found][:PATHS_FOR_SHORTENERS]
    shortened = {
        SHORTENERS[0]: [problem.simplify(path) for path in paths],
        SHORTENERS[1]: [shorten(checker, path) for path in paths],
    }
    return Measured(plans, shortened, first_ms, *motion_times(checker, task.pairs, task.seed))


def anywhere(ground: Ground, seed: int) -> Places:
    """Motions across the map, so many that hardly a place is left that nobody has asked about."""
    return np.random.default_rng(seed).uniform(ground.low, ground.high, (MOTIONS_FIRST, 2, 3))


def motion_times(checker: Checker, pairs: Places, seed: int) -> tuple[float, float]:
    """Microseconds of a motion of 1 m from where planners begin: asked about alone, and as one of many."""
    random = np.random.default_rng(seed)
    starts = pairs[random.integers(len(pairs), size=MOTIONS_AT_ONCE), 0]
    steps = random.normal(size=starts.shape)
    motions = np.stack([starts, starts + steps / np.linalg.norm(steps, axis=1, keepdims=True)], 1)
    alone = [timed(partial(checker.motions_fit, motion[None])) for motion in motions[:MOTIONS_ALONE]]
    return float(np.median(alone)), timed(partial(checker.motions_fit, motions)) / len(motions)


def timed(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return (time.perf_counter() - begin) * 1e6


def compare(task: Task, checkers: list[str]) -> bool:
    """Measures all checkers in a map, and prints the tables; whether no path collides."""
    measured = {}
    for checker in checkers:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
            measured[checker] = process.submit(measure, replace(task, checker=checker)).result()
    ground = Ground.of(task.server.http, task.map)
    oracle = ground.oracle()
    reach = Reach.of(ground.voxels, ground.served.resolution_m, DRONE, ground.low, ground.high)
    print(f"\n{task.map}: {len(task.pairs)} pairs, {told_reach(reach, task.pairs, measured)}")
    least_m = min(print_plans(measured, oracle), print_shortened(measured, oracle))
    print(
        "\n| asks | a motion of 1 m alone, us | of 1,000 at once, us | the first 2,000 anywhere, ms |\n|---|---|---|---|"
    )
    for checker, of_checker in measured.items():
        times = f"{of_checker.motion_us:.1f} | {of_checker.motion_of_many_us:.2f} | {of_checker.first_ms:.0f}"
        print(f"| {checker} | {times} |")
    return least_m > 0


def print_plans(measured: dict[str, Measured], oracle: Oracle) -> float:
    """Prints the table of planners; the least clearance of their paths, meters."""
    print(
        "\n| planner | asks | solved | median, ms | p95, ms | questions a plan | questions a second | clearance, mm |"
    )
    print("|---|---|---|---|---|---|---|---|")
    clearances = []
    for planner in PLANNERS:
        for checker, of_checker in measured.items():
            plans = of_checker.plans[planner]
            clearances.append(least_clearance(oracle, plans))
            print(f"| {planner} | {checker} | {row(plans)} | {clearances[-1] * 1e3:.1f} |")
    return min(clearances)


def print_shortened(measured: dict[str, Measured], oracle: Oracle) -> float:
    """Prints the table of shorter paths; their least clearance, meters."""
    print(
        f"\n| shortening a path of {SHORTENED_PLANNER} | asks | median, ms | questions | length left | clearance, mm |"
    )
    print("|---|---|---|---|---|---|")
    clearances = []
    for shortener in SHORTENERS:
        for checker, of_checker in measured.items():
            short = of_checker.shortened[shortener]
            found = [plan for plan in of_checker.plans[SHORTENED_PLANNER] if plan.is_found]
            left = np.median([after.length_m / before.length_m for after, before in zip(short, found)])
            clearances.append(least_clearance(oracle, short))
            cells = [shortener, checker, milliseconds(short, 50), f"{np.median([plan.checks for plan in short]):.0f}"]
            print("|", " | ".join([*cells, f"{left:.2f}", f"{clearances[-1] * 1e3:.1f}"]), "|")
    return min(clearances)


def told_reach(reach: Reach, pairs: Places, measured: dict[str, Measured]) -> str:
    """How many pairs are joined by a path, which no path joins, and which ones are open."""
    plans = [plans for of_checker in measured.values() for plans in of_checker.plans.values()]
    solved = [any(of_planner[i].is_found for of_planner in plans) for i in range(len(pairs))]
    apart = [reach.are_apart(*pair) for pair in pairs]
    undecided = [i for i in range(len(pairs)) if not solved[i] and not apart[i]]
    return f"{sum(solved)} joined by a path, {sum(apart)} proved to be unreachable, undecided: {undecided or 'none'}"


def least_clearance(oracle: Oracle, plans: list[Plan]) -> float:
    """The least distance of the drone from the map on any path, by brute force, meters."""
    return min((oracle.contact(plan.path).clearance_m for plan in plans if plan.is_found), default=np.inf)


def row(plans: list[Plan]) -> str:
    """Cells of a table: solved, times of what was solved, checks."""
    solved = [plan for plan in plans if plan.is_found]
    checks, seconds = sum(plan.checks for plan in plans), sum(plan.seconds for plan in plans)
    cells = [f"{len(solved)} of {len(plans)}", milliseconds(solved, 50), milliseconds(solved, 95)]
    cells += [f"{np.median([plan.checks for plan in solved]):.0f}", f"{checks / seconds:,.0f}"]
    return " | ".join(cells)


def milliseconds(plans: list[Plan], percentile: float) -> str:
    return f"{np.percentile([plan.seconds * 1e3 for plan in plans], percentile):.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary", help="the server")
    parser.add_argument("--library", help="of clients/c; without it, no replica is asked")
    parser.add_argument("--scans", type=Path, default=Path("../shared/data"), help="folder of the shared scans")
    parser.add_argument("--pairs", type=int, default=100)
    parser.add_argument("--time-limit", type=float, default=10.0, help="seconds for a plan")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    checkers = [checker for checker in CHECKERS if checker != "replica" or chosen.library]
    is_free = True
    with server_with_maps(chosen.binary, chosen.scans) as server:
        for name in server.maps:
            pairs = Ground.of(server.http, name).pairs(chosen.pairs, chosen.seed)
            task = Task(server, chosen.library, name, "", pairs, chosen.time_limit, chosen.seed)
            is_free &= compare(task, checkers)
    if not is_free:
        raise SystemExit("a path collides")


if __name__ == "__main__":
    main()
