"""Times queries of points through a replica: `mrol-lab bench replica --c-client bench/replica_query.py` tells it when.

It says and is told what clients/c/benches/query.c does: a line "LOOKUP POINTS" asks about all points of the file, so many at a
time, twice; printed are the nanoseconds of the second time and how many points are occupied.
"""

import sys
import time

import numpy as np

import mrol
import mrol.replica


def passed(replica: mrol.replica.Replica, points: np.ndarray, pose: mrol.Pose, lookup: str, count: int) -> int:
    """How many of all points are occupied."""
    asked = (points[first : first + count] for first in range(0, len(points), count))
    return sum(replica.query(part, map_from_points=pose, lookup=lookup).count for part in asked)


def main() -> None:
    address, name, file, *pose = sys.argv[1:]
    replica = mrol.replica.Replica(address, name, bloom=True)
    points = np.fromfile(file, np.float32).reshape(-1, 3)
    map_from_points = mrol.Pose.of([float(number) for number in pose])
    print("ready", flush=True)
    for line in sys.stdin:
        lookup, count = line.split()
        if count == "0":
            return
        asked = (replica, points, map_from_points, ("exact", "bloom")[int(lookup)], int(count))
        passed(*asked)
        begin = time.perf_counter_ns()
        positive = passed(*asked)
        print(time.perf_counter_ns() - begin, positive, flush=True)


main()
