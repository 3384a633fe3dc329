#!/usr/bin/env python3
"""The peers of `mrol-lab experiment convergence` and of `align_ms`, on the same guesses and the same scans, one thread.

    pip install small_gicp kiss-icp numpy
    mrol-lab experiment convergence SCANS/0000.ply SCANS/0001.ply --truth poses.txt --resolution 0.1 --out results/
    crates/lab/benches/peers/icp.py convergence SCANS/0000.ply SCANS/0001.ply results/ --truth poses.txt --resolution 0.1
    crates/lab/benches/peers/icp.py timing SCANS/ --resolution 0.1

`convergence` starts VGICP and GICP at every guess of results/guesses.csv, with several reaches each; results/peers.md is
a table like convergence.md. `timing` aligns each scan to the one before it, of whose pose nothing is known, and reports
the median time, preprocessing of the source (downsampling, covariances) included, and that of KISS-ICP with a map of its own.

small_gicp's scans are downsampled to 2 r_0; the voxels of KISS-ICP's map are 4 r_0, those of mrol's refinement.
"""

import argparse
import csv
import pathlib
import statistics
import time

import numpy
import small_gicp

CONVERGED_M, CONVERGED_DEG = 0.1, 1.0
BINS_M = [(low / 2, low / 2 + 0.5) for low in range(4)]
BINS_DEG = [(low * 10, low * 10 + 10) for low in range(4)]
# How far GICP looks for a neighbor, and the sides of VGICP's voxels, meters: alone, and coarse to fine, each from where
# the coarser one ended.
REACHES_M = {
    "VGICP": [[0.5], [2.0, 1.0, 0.5], [2.0, 1.0, 0.5, 0.2]],
    "GICP": [[1.0], [1.0, 0.5, 0.2], [2.0, 1.0, 0.5]],
}


def read_ply(path):
    """Points (N x 3) of a binary little-endian PLY of x y z float32 that are finite."""
    data = pathlib.Path(path).read_bytes()
    header, body = data.split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    properties = [line for line in lines if line.startswith("property")]
    if "format binary_little_endian 1.0" not in lines or properties != [f"property float {c}" for c in "xyz"]:
        raise SystemExit(f"{path}: not a binary little-endian PLY of float x y z")
    points = numpy.frombuffer(body, "<f4").reshape(-1, 3).astype(float)
    return points[numpy.isfinite(points).all(axis=1)]


def matrix(x, y, z, qx, qy, qz, qw):
    """The 4 x 4 matrix of a translation and a unit quaternion."""
    transform = numpy.eye(4)
    transform[:3, :3] = [
        [1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw)],
        [2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw)],
        [2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy)],
    ]
    transform[:3, 3] = [x, y, z]
    return transform


def read_tum(path):
    lines = [line for line in pathlib.Path(path).read_text().splitlines() if line.strip() and line[0] != "#"]
    return [matrix(*map(float, line.split()[1:])) for line in lines]


def difference(a, b):
    """Meters and degrees between two poses."""
    a_from_b = numpy.linalg.inv(a) @ b
    turned = numpy.linalg.norm(a_from_b[:3, :3] - numpy.eye(3)) / (2 * numpy.sqrt(2))
    return numpy.linalg.norm(a_from_b[:3, 3]), numpy.degrees(2 * numpy.arcsin(min(1.0, turned)))


class Prepared:
    """A scan as small_gicp wants it, and what is derived from it."""

    def __init__(self, points, resolution_m):
        self.cloud, self.tree = small_gicp.preprocess_points(
            points, downsampling_resolution=2 * resolution_m, num_threads=1
        )

    def voxels(self, side_m):
        voxels = small_gicp.GaussianVoxelMap(side_m)
        voxels.insert(self.cloud)
        return voxels


def aligner(method, target, reaches_m):
    """A function from a source and a guess to target_from_source, through one reach after the other."""
    stages = [stage(method, target, reach_m) for reach_m in reaches_m]

    def align(source, guess):
        for align_stage in stages:
            guess = align_stage(source, guess)
        return guess

    return align


def stage(method, target, reach_m):
    options = {"max_correspondence_distance": reach_m, "num_threads": 1, "max_iterations": 100}
    if method == "VGICP":
        voxels = target.voxels(reach_m)
        return lambda source, guess: small_gicp.align(voxels, source.cloud, guess, **options).T_target_source
    return lambda source, guess: small_gicp.align(
        target.cloud, source.cloud, target.tree, guess, method, **options
    ).T_target_source


