"""Where a scan was taken, without a guess."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from .._arrays import number_of, numbers_text, raw, rows_of, vector_of, whole_of
from .._fields import Fields, fields_of
from .._transport.request import Parameter
from ..errors import ArgumentError
from ..pose import Pose, pose_in
from ..questions.occupancy import POINTS
from ..shapes import Box, BoxLike
from ..version import Version, Versioned
from .handle import MapHandle
from .scans import RayAgreement, Rival, rays_in, rivals_in


@dataclass(frozen=True, eq=False)
class Candidate:
    """A place where a scan may have been taken."""

    map_from_sensor: Pose
    overlap: float
    """The share of its points in occupied voxels of level 0."""
    inliers: float
    """The share of a sample of its points that lie on the map's surfaces."""
    rays: RayAgreement | None
    """How rays agree there. None where the search was stopped before they were asked."""


@dataclass(frozen=True, eq=False)
class Localization(Versioned):
    """Where a scan was taken. One that fits nowhere, or in several places, is an answer: `accepted` is False."""

    accepted: bool
    verdict: str
    reason: str
    """Why, in a sentence."""
    candidates: tuple[Candidate, ...]
    """The places found, the best first: that of the verdict, then those of which rays tell enough, by the share that agree, then
    the others, by overlap."""
    rivals: tuple[Rival, ...]
    """Poses that it may have been taken at as well as at the first candidate: why it is ambiguous."""
    exhaustive: bool
    """Whether all of the map, or of the search box, was searched."""
    cut_short: bool
    """Whether the time was up."""
    search_ms: float
    points_skipped: int

    @property
    def map_from_sensor(self) -> Pose | None:
        """The best place, where the scan was found."""
        return self.candidates[0].map_from_sensor if self.accepted and self.candidates else None


class LocalizationOperations(MapHandle):
    """Localization of scans."""

    def localize(
        self,
        points: ArrayLike,
        *,
        gravity_in_sensor: ArrayLike | None = None,
        gravity_in_map: ArrayLike | None = None,
        search_box: BoxLike | None = None,
        time_limit_s: float | None = None,
        candidates: int | None = None,
        seed: int = 0,
    ) -> Localization:
        """Searches all poses for the one from which a scan was taken. The map stays as it is.

        `points` has shape (..., 3), meters, in the sensor frame. `gravity_in_sensor` (shape (3,), the direction in which things
        fall, good to 2 degrees) makes the search about ten times as fast; `gravity_in_map` is 0 0 -1 unless it is given.
        `search_box` bounds where the sensor was. `candidates` is how many places are told at most, and another `seed` draws other
        points of the scan. The server searches for 10 s unless `time_limit_s` says otherwise: give the
        call more than that (`with_timeout`).

        Raises `FailedPrecondition` (`map_empty`), `InvalidArgument`, `ResourceExhausted` (`search_too_large`).
        """
        rows, _ = rows_of(points, 3, "points", POINTS, self._request_bytes_max)
        if gravity_in_map is not None and gravity_in_sensor is None:
            raise ArgumentError("gravity_in_map", "no gravity_in_sensor", "given with gravity_in_sensor")
        corners = None if search_box is None else Box.of(search_box, "search_box").corners("search_box")
        parameters: dict[str, Parameter] = {
            "gravity": None if gravity_in_sensor is None else _direction(gravity_in_sensor, "gravity_in_sensor"),
            "map_gravity": None if gravity_in_map is None else _direction(gravity_in_map, "gravity_in_map"),
            "search_box": None if corners is None else numbers_text([*corners[0], *corners[1]]),
            "time_limit_s": None if time_limit_s is None else number_of(time_limit_s, "time_limit_s"),
            "candidates": None if candidates is None else whole_of(candidates, "candidates", 1, (1 << 32) - 1),
            "seed": whole_of(seed, "seed"),
        }
        fields = fields_of(self._send_bytes("localize", [raw(rows)], parameters).body)
        found = Localization(
            version=Version.of(fields),
            accepted=fields.flag("accepted"),
            verdict=fields.text("verdict"),
            reason=fields.text("reason"),
            candidates=tuple(_candidate(of) for of in fields.objects("candidates")),
            rivals=rivals_in(fields),
            exhaustive=fields.flag("exhaustive"),
            cut_short=fields.flag("cut_short"),
            search_ms=fields.number("search_ms"),
            points_skipped=fields.whole("points_skipped"),
        )
        return self._noted(found)


def _direction(vector: ArrayLike, argument: str) -> str:
    return numbers_text(vector_of(vector, 3, argument, is_finite=True))


def _candidate(fields: Fields) -> Candidate:
    return Candidate(
        map_from_sensor=pose_in(fields, "map_from_sensor"),
        overlap=fields.number("overlap"),
        inliers=fields.number("inliers"),
        rays=fields.optional("rays", lambda name: rays_in(fields.object(name))),
    )
