"""Whether points lie in occupied voxels."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import F32, Bools, numbers_text, raw, rows_of, whole_of
from .._bits import unpacked
from .._fields import reading
from .._transport.request import Parameter
from ..pose import Pose, PoseLike
from ..version import InParts, Version, whole_header
from .handle import MapHandle, flag_of, level_of, word_of
from .parts import Part

POINTS = "points x y z, an array of numbers of shape (..., 3)"

STAND_IN: F32 = np.zeros((1, 3), "<f4")
"""What the server is asked about where there is no point: it checks all else, and tells its version."""

Lookup = Literal["exact", "bloom"]


@dataclass(frozen=True, eq=False)
class Occupancy(InParts):
    """Which points lie in occupied voxels.

    `occupied` has the shape of the points without their last axis; `count` says how many of them are occupied.
    """

    occupied: Bools
    count: int


class OccupancyOperations(MapHandle):
    """Queries of points."""

    def query(
        self,
        points: ArrayLike,
        *,
        map_from_points: PoseLike | None = None,
        level: int = 0,
        lookup: Lookup = "exact",
        keep_out: bool = False,
        min_revision: int | None = None,
        map_uuid: str | None = None,
    ) -> Occupancy:
        """Whether points lie in occupied voxels.

        `points` has shape (..., 3), meters, in the map frame, or in one that `map_from_points` carries into it. Contiguous
        float32 is sent as it is; other numbers are converted. `level` 0 is the finest. `lookup="bloom"` asks the filter alone,
        which says "occupied" of about 2 % of the free points near a surface and never "free" of an occupied one. With
        `keep_out` points in keep-outs count as occupied. `min_revision` waits until the map is there.

        Up to 2,000,000 points are answered at one revision, unless the server is set to fewer. More are sent in several requests,
        between which the map may change: `first_version` and `version` tell.

        Raises `InvalidArgument` for points that are not finite (`point_not_finite`) or out of range, naming the first.
        """
        rows, shape = rows_of(points, 3, "points", POINTS, self._request_bytes_max)
        parameters: dict[str, Parameter] = {
            "pose": None if map_from_points is None else numbers_text(Pose.of(map_from_points, "map_from_points").seven()),
            # What stands at its default is not sent: a short query is mostly its address.
            "level": level_of(level) or None,
            "lookup": _unless(word_of(lookup, "lookup"), "exact"),
            "keep_out": flag_of(keep_out, "keep_out") or None,
            "min_revision": None if min_revision is None else whole_of(min_revision, "min_revision"),
            "map_uuid": None if map_uuid is None else word_of(map_uuid, "map_uuid"),
        }
        given = rows if len(rows) else STAND_IN

        def ask(part: Part) -> Occupancy:
            points = given[part.of]
            answer = self._send_bytes("occupancy", [raw(points)], parameters, part)
            with reading("the answer"):
                if whole_header(answer, "mrol-points") != len(points):
                    raise ValueError("it is of another number of points")
                count = whole_header(answer, "mrol-points-occupied")
                return Occupancy(Version.of_headers(answer), unpacked(answer.body, len(points), count), count)

        return self._in_parts(len(rows), rows.nbytes, shape, ask)


def _unless(word: str, usual: str) -> str | None:
    return None if word == usual else word
