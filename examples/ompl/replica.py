"""The same questions to a copy of the map in this process: the C library of clients/c, by ctypes."""

import sys
from ctypes import POINTER, Structure, byref, c_float, c_size_t, c_uint8, c_uint32, c_uint64, c_void_p, sizeof
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from checker import Bools, Places, padding_between_checks

sys.path.append(str(Path(__file__).resolve().parents[2] / "clients" / "c" / "examples"))
from follow import Answer, Copy, Error, Replica  # noqa: E402
from motions import Body, Link, MotionAnswers, MotionCheck, Region, Scope  # noqa: E402

MOTIONS_FIRST = 16


class PoseCheck(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("scope", Scope),
        ("body", Body),
        ("configurations", POINTER(c_float)),
        ("count", c_size_t),
        ("ignored", POINTER(Region)),
        ("ignored_count", c_size_t),
        ("clearance_max_m", c_float),
        ("unknown_is_occupied", c_uint8),
        ("reserved", c_uint8 * 3),
    ]


class Collisions(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("capacity", c_size_t),
        ("colliding", POINTER(c_uint8)),
        ("hit_links", POINTER(c_uint32)),
        ("hit_parts", POINTER(c_uint32)),
        ("hit_voxels", POINTER(c_uint64)),
        ("clearances_m", POINTER(c_float)),
        ("nearest_links", POINTER(c_uint32)),
        ("hit_keep_outs", c_void_p),
    ]


class ReplicaChecker:
    """Checks a body in a copy of a map that follows the server's; no call goes out.

    Questions and answers have memory of their own, which is kept: one thread at a time may ask.
    """

    def __init__(
        self, library: str, address: str, name: str, resolution_m: float, spheres: NDArray[np.float32]
    ) -> None:
        self.copy = Copy(library, address, name)
        mrol = self.copy.mrol
        mrol.mrol_body_new.argtypes = [POINTER(Link), c_size_t, POINTER(Body), POINTER(Error)]
        self.check_poses, self.check_motions = mrol.mrol_replica_check_poses, mrol.mrol_replica_check_motions
        pointers = [POINTER(Answer), POINTER(Error)]
        self.check_poses.argtypes = [Replica, POINTER(PoseCheck), POINTER(Collisions), *pointers]
        self.check_motions.argtypes = [Replica, POINTER(MotionCheck), POINTER(MotionAnswers), *pointers]
        parts = np.ascontiguousarray(spheres, np.float32)
        padding_m = padding_between_checks(resolution_m / 2)
        link = Link(spheres=parts.ctypes.data_as(POINTER(c_float)), spheres_count=len(parts), padding_m=padding_m)
        self.body = Body()
        self.copy.call(mrol.mrol_body_new, byref(link), 1, byref(self.body))
        self._make_room(MOTIONS_FIRST)

    def places_fit(self, places: Places) -> Bools:
        self._put(places)
        self.poses.count = len(places)
        self.copy.call(self.check_poses, self.copy.replica, self.poses_at, self.collisions_at, None)
        return ~self._bits(len(places))

    def motions_fit(self, motions: Places) -> Bools:
        self._put(motions)
        self.motions.count = 2 * len(motions)
        self.copy.call(self.check_motions, self.copy.replica, self.motions_at, self.answers_at, None)
        return self._bits(len(motions))

    def _put(self, places: Places) -> None:
        """Writes places as poses of a body that does not turn."""
        count = places.size // 3
        if count > len(self.configurations):
            self._make_room(count)
        self.configurations[:count, :3] = places.reshape(-1, 3)

    def _make_room(self, count: int) -> None:
        """Memory for so many configurations, and the structs that name it."""
        self.configurations = np.zeros((count, 7), np.float32)
        self.configurations[:, 6] = 1
        self.bits = np.zeros((count + 7) // 8, np.uint8)
        at = self.configurations.ctypes.data_as(POINTER(c_float))
        bits = self.bits.ctypes.data_as(POINTER(c_uint8))
        self.poses = PoseCheck(struct_size=sizeof(PoseCheck), body=self.body, configurations=at)
        self.motions = MotionCheck(struct_size=sizeof(MotionCheck), body=self.body, configurations=at)
        self.collisions = Collisions(struct_size=sizeof(Collisions), capacity=count, colliding=bits)
        self.answers = MotionAnswers(struct_size=sizeof(MotionAnswers), capacity=count, is_free=bits)
        self.poses_at, self.motions_at = byref(self.poses), byref(self.motions)
        self.collisions_at, self.answers_at = byref(self.collisions), byref(self.answers)

    def _bits(self, count: int) -> Bools:
        return np.unpackbits(self.bits, count=count, bitorder="little").view(np.bool_)
