"""Voxels taken out of the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arguments import level_of, word_of
from .._arrays import as_numbers, raw, rows_of, whole_of
from .._fields import Fields, fields_of
from .._sessions import new_request_id
from .._transport.request import Parameter
from ..errors import ArgumentError, MrolError, is_outcome_unknown
from ..questions.occupancy import POINTS
from ..shapes import KINDS, BoxLike, OrientedBox, Sphere, shape_json, shape_of
from ..version import Version, Versioned
from .handle import MapHandle

VOXELS = "indices i j k of voxels, whole numbers of shape (n, 3)"


@dataclass(frozen=True, eq=False)
class Deletion(Versioned):
    """What a deletion took out."""

    removed: int
    """Voxels of level 0."""
    replayed: bool
    """Whether it was done before under its id; this is that answer."""


class DeletionOperations(MapHandle):
    """Deletions."""

    def delete(
        self,
        points: ArrayLike | None = None,
        *,
        voxels: ArrayLike | None = None,
        box: BoxLike | None = None,
        sphere: Sphere | tuple[ArrayLike, float] | None = None,
        oriented_box: OrientedBox | None = None,
        level: int = 0,
        not_seen_since: int | None = None,
        request_id: str | None = None,
    ) -> Deletion:
        """Takes voxels out of the map: once, however often it has to be sent.

        Give one of `points` (shape (..., 3), map frame), `voxels` (indices i j k, shape (n, 3)), `box` (a `Box` or its corners,
        shape (2, 3)), `sphere` (a `Sphere` or its center and radius) and `oriented_box`. A region takes the voxels whose centers
        lie inside. With a `level` its voxels go, and all within them.
        `not_seen_since` leaves of a region only what no scan after that revision touched although one saw through it.

        `request_id` is a name by which the server knows the deletion if it is sent twice; the package gives one. Undo it by
        `undo(deletion)`. After an error with `repeat_with` it is not known whether it was done: repeat it with
        `**error.repeat_with`.
        """
        of_region = {"box": box, "sphere": sphere, "oriented_box": oriented_box}
        given = [name for name, value in {"points": points, "voxels": voxels, **of_region}.items() if value is not None]
        if len(given) != 1:
            one_of = "exactly one of points, voxels, box, sphere and oriented_box"
            raise ArgumentError("the target", " and ".join(given) or "nothing", one_of)
        identity = {"request_id": new_request_id() if request_id is None else word_of(request_id, "request_id")}
        common: dict[str, Any] = {"level": level_of(level), **identity}
        if not_seen_since is not None:
            common["not_seen_since"] = whole_of(not_seen_since, "not_seen_since")
        try:
            if points is not None:
                return self._noted(_deletion(self._delete_points(points, common)))
            target = {"voxels": _indices(voxels)} if voxels is not None else _region(given[0], of_region[given[0]])
            return self._noted(_deletion(self._send_json("POST", ("deletions",), {**target, **common})))
        except MrolError as error:
            if is_outcome_unknown(error):
                error.repeat_with = identity
            raise

    def _delete_points(self, points: ArrayLike, common: dict[str, Parameter]) -> Fields:
        rows, _ = rows_of(points, 3, "points", POINTS, self._request_bytes_max)
        return fields_of(self._send_bytes("deletions", [raw(rows)], common).body)


def _region(argument: str, value: object) -> dict[str, Any]:
    return shape_json(shape_of(value, argument), argument, (KINDS[argument],))


def _indices(voxels: ArrayLike | None) -> list[list[int]]:
    assert voxels is not None
    array = as_numbers(voxels, "voxels", VOXELS)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "iu":
        raise ArgumentError("voxels", f"an array of {array.dtype} of shape {array.shape}", VOXELS)
    in_range = (array >= np.iinfo(np.int32).min) & (array <= np.iinfo(np.int32).max)
    if not in_range.all():
        raise ArgumentError("voxels", "indices beyond 32 bits", VOXELS)
    indices: list[list[int]] = array.tolist()
    return indices


def _deletion(fields: Fields) -> Deletion:
    return Deletion(Version.of(fields), fields.whole("removed"), fields.flag("replayed"))
