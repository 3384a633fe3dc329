"""Asks about a point of a map as it changes, by ctypes alone.

    python3 follow.py target/release/libmrol_replica.so http://127.0.0.1:7334 demo 4.6 9.0 1.0 [--once]
"""

import ctypes
import sys
from ctypes import POINTER, Structure, byref, c_char, c_char_p, c_double, c_float, c_int32, c_size_t, c_uint8
from ctypes import c_uint32, c_uint64, sizeof

OK, TIMEOUT = 0, 6


class Error(Structure):
    _fields_ = [("code", c_int32), ("reserved", c_uint32), ("reason", c_char * 48), ("message", c_char * 464)]


class Replica(Structure):
    _fields_ = [("number", c_uint64)]


class MapVersion(Structure):
    _fields_ = [
        ("map_uuid", c_uint8 * 16),
        ("revision", c_uint64),
        ("content_hash", c_uint64),
        ("has_content_hash", c_uint8),
        ("reserved", c_uint8 * 7),
    ]


class Options(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("address", c_char_p),
        ("map", c_char_p),
        ("key", c_char_p),
        ("ca_file", c_char_p),
        ("certificate_file", c_char_p),
        ("private_key_file", c_char_p),
        ("open_timeout_ms", c_uint64),
        ("silence_timeout_ms", c_uint64),
        ("blocks_max", c_uint64),
        ("region_min_m", c_double * 3),
        ("region_max_m", c_double * 3),
        ("has_region", c_uint8),
        ("with_filter", c_uint8),
        ("without_viewpoints", c_uint8),
        ("reserved", c_uint8 * 5),
        ("age_max_ms", c_uint64),
    ]


class PointQuery(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("xyz", POINTER(c_float)),
        ("count", c_size_t),
        ("map_from_points", POINTER(c_double)),
        ("level", c_uint32),
        ("lookup", c_int32),
        ("keep_out", c_uint8),
        ("reserved", c_uint8 * 7),
    ]


class Answer(Structure):
    _fields_ = [("version", MapVersion), ("asked", c_uint64), ("positive", c_uint64), ("reserved", c_uint64 * 4)]


class Copy:
    """A replica of a map; `with` closes it."""

    def __init__(self, library, address, name):
        self.mrol = ctypes.CDLL(library)
        # ctypes takes every argument for an int that it is not told of.
        self.mrol.mrol_replica_close.argtypes = [Replica, POINTER(Error)]
        self.mrol.mrol_replica_revision.argtypes = [Replica]
        self.mrol.mrol_replica_revision.restype = c_uint64
        self.mrol.mrol_replica_wait_for_revision.argtypes = [Replica, c_uint64, c_uint64, POINTER(Error)]
        self.mrol.mrol_replica_query_points.argtypes = [
            Replica, POINTER(PointQuery), POINTER(c_uint8), c_size_t, POINTER(Answer), POINTER(Error),
        ]
        self.replica = Replica()
        options = Options(struct_size=sizeof(Options), address=address.encode(), map=name.encode())
        self.call(self.mrol.mrol_replica_open, byref(options), byref(self.replica))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.mrol.mrol_replica_close(self.replica, None)

    def call(self, function, *arguments, fine=(OK,)):
        error = Error()
        code = function(*arguments, byref(error))
        if code not in fine:
            raise RuntimeError(error.message.decode())

    def occupied(self, points):
        """Whether each point (x, y, z) is occupied, and the revision of the answer."""
        xyz = (c_float * (3 * len(points)))(*(number for point in points for number in point))
        bits, answer = (c_uint8 * ((len(points) + 7) // 8))(), Answer()
        query = PointQuery(struct_size=sizeof(PointQuery), xyz=xyz, count=len(points))
        arguments = (self.replica, byref(query), bits, len(bits), byref(answer))
        self.call(self.mrol.mrol_replica_query_points, *arguments)
        return [bool(bits[i // 8] >> i % 8 & 1) for i in range(len(points))], answer.version.revision

    def wait_for_next(self):
        following = self.mrol.mrol_replica_revision(self.replica) + 1
        arguments = (self.replica, following, 60_000)
        self.call(self.mrol.mrol_replica_wait_for_revision, *arguments, fine=(OK, TIMEOUT))


def main():
    library, address, name, *point = [word for word in sys.argv[1:] if word != "--once"]
    with Copy(library, address, name) as copy:
        while True:
            [occupied], revision = copy.occupied([[float(number) for number in point]])
            print(f"revision {revision}: {'occupied' if occupied else 'free'}", flush=True)
            if "--once" in sys.argv:
                return
            copy.wait_for_next()


if __name__ == "__main__":
    main()
