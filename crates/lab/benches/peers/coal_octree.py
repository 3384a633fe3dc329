#!/usr/bin/env python3
"""The collision library coal (FCL's successor) on the voxels and arms of `mrol-lab bench planning --peer-file`, one thread.

    pip install coal numpy
    mrol-lab bench planning --scans 0 --peer-file target/arms.bin
    crates/lab/benches/peers/coal_octree.py target/arms.bin

The layout of the file is in crates/lab/src/measure/peer_file.rs. Voxels are the leaves of an octree, cubes as those of mrol are. An
arm is asked sphere by sphere until one collides. Prints microseconds a pose with the calls from Python, of which an arm that
is far from everything is the floor; and in how many poses the answers differ.
"""

import argparse
import struct
import time

import coal
import numpy

SPHERES = 59


def read(path, arms_max):
    data = open(path, "rb").read()
    magic, voxel_m, _range_m, voxels = struct.unpack_from("<8sddQ", data)
    if magic != b"mrolpeer":
        raise SystemExit(f"{path}: no file of mrol-lab bench planning --peer-file")
    at = struct.calcsize("<8sddQ")
    index = numpy.frombuffer(data, "<i4", voxels * 3, at).reshape(-1, 3)
    at += voxels * 12
    (arms,) = struct.unpack_from("<Q", data, at)
    rows = numpy.frombuffer(data, "<f4", arms * (4 * SPHERES + 1), at + 8).reshape(arms, -1)[:arms_max]
    return voxel_m, (index + 0.5) * voxel_m, rows[:, :-1].reshape(-1, SPHERES, 4), rows[:, -1] == 0


class Tree:
    """The octree, and spheres of the radii that arms have."""

    def __init__(self, centers, voxel_m, radii):
        self.octree = coal.makeOctree(centers, voxel_m)
        self.spheres = {radius: coal.Sphere(float(radius)) for radius in radii}
        self.at_origin = coal.Transform3s()
        self.request = coal.CollisionRequest()

    def collides(self, arm):
        result = coal.CollisionResult()
        for (radius, center) in arm:
            if coal.collide(self.octree, self.at_origin, self.spheres[radius], center, self.request, result):
                return True
        return False


def placed(arms):
    """Each arm as pairs of a radius and a transform."""
    identity = numpy.eye(3)
    return [[(s[3], coal.Transform3s(identity, s[:3].astype(float))) for s in arm] for arm in arms]


def us_a_pose(tree, arms):
    start = time.perf_counter()
    answers = [tree.collides(arm) for arm in arms]
    return (time.perf_counter() - start) * 1e6 / len(arms), answers


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("--arms", type=int, default=2000, help="how many of the arms are asked about")
    arguments = parser.parse_args()
    voxel_m, centers, arms, told = read(arguments.file, arguments.arms)
    tree = Tree(centers, voxel_m, numpy.unique(arms[:, :, 3]))
    far, _ = us_a_pose(tree, placed(arms + numpy.float32([1e4, 1e4, 1e4, 0])))
    near, answers = us_a_pose(tree, placed(arms))
    differ = numpy.count_nonzero(numpy.array(answers) != told)
    print(f"coal {coal.__version__}: {near:.1f} us a pose, {far:.1f} us far from everything; {differ} of {len(arms)} differ")


if __name__ == "__main__":
    main()
