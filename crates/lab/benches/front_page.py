#!/usr/bin/env python3
"""Measures what the front page compares with peers, and writes the table there.

    cargo build --release -p mrol -p mrol-lab
    pip install small_gicp kiss-icp numpy
    crates/lab/benches/front_page.py SHARED_DATA

SHARED_DATA has the sets `uos_3dtk_dat`, `icl_office_kt0` and `balm_hall_consecutive`. All programs run on one core, one after
the other. A figure of look-ups is the least of ten runs; times of alignments are medians.
"""

import argparse
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
RUNS = 10
CORE = "1"
STRUCTURES = "bloom,bloom-kernel,exact,exact-kernel,hashset,dense"
BEGIN, END = "<!-- front_page.py -->", "<!-- /front_page.py -->"


def output_of(*command):
    """What a program prints, run on one core."""
    words = ["taskset", "-c", CORE, *map(str, command)]
    print("$", *words, file=sys.stderr)
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def lines_of(*command):
    return [json.loads(line) for line in output_of(*command).splitlines()]


def lookups(lab, workload, order):
    """Nanoseconds a point of each structure, the least of some runs."""
    runs = []
    for _ in range(RUNS):
        lines = lines_of(lab, "bench", "lookup", "--workload", workload, "--order", order,
                         "--structures", STRUCTURES, "--json")
        runs.append({line["structure"]: line["ns_per_point"] for line in lines if "structure" in line})
    return {name: min(run[name] for run in runs) for name in runs[0]}


def convergence(lab, data):
    """Of ours and of each peer: the share that converged, and the median time in milliseconds."""
    scans, peers = data / "uos_3dtk_dat", ROOT / "crates/lab/benches/peers/icp.py"
    pair = [scans / "0000.ply", scans / "0001.ply"]
    truth = ["--truth", scans / "poses.txt", "--resolution", "0.1"]
    with tempfile.TemporaryDirectory() as results:
        ours = lines_of(lab, "experiment", "convergence", *pair, *truth, "--out", results, "--json")
        text = output_of(sys.executable, peers, "convergence", *pair, results, *truth)
    refined = next(line for line in ours if line["method"] == "refined")
    best = {}
    for method, percent, ms in re.findall(r"^(V?GICP) .*?([\d.]+)% converged, median ([\d.]+) ms", text, re.M):
        best[method] = max(best.get(method, (-1.0, 0.0)), (float(percent), float(ms)))
    return (100 * refined["converged"], refined["ms_median"]), best


def alignments(mrol, data, name, resolution):
    """Median time of an alignment, milliseconds, and those of the peers."""
    scans = data / name
    lines = lines_of(mrol, "map", scans, "--resolution", resolution, "--no-recovery", "--json")
    ours = statistics.median(line["align_ms"] for line in lines if line.get("accepted") and line.get("align_ms"))
    text = output_of(sys.executable, ROOT / "crates/lab/benches/peers/icp.py", "timing", scans,
                     "--resolution", resolution)
    return ours, {name: float(ms) for name, ms in re.findall(r"^(\S+) +median ([\d.]+) ms", text, re.M)}


def table(lab, mrol, data):
    room, site = lookups(lab, "room", "random"), lookups(lab, "site", "scan")
    (converged, ms), peers = convergence(lab, data)
    office, office_peers = alignments(mrol, data, "icl_office_kt0", 0.04)
    hall, hall_peers = alignments(mrol, data, "balm_hall_consecutive", 0.1)
    both = lambda name: f"{office_peers[name]:.0f} and {hall_peers[name]:.0f} ms"
    against = lambda which: f"VGICP {peers['VGICP'][which]:.1f}{{0}}, GICP {peers['GICP'][which]:.1f}{{0}}"

    def look_up(what, ns):
        return (what, f"filter {ns['bloom']:.2f} ns, exact {ns['exact']:.1f} ns",
                f"`hashbrown` {ns['hashset']:.1f} ns, dense array {ns['dense']:.1f} ns")

    rows = [
        look_up("look-up, 154 k voxels, points at random", room),
        look_up("look-up, 10 M voxels, in scan order", site),
        ("guesses off by up to 2 m and 40 degrees that end within 0.1 m and 1 degree", f"{converged:.1f} %",
         against(0).format(" %") + " (small_gicp)"),
        ("their median time", f"{ms:.0f} ms", against(1).format(" ms") + ", and preprocessing"),
        ("time of an alignment, scans of 19 k and 77 k points", f"{office:.0f} and {hall:.0f} ms",
         f"VGICP {both('VGICP')}, KISS-ICP {both('KISS-ICP')}"),
    ]
    lines = ["| | mrol | others |", "|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path, help="folder of the sets")
    parser.add_argument("--programs", type=pathlib.Path, default=ROOT / "target/release",
                        help="folder of mrol and mrol-lab [default: target/release]")
    arguments = parser.parse_args()
    readme = ROOT / "README.md"
    text = readme.read_text()
    head, rest = text.split(BEGIN)
    tail = rest.split(END)[1]
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short=8", "HEAD"], check=True, capture_output=True,
                            text=True).stdout.strip()
    rows = table(arguments.programs / "mrol-lab", arguments.programs / "mrol", arguments.data)
    readme.write_text(f"{head}{BEGIN}\nAt commit `{commit}`:\n\n{rows}\n{END}{tail}")
    print(rows)


if __name__ == "__main__":
    main()
