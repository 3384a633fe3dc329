"""Compares what planners ask: requests to a server, a copy of its map, and an octree of FCL.

    python3 experiment.py target/release/mrol --library target/release/libmrol_replica.so --scans ../shared/data

Random pairs of start and goal in the building of `mrol demo`, and in a hall where its scans are there. Every path is checked
again by brute force. Each checker has a process of its own, which begins with the same seed: as long as all answers are the
same, planners draw the same states and ask the same questions, so that times compare the checkers alone.
"""

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from batches import Roadmap, shorten
from checker import DRONE, Checker, Places
from ompl_planning import PLANNERS, Plan, Problem, set_seed
from oracle import Oracle
from pairs import draw_pairs
from plan import BATCHES, CHECKERS, Ground
from reach import Reach
from server import ServerChecker
from serving import Server, server_with_maps

SHORTENERS = ("OMPL's simplifier", "shorten")
PATHS_FOR_SHORTENERS = 30
MOTIONS_AT_ONCE = 1000


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
    motion_us: float
    """Time of a motion of 1 m that is asked about alone, in the median."""
    motion_of_many_us: float
    """The same where many are asked about at once."""


def measure(task: Task) -> Measured:
    """Plans for all pairs; in a process of its own."""
    set_seed(task.seed)
    ground = Ground.of(task.server.http, task.map)
    checker = ground.checker(task.checker, task.server.grpc, task.library)
    # The first question makes the map's distance field.
    checker.motions_fit(task.pairs)
    problem = Problem(checker, ground.low, ground.high)
    planners: dict[str, Callable[[int, Places], Plan]] = {
        name: lambda _, pair, name=name: problem.plan(name, *pair, task.time_limit_s) for name in PLANNERS
    }
    planners[BATCHES] = lambda i, pair: Roadmap(checker, ground.low, ground.high, i).plan(*pair, task.time_limit_s)
    plans = {name: [plan(i, pair) for i, pair in enumerate(task.pairs)] for name, plan in planners.items()}
    paths = [plan.path for plan in plans["rrt-connect"] if plan.path is not None][:PATHS_FOR_SHORTENERS]
    shortened = {
        SHORTENERS[0]: [problem.simplify(path) for path in paths],
        SHORTENERS[1]: [shorten(checker, path) for path in paths],
    }
    return Measured(plans, shortened, *motion_times(checker, task.pairs, task.seed))


def motion_times(checker: Checker, pairs: Places, seed: int) -> tuple[float, float]:
    """Microseconds of a motion of 1 m from where planners begin: asked about alone, and as one of many."""
    random = np.random.default_rng(seed)
    starts = pairs[random.integers(len(pairs), size=MOTIONS_AT_ONCE), 0]
    steps = random.normal(size=starts.shape)
    motions = np.stack([starts, starts + steps / np.linalg.norm(steps, axis=1, keepdims=True)], 1)
    alone = [timed(lambda: checker.motions_fit(motion[None])) for motion in motions[:300]]
    return float(np.median(alone)), timed(lambda: checker.motions_fit(motions)) / len(motions)


def timed(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return (time.perf_counter() - begin) * 1e6


def compare(task: Task, checkers: list[str]) -> bool:
    """Measures all checkers in a map, and prints the tables; whether no path collides."""
    measured = {}
    for checker in checkers:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
            measured[checker] = process.submit(measure, Task(**{**vars(task), "checker": checker})).result()
    ground = Ground.of(task.server.http, task.map)
    oracle = ground.oracle()
    reach = Reach.of(ground.voxels, ground.served.resolution_m, DRONE, ground.low, ground.high)
    print(f"\n{task.map}: {len(task.pairs)} pairs, {told_reach(reach, task.pairs, measured)}")
    print("\n| planner | asks | solved | median, ms | p95, ms | checks a plan | checks a second | least clearance, mm |")
    print("|---|---|---|---|---|---|---|---|")
    is_free = True
    for planner in (*PLANNERS, BATCHES):
        for checker in checkers:
            plans = measured[checker].plans[planner]
            least_m = least_clearance(oracle, plans)
            is_free &= least_m > 0
            print(f"| {planner} | {checker} | {row(plans)} | {least_m * 1e3:.1f} |")
    print("\n| shortening a path of RRT-Connect | asks | median, ms | checks a path | length left | least clearance, mm |")
    print("|---|---|---|---|---|---|")
    for shortener in SHORTENERS:
        for checker in checkers:
            short = measured[checker].shortened[shortener]
            found = [plan.path for plan in measured[checker].plans["rrt-connect"] if plan.path is not None]
            left = np.median([length(after.path) / length(before) for after, before in zip(short, found)])
            least_m = least_clearance(oracle, short)
            is_free &= least_m > 0
            checks = np.median([plan.checks for plan in short])
            print(f"| {shortener} | {checker} | {milliseconds(short, 50)} | {checks:.0f} | {left:.2f} | {least_m * 1e3:.1f} |")
    print("\n| a motion of 1 m, us | alone | of 1,000 at once |")
    print("|---|---|---|")
    for checker in checkers:
        print(f"| {checker} | {measured[checker].motion_us:.1f} | {measured[checker].motion_of_many_us:.2f} |")
    return is_free


def told_reach(reach: Reach, pairs: Places, measured: dict[str, Measured]) -> str:
    """How many pairs are joined by a path, which no path joins, and which ones are open."""
    plans = [plans for of_checker in measured.values() for plans in of_checker.plans.values()]
    solved = [any(of_planner[i].path is not None for of_planner in plans) for i in range(len(pairs))]
    apart = [reach.are_apart(*pair) for pair in pairs]
    undecided = [i for i in range(len(pairs)) if not solved[i] and not apart[i]]
    return f"{sum(solved)} joined by a path, {sum(apart)} proved to be unreachable, undecided: {undecided or 'none'}"


def least_clearance(oracle: Oracle, plans: list[Plan]) -> float:
    """The least distance of the drone from the map on any path, by brute force, meters."""
    return min((oracle.contact(plan.path).clearance_m for plan in plans if plan.path is not None), default=np.inf)


def row(plans: list[Plan]) -> str:
    """Cells of a table: solved, times of what was solved, checks."""
    solved = [plan for plan in plans if plan.path is not None]
    checks, seconds = sum(plan.checks for plan in plans), sum(plan.seconds for plan in plans)
    cells = [f"{len(solved)} of {len(plans)}", milliseconds(solved, 50), milliseconds(solved, 95)]
    cells += [f"{np.median([plan.checks for plan in solved]):.0f}", f"{checks / seconds:,.0f}"]
    return " | ".join(cells)


def milliseconds(plans: list[Plan], percentile: float) -> str:
    return f"{np.percentile([plan.seconds * 1e3 for plan in plans], percentile):.1f}"


def length(path: Places | None) -> float:
    assert path is not None
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


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
            ground = Ground.of(server.http, name)
            asked = ServerChecker(ground.served, DRONE)
            pairs = draw_pairs(ground.served, asked, ground.low, ground.high, chosen.pairs, chosen.seed)
            task = Task(server, chosen.library, name, "", pairs, chosen.time_limit, chosen.seed)
            is_free &= compare(task, checkers)
    if not is_free:
        raise SystemExit("a path collides")


if __name__ == "__main__":
    main()
