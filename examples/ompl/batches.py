"""Plans that take few questions: many edges go in each of them, where OMPL's planners ask about one after the other."""

import heapq
import time

import numpy as np
from numpy.typing import NDArray

from checker import Checker, Places
from ompl_planning import NO_PATH, Plan

SAMPLES_FIRST = 60
"""Places of the first round; each further round brings as many as there are."""
NEIGHBORS = 10
"""How many of the nearest places each one is connected with."""
SHORTCUT_PLACES = 32
"""Between how many places of a path shortcuts are tried, in pairs."""
CORNER_COST_M = 1e-3
"""What a corner counts for: of ways of the same length that of the fewest corners is taken."""


class Roadmap:
    """Places that fit and edges that are free, as in PRM: a round costs one `CheckPoses` and one `CheckMotions`."""

    def __init__(self, checker: Checker, low: Places, high: Places, seed: int) -> None:
        self.checker = checker
        self.low, self.high = low, high
        self.random = np.random.default_rng(seed)
        self.places: Places = np.empty((0, 3))
        self.edges: dict[int, dict[int, float]] = {}
        self.tried: set[tuple[int, int]] = set()
        self.checks = 0

    def plan(self, start: Places, goal: Places, time_limit_s: float) -> Plan:
        """The shortest path of the first roadmap that has one between the two; they are places 0 and 1 of a new roadmap."""
        begin, checks = time.perf_counter(), self.checks
        path = NO_PATH
        samples: Places = np.array([start, goal])
        while len(path) == 0 and time.perf_counter() - begin < time_limit_s:
            count = max(SAMPLES_FIRST, len(self.places))
            self._add(np.concatenate([samples, self.random.uniform(self.low, self.high, (count, 3))]))
            samples = NO_PATH
            path = self._shortest()
        return Plan(path, time.perf_counter() - begin, self.checks - checks)

    def _add(self, samples: Places) -> None:
        known = len(self.places)
        self.checks += 2
        fit = self.checker.places_fit(samples)
        if known == 0 and not fit[:2].all():
            raise ValueError("the body does not fit at the start or at the goal")
        self.places = np.concatenate([self.places, samples[fit]])
        pairs = self._new_pairs(known)
        free = self.checker.motions_fit(self.places[pairs])
        for a, b in pairs[free].tolist():
            length = float(np.linalg.norm(self.places[a] - self.places[b]))
            self.edges.setdefault(a, {})[b] = length
            self.edges.setdefault(b, {})[a] = length

    def _new_pairs(self, known: int) -> NDArray[np.int64]:
        """Pairs of each new place and its nearest; and of start and goal, which are tried directly."""
        squares = (self.places**2).sum(1)
        distances = squares[known:, None] + squares[None, :] - 2 * self.places[known:] @ self.places.T
        nearest = np.argsort(distances, axis=1)[:, 1 : NEIGHBORS + 1]
        pairs = {(min(a + known, b), max(a + known, b)) for a, row in enumerate(nearest.tolist()) for b in row}
        pairs = pairs | {(0, 1)} if known == 0 else pairs - self.tried
        self.tried |= pairs
        return np.array(sorted(pairs), np.int64)

    def _shortest(self) -> Places:
        """Dijkstra's path from place 0 to place 1, empty where there is none."""
        costs, came_from = {0: 0.0}, {0: 0}
        queue = [(0.0, 0)]
        while queue:
            cost, place = heapq.heappop(queue)
            if place == 1:
                return self.places[way_back(came_from, 1)[::-1]]
            if cost > costs[place]:
                continue
            for neighbor, length in self.edges.get(place, {}).items():
                if cost + length < costs.get(neighbor, np.inf):
                    costs[neighbor], came_from[neighbor] = cost + length, place
                    heapq.heappush(queue, (cost + length, neighbor))
        return NO_PATH


def shorten(checker: Checker, path: Places) -> Plan:
    """The shortest way along a path and the shortcuts between places of it, all tried by one `CheckMotions`."""
    begin = time.perf_counter()
    places = places_along(path, SHORTCUT_PLACES)
    first, second = np.triu_indices(len(places), 1)
    free = checker.motions_fit(places[np.stack([first, second], 1)])
    # The pieces of the path were checked by who found it.
    free |= second == first + 1
    lengths = np.where(free, np.linalg.norm(places[first] - places[second], axis=1) + CORNER_COST_M, np.inf)
    costs, came_from = np.full(len(places), np.inf), np.zeros(len(places), int)
    costs[0] = 0
    for place in range(1, len(places)):
        before = second == place
        through = costs[first[before]] + lengths[before]
        came_from[place] = np.argmin(through)
        costs[place] = through[came_from[place]]
    return Plan(places[way_back(came_from, len(places) - 1)[::-1]], time.perf_counter() - begin, 1)


def way_back(came_from: dict[int, int] | NDArray[np.int64], place: int) -> list[int]:
    """The places from a place back to place 0."""
    way = [place]
    while way[-1] != 0:
        way.append(int(came_from[way[-1]]))
    return way


def places_along(path: Places, count: int) -> Places:
    """The corners of a path, and places between them so that there are about so many, equally far apart."""
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    spacing = lengths.sum() / max(count - len(path), 1)
    pieces = [
        a + (b - a) * np.arange(parts)[:, None] / parts
        for a, b, parts in zip(path[:-1], path[1:], np.maximum(np.ceil(lengths / spacing - 0.5), 1).astype(int))
    ]
    return np.concatenate([*pieces, path[-1:]])
