"""Planners of OMPL over a checker: RRT-Connect and BIT*."""

import time
from dataclasses import dataclass

import numpy as np
from ompl import base, geometric, util

from checker import Checker, Places

OMPL_PLANNERS = {"rrt-connect": geometric.RRTConnect, "bit-star": geometric.BITstar}


@dataclass
class Plan:
    """What a planner found, and what it cost."""

    path: Places
    """The corners of the path from start to goal; none where no path was found."""
    seconds: float
    checks: int
    """How often the planner asked the checker: each is a request where the checker asks a server."""

    @property
    def is_found(self) -> bool:
        """Whether there is a path."""
        return len(self.path) > 0

    @property
    def length_m(self) -> float:
        """Length of the path."""
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())


NO_PATH: Places = np.empty((0, 3))


class EdgeValidator(base.MotionValidator):
    """Answers OMPL whether an edge is free by one question to a checker."""

    def __init__(self, space: base.SpaceInformation, checker: Checker) -> None:
        super().__init__(space)
        self.checker = checker
        self.checks = 0

    def checkMotion(self, start: base.State, end: base.State) -> bool:
        self.checks += 1
        return bool(self.checker.motions_fit(np.array([[start[0:3], end[0:3]]]))[0])


class Problem:
    """Where a body may go: a box of R^3, in which a checker tells what is free."""

    def __init__(self, checker: Checker, low: Places, high: Places) -> None:
        self.checker = checker
        self.low, self.high = low, high
        self.state_checks = 0
        bounds = base.RealVectorBounds(3)
        for axis in range(3):
            bounds.setLow(axis, float(low[axis]))
            bounds.setHigh(axis, float(high[axis]))
        self.states = base.RealVectorStateSpace(3)
        self.states.setBounds(bounds)
        self.space = base.SpaceInformation(self.states)
        self.space.setStateValidityChecker(self._is_valid)
        self.validator = EdgeValidator(self.space, checker)
        self.space.setMotionValidator(self.validator)
        self.space.setup()

    def plan(self, planner: str, start: Places, goal: Places, time_limit_s: float) -> Plan:
        """The first path that the planner finds."""
        definition = base.ProblemDefinition(self.space)
        definition.setStartAndGoalStates(self._state(start), self._state(goal))
        definition.setOptimizationObjective(base.PathLengthOptimizationObjective(self.space))
        solver = OMPL_PLANNERS[planner](self.space)
        if planner == "bit-star":
            solver.setStopOnSolnImprovement(True)
        solver.setProblemDefinition(definition)
        solver.setup()
        checks = self._checks()
        begin = time.perf_counter()
        solver.solve(float(time_limit_s))
        seconds = time.perf_counter() - begin
        found = definition.hasExactSolution()
        path = corners(definition.getSolutionPath()) if found else NO_PATH
        return Plan(path, seconds, self._checks() - checks)

    def simplify(self, path: Places) -> Plan:
        """The path as OMPL's simplifier shortens it, an edge a check."""
        simplified = geometric.PathGeometric(self.space)
        for corner in path:
            simplified.append(self._state(corner))
        checks = self._checks()
        begin = time.perf_counter()
        geometric.PathSimplifier(self.space).simplifyMax(simplified)
        return Plan(corners(simplified), time.perf_counter() - begin, self._checks() - checks)

    def _is_valid(self, state: base.State) -> bool:
        self.state_checks += 1
        return self.space.satisfiesBounds(state) and bool(self.checker.places_fit(np.array([state[0:3]]))[0])

    def _checks(self) -> int:
        return self.state_checks + self.validator.checks

    def _state(self, place: Places) -> base.State:
        state = self.space.allocState()
        for axis in range(3):
            state[axis] = float(place[axis])
        return state


def corners(path: geometric.PathGeometric) -> Places:
    """The states of a path, rows of x y z."""
    return np.array([state[0:3] for state in path.getStates()])


def set_seed(seed: int) -> None:
    """Makes what OMPL draws the same at each run; before the first planner is made."""
    util.setLogLevel(util.LOG_ERROR)
    util.RNG.setSeed(seed)