def convergence(arguments):
    folder = pathlib.Path(arguments.results)
    with open(folder / "guesses.csv") as file:
        guesses = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    truth = numpy.linalg.inv(pose_of(arguments.target, arguments.truth)) @ pose_of(arguments.source, arguments.truth)
    target, source = (Prepared(read_ply(path), arguments.resolution) for path in [arguments.target, arguments.source])
    columns = {}
    for method, schedules in REACHES_M.items():
        for reaches_m in schedules:
            name = f"{method} {', '.join(f'{reach:g}' for reach in reaches_m)} m"
            columns[name] = trials(aligner(method, target, reaches_m), source, guesses, truth)
            share = sum(converged for converged, _ in columns[name]) / len(guesses)
            median_ms = statistics.median(ms for _, ms in columns[name])
            print(f"{name:<22} {share:7.2%} converged, median {median_ms:.1f} ms beside preprocessing")
    write_table(folder / "peers.md", guesses, columns)


def trials(align, source, guesses, truth):
    """Whether each guess led to the truth, and how long that took."""
    outcomes = []
    for guess in guesses:
        start_pose = matrix(*(guess[name] for name in ["x", "y", "z", "qx", "qy", "qz", "qw"]))
        start = time.perf_counter()
        found = align(source, start_pose)
        ms = (time.perf_counter() - start) * 1e3
        meters, degrees = difference(found, truth)
        outcomes.append((meters <= CONVERGED_M and degrees <= CONVERGED_DEG, ms))
    return outcomes


def write_table(path, guesses, columns):
    lines = ["| offset m | offset deg | trials | " + " | ".join(columns) + " |"]
    lines.append("|" + " ---: |" * (3 + len(columns)))
    bins = [(m, deg) for m in BINS_M for deg in BINS_DEG] + [((0, numpy.inf), (0, numpy.inf))]
    for m, deg in bins:
        inside = [
            k
            for k, guess in enumerate(guesses)
            if m[0] <= guess["offset_m"] < m[1] and deg[0] <= guess["offset_deg"] < deg[1]
        ]
        shares = [sum(column[k][0] for k in inside) / max(len(inside), 1) for column in columns.values()]
        names = ["all", "all"] if m[1] == numpy.inf else [f"{low:g} - {high:g}" for low, high in [m, deg]]
        lines.append(f"| {' | '.join(names)} | {len(inside)} | {' | '.join(f'{share:.2%}' for share in shares)} |")
    path.write_text("\n".join(lines) + "\n")


def pose_of(scan, truth):
    """The pose of the line whose number is that of the scan in its folder."""
    scan = pathlib.Path(scan)
    return read_tum(truth)[sorted(scan.parent.glob("*.ply")).index(scan)]


def timing(arguments):
    paths = sorted(pathlib.Path(arguments.scans).glob("*.ply"))[: arguments.scans_max]
    scans = [read_ply(path) for path in paths]
    for method in REACHES_M:
        report(method, [pairwise_ms(method, *pair, arguments.resolution) for pair in zip(scans, scans[1:])])
    report("KISS-ICP", kiss_icp_ms(scans, arguments.resolution))


def pairwise_ms(method, target_points, source_points, resolution_m):
    align = aligner(method, Prepared(target_points, resolution_m), REACHES_M[method][0])
    start = time.perf_counter()
    align(Prepared(source_points, resolution_m), numpy.eye(4))
    return (time.perf_counter() - start) * 1e3


def kiss_icp_ms(scans, resolution_m):
    from kiss_icp.config import KISSConfig
    from kiss_icp.kiss_icp import KissICP

    config = KISSConfig()
    config.registration.max_num_threads = 1
    config.data.deskew = False
    config.data.min_range = 0.0
    config.mapping.voxel_size = 4 * resolution_m
    odometry = KissICP(config)
    times_ms = []
    for scan in scans:
        start = time.perf_counter()
        odometry.register_frame(scan, numpy.array([]))
        times_ms.append((time.perf_counter() - start) * 1e3)
    return times_ms[1:]


def report(name, times_ms):
    print(f"{name:<12} median {statistics.median(times_ms):.1f} ms, max {max(times_ms):.1f} ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("convergence")
    command.add_argument("target")
    command.add_argument("source")
    command.add_argument("results", help="folder with guesses.csv; peers.md goes there")
    command.add_argument("--truth", required=True)
    command.add_argument("--resolution", type=float, required=True)
    command.set_defaults(run=convergence)
    command = commands.add_parser("timing")
    command.add_argument("scans", help="folder of scans")
    command.add_argument("--resolution", type=float, required=True)
    command.add_argument("--scans-max", type=int, default=24)
    command.set_defaults(run=timing)
    arguments = parser.parse_args()
    arguments.run(arguments)


if __name__ == "__main__":
    main()
