"""Queries of this package against those of the Rust client, over one server: bench/queries.py PROGRAM.

PROGRAM is `mrol-lab`. Its `bench serve` (HTTP and gRPC by the Rust client) and this package ask the same server in turn, so that
what else the machine does meets all of them. Of each the least median of all rounds counts.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import mrol

LIMITS = {10_000: 2.0, 1_000_000: 1.2}
"""Points of a query, and how many times as long as the faster of HTTP and gRPC it may take."""

ROOM_M = np.array([14.0, 9.0, 3.0])
"""The room of `mrol-lab bench serve`: 155 thousand voxels of 5 cm on its walls."""


@contextmanager
def serving(program: str) -> Iterator[tuple[str, str]]:
    """The addresses of HTTP and gRPC of a server in memory."""
    listen = ["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"]
    command = [program, "serve", "--json", "--log-level", "warn", "--data-dir", "", *listen]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            addresses = json.loads(process.stdout.readline())
            yield addresses["http"], addresses["grpc"]
        finally:
            process.terminate()


def rust_medians_ms(program: str, http: str, grpc: str, seconds: float) -> dict[tuple[str, int], float]:
    """Medians of the Rust client, by protocol and points."""
    points = ",".join(str(count) for count in LIMITS)
    server = ["--server", f"http://{grpc}", "--http", f"http://{http}"]
    asked = ["--protocols", "grpc,http", "--points", points, "--lookup", "exact", "--seconds", str(seconds), "--json"]
    done = subprocess.run([program, "bench", "serve", *server, *asked], check=True, capture_output=True, text=True)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    return {(line["protocol"], line["points_per_message"]): line["p50_us"] / 1e3 for line in lines}


def python_median_ms(m: mrol.Map, points: np.ndarray, seconds: float) -> float:
    """The median of this package."""
    took = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        begin = time.perf_counter()
        m.query(points)
        took.append((time.perf_counter() - begin) * 1e3)
    return statistics.median(took)


def room(rng: np.random.Generator) -> np.ndarray:
    """Points on the walls of the room, so dense that each voxel has some."""
    count = 1_500_000
    unit = rng.uniform(0, 1, (count, 3))
    axis = rng.choice(3, count, p=[0.13, 0.2, 0.67])
    unit[np.arange(count), axis] = rng.integers(0, 2, count)
    return (unit * ROOM_M).astype(np.float32)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program, optimized")
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=0.5, help="of each measurement")
    chosen = parser.parse_args()
    rng = np.random.default_rng(1)
    asked = rng.uniform([-1, -1, -1], ROOM_M + 1, (max(LIMITS), 3)).astype(np.float32)
    found: dict[tuple[str, int], list[float]] = {}
    with serving(str(Path(chosen.program).resolve())) as (http, grpc), tempfile.TemporaryDirectory():
        m = mrol.connect(http).map("room", resolution=0.05)
        m.insert(room(rng), align=False)
        for _ in range(chosen.rounds):
            for name, median_ms in rust_medians_ms(chosen.program, http, grpc, chosen.seconds).items():
                found.setdefault(name, []).append(median_ms)
            for count in LIMITS:
                found.setdefault(("python", count), []).append(python_median_ms(m, asked[:count], chosen.seconds))
    return told({name: min(medians) for name, medians in found.items()})


def told(least_ms: dict[tuple[str, int], float]) -> int:
    """Prints what was found; 1 where it is more than it may be."""
    is_over = False
    for count, limit in LIMITS.items():
        python, grpc, http = (least_ms[name, count] for name in ("python", "grpc", "http"))
        ratio = python / min(grpc, http)
        is_over = is_over or ratio > limit
        figures = f"python {python:.3f} ms, http {http:.3f} ms, grpc {grpc:.3f} ms"
        print(f"{count} points: {figures}; {ratio:.2f} times the faster, {limit} allowed")
    return int(is_over)


if __name__ == "__main__":
    raise SystemExit(main())
