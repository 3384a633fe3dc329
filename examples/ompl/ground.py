"""A map to plan in: what is known of it, who answers questions about it, and who plans."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from batches import Roadmap
from checker import DRONE, Checker, Places
from ompl_planning import OMPL_PLANNERS, Plan, Problem
from oracle import Oracle
from pairs import draw_pairs, region_of
from server import ServedMap, ServerChecker

CHECKERS = ("wire", "replica", "octree")
"""Who answers: the server, a copy of the map in this process, or an octree in this process."""
ROADMAP = "roadmap"
PLANNERS = (*OMPL_PLANNERS, ROADMAP)
COLLIDES = "COLLIDES"


@dataclass
class Ground:
    """A map of a server, and the box of it where the drone may be."""

    served: ServedMap
    voxels: NDArray[np.int64]
    low: Places
    high: Places

    @staticmethod
    def of(address: str, name: str) -> "Ground":
        """The map of this name, its voxels copied."""
        served = ServedMap(address, name)
        voxels = served.voxels()
        return Ground(served, voxels, *region_of(voxels, served.resolution_m, DRONE))

    def checker(self, kind: str, grpc: str, library: str | None) -> Checker:
        """Who answers the planner's questions; a replica takes an address of gRPC and the library of clients/c."""
        if kind == "octree":
            from octree import OctreeChecker

            return OctreeChecker(self.voxels, self.served.resolution_m, DRONE)
        if kind == "replica":
            from replica import ReplicaChecker

            if library is None:
                raise SystemExit("a replica takes --library, the shared library of clients/c")
            return ReplicaChecker(library, grpc, self.served.name, self.served.resolution_m, DRONE)
        return ServerChecker(self.served, DRONE)

    def pairs(self, count: int, seed: int) -> Places:
        """Random pairs of start and goal."""
        return draw_pairs(self.served, ServerChecker(self.served, DRONE), self.low, self.high, count, seed)

    def problem(self, checker: Checker) -> Problem:
        """What OMPL is asked to solve."""
        return Problem(checker, self.low, self.high)

    def oracle(self) -> Oracle:
        """Who checks paths again."""
        return Oracle(self.voxels, self.served.resolution_m, DRONE)


def plan_by(planner: str, problem: Problem, pair: Places, time_limit_s: float, seed: int) -> Plan:
    """A path from the start to the goal of a pair, by a planner of OMPL or by a roadmap, which alone takes the seed."""
    if planner == ROADMAP:
        return Roadmap(problem.checker, problem.low, problem.high, seed).plan(pair[0], pair[1], time_limit_s)
    return problem.plan(planner, pair[0], pair[1], time_limit_s)


def told_freedom(oracle: Oracle, path: Places) -> str:
    """What brute force says of a path."""
    clearance_m = oracle.contact(path).clearance_m
    if clearance_m <= 0:
        return f"{COLLIDES} by {-clearance_m:.3f} m"
    return f"nothing within {clearance_m:.3f} m"
