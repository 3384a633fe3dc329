"""Asks whether a ball can move between points of a map, by ctypes alone: one call an edge, a few microseconds each.

    python3 motions.py target/release/libmrol_replica.so http://127.0.0.1:7334 demo RADIUS X Y Z X Y Z [X Y Z ...]
"""

import ctypes
import sys
from ctypes import POINTER, Structure, byref, c_double, c_float, c_int32, c_size_t, c_uint8, c_uint32, c_uint64, sizeof

from follow import Answer, Copy, Error, Replica


class Body(Structure):
    _fields_ = [("number", c_uint64)]


class Link(Structure):
    _fields_ = [
        ("spheres", POINTER(c_float)),
        ("spheres_count", c_size_t),
        ("points", POINTER(c_float)),
        ("points_count", c_size_t),
        ("padding_m", c_float),
        ("reserved", c_uint32 * 3),
    ]


class Region(Structure):
    _fields_ = [("kind", c_int32), ("reserved", c_uint32), ("numbers", c_double * 10)]


class Scope(Structure):
    _fields_ = [
        ("level", c_uint32),
        ("ignore_keep_outs", c_uint8),
        ("reserved", c_uint8 * 3),
    ]


class MotionCheck(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("scope", Scope),
        ("body", Body),
        ("configurations", POINTER(c_float)),
        ("count", c_size_t),
        ("lengths", POINTER(c_uint32)),
        ("motions", c_size_t),
        ("ignored", POINTER(Region)),
        ("ignored_count", c_size_t),
        ("step_m", c_float),
        ("clearance_max_m", c_float),
        ("unknown_is_occupied", c_uint8),
        ("reserved", c_uint8 * 7),
    ]


class MotionAnswers(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("capacity", c_size_t),
        ("is_free", POINTER(c_uint8)),
        ("first_hits", POINTER(c_float)),
        ("clearances_m", POINTER(c_float)),
    ]


class Planner(Copy):
    """A replica that is asked about motions of one ball; `with` closes it."""

    def __init__(self, library, address, name, radius_m):
        super().__init__(library, address, name)
        self.mrol.mrol_body_new.argtypes = [POINTER(Link), c_size_t, POINTER(Body), POINTER(Error)]
        self.mrol.mrol_body_free.argtypes = [Body, POINTER(Error)]
        self.mrol.mrol_replica_check_motions.argtypes = [
            Replica, POINTER(MotionCheck), POINTER(MotionAnswers), POINTER(Answer), POINTER(Error),
        ]
        self.body = Body()
        link = Link(spheres=(c_float * 4)(0, 0, 0, radius_m), spheres_count=1)
        self.call(self.mrol.mrol_body_new, byref(link), 1, byref(self.body))
        # All memory of an edge is made once, and used again for every edge.
        self.numbers, self.is_free, self.first_hit = (c_float * 14)(), (c_uint8 * 1)(), (c_float * 1)()
        self.numbers[6] = self.numbers[13] = 1
        self.check = MotionCheck(sizeof(MotionCheck), Scope(), self.body, self.numbers, 2)
        self.answers = MotionAnswers(sizeof(MotionAnswers), 1, self.is_free, self.first_hit)

    def __exit__(self, *_):
        self.mrol.mrol_body_free(self.body, None)
        super().__exit__()

    def first_hit_between(self, start, end):
        """The share of the way at which the ball meets something first, or None where it moves freely."""
        self.numbers[0:3], self.numbers[7:10] = start, end
        arguments = (self.replica, byref(self.check), byref(self.answers), None)
        self.call(self.mrol.mrol_replica_check_motions, *arguments)
        return None if self.is_free[0] else self.first_hit[0]


def main():
    library, address, name, radius_m, *numbers = sys.argv[1:]
    points = [[float(number) for number in numbers[i:i + 3]] for i in range(0, len(numbers), 3)]
    with Planner(library, address, name, float(radius_m)) as planner:
        for start, end in zip(points, points[1:]):
            share = planner.first_hit_between(start, end)
            print(f"{start} to {end}: {'free' if share is None else f'met after {share:.0%} of the way'}")


if __name__ == "__main__":
    main()
