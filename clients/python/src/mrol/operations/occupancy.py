"""Whether points lie in occupied voxels."""

from dataclasses import dataclass
from typing import Literal

from numpy.typing import ArrayLike

from .._arrays import Bools, numbers_text, raw, rows_of, whole_of
from .._bits import unpacked
from .._fields import reading
from .._transport.request import Parameter
from ..pose import Pose, PoseLike
from ..version import Version, Versioned, whole_header
from .handle import MapHandle, flag_of, level_of, word_of

POINTS = "points x y z, an array of numbers of shape (..., 3)"

Lookup = Literal["exact", "bloom"]


@dataclass(frozen=True, eq=False)
class Occupancy(Versioned):
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
        """Whether points lie in occupied voxels, all of them at one revision.

        `points` has shape (..., 3), meters, in the map frame, or in one that `map_from_points` carries into it. Contiguous
        float32 is sent as it is; other numbers are converted. `level` 0 is the finest. `lookup="bloom"` asks the filter alone,
        which says "occupied" of about 2 % of the free points near a surface and never "free" of an occupied one. With
        `keep_out` points in keep-outs count as occupied. `min_revision` waits until the map is there.

        Raises `InvalidArgument` for points that are not finite (`point_not_finite`) or out of range, naming the first, and for
        more points than the server takes at once (`batch_too_large`, `body_too_large`).
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
        answer = self._send_bytes("occupancy", [raw(rows)], parameters)
        with reading("the answer"):
            if whole_header(answer, "mrol-points") != len(rows):
                raise ValueError("it is of another number of points")
            count = whole_header(answer, "mrol-points-occupied")
            occupied = unpacked(answer.body, len(rows), count).reshape(shape)
        return Occupancy(Version.of_headers(answer), occupied, count)


def _unless(word: str, usual: str) -> str | None:
    return None if word == usual else word
