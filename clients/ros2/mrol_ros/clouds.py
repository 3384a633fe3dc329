"""Clouds of `sensor_msgs/PointCloud2` as arrays, whichever driver wrote them.

Any order of fields, any types and padding, either byte order, organized or not: as `mrol insert` reads them from a log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .texts import shown

TIME_FIELDS = ("t", "time", "timestamp", "offset_time", "time_stamp", "time_offset", "point_time")
"""Fields in which drivers write when a point was measured."""

POINTS_MAX = 2_000_000
"""Points of a cloud, at most: as many as a server takes of a scan by default."""

POINT_STEP_MAX = 1 << 20
"""Bytes of a point, at most."""

FIELDS_LISTED = 12
NAME_SHOWN = 40

TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8", 9: "i8", 10: "u8", 11: "u1"}
"""Types by the numbers of `sensor_msgs/PointField`: 9 to 11, which some distributions add, are int64, uint64 and boolean."""


class CloudError(ValueError):
    """A message has no points that can be read."""


@dataclass(frozen=True)
class CloudField:
    """A field of `sensor_msgs/PointField`."""

    name: str
    offset: int
    datatype: int


@dataclass(frozen=True)
class CloudLayout:
    """How the points of a message lie in its data."""

    width: int
    height: int
    point_step: int
    row_step: int
    is_bigendian: bool
    fields: Sequence[CloudField]


@dataclass(frozen=True, eq=False)
class StampedCloud:
    """A message with points, as it came."""

    stamp_ns: int
    frame: str
    layout: CloudLayout
    data: Any
    """A buffer of bytes."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """The points of a message, in its order."""

    points: NDArray[np.float32]
    """Shape (n, 3), meters, in the sensor frame; not finite, or 0 0 0, where nothing returned."""
    times: NDArray[Any] | None
    """When each was measured, as the driver wrote it; None where the message has no field for it."""
    times_field: str
    """The name of that field."""

    @property
    def returns(self) -> NDArray[np.bool_]:
        """Which points are returns, shape (n,)."""
        x, y, z = self.points.T
        with np.errstate(invalid="ignore"):
            # A sum is finite where all three are; so it takes one look at each.
            is_finite = np.isfinite(x + y + z)
        return is_finite & ((x != 0) | (y != 0) | (z != 0))


def read_cloud(layout: CloudLayout, data: Any, time_field: str | None = None) -> Cloud:
    """The points of a message, whose `data` is a buffer of bytes.

    Times are those of `time_field`, or of the first of `TIME_FIELDS` that there is.

    Raises `CloudError`: x, y, z or `time_field` is missing, a field does not lie within its point, points not within the data, rows
    overlap, or there are more than `POINTS_MAX` points or than `POINT_STEP_MAX` bytes of each.
    """
    if layout.point_step > POINT_STEP_MAX:
        raise CloudError(f"point_step must be at most {POINT_STEP_MAX} bytes, got {layout.point_step}")
    buffer = memoryview(data).cast("B")
    columns = {of.name: of for of in reversed(layout.fields)}
    if time_field is None:
        time_field = next((name for name in TIME_FIELDS if name in columns), None)
    wanted = ["x", "y", "z"] + ([time_field] if time_field is not None else [])
    of_dtype = [_column(layout, columns, name) for name in wanted]
    dtype = np.dtype(
        {
            "names": ["x", "y", "z", "t"][: len(wanted)],
            "formats": [form for form, _ in of_dtype],
            "offsets": [offset for _, offset in of_dtype],
            "itemsize": layout.point_step,
        }
    )
    records = _records(layout, dtype, buffer)
    points = _points(records, dtype, of_dtype)
    times = (
        None
        if time_field is None
        else np.ascontiguousarray(records["t"].reshape(-1)).astype(dtype["t"].newbyteorder("="), copy=False)
    )
    return Cloud(points, times, time_field or "")


def _column(layout: CloudLayout, columns: dict[str, CloudField], name: str) -> tuple[str, int]:
    of = columns.get(name)
    if of is None:
        names = [shown(column.name, NAME_SHOWN) for column in layout.fields[:FIELDS_LISTED]]
        listed = " ".join(names) + (" ..." if len(layout.fields) > FIELDS_LISTED else "")
        raise CloudError(f"the cloud has no field {name!r}; it has {listed or 'none'}")
    form = TYPES.get(of.datatype)
    if form is None:
        raise CloudError(f"field {name!r} is of the unknown type {of.datatype}")
    end = of.offset + int(form[1])
    if end > layout.point_step:
        raise CloudError(f"field {name!r} ends at byte {end} of a point, and a point has {layout.point_step} bytes (point_step)")
    return (">" if layout.is_bigendian else "<") + form, of.offset


def _records(layout: CloudLayout, dtype: np.dtype[Any], buffer: memoryview) -> NDArray[Any]:
    """The points as records, of shape (height, width)."""
    width, height = layout.width, layout.height
    if width == 0 or height == 0:
        return np.zeros((0, 0), dtype)
    if width * height > POINTS_MAX:
        raise CloudError(f"the cloud has {width * height} points, and {POINTS_MAX} are read")
    row = width * layout.point_step
    # Drivers of clouds of one row leave it at 0.
    row_step = row if height == 1 or layout.row_step == 0 else layout.row_step
    if row_step < row:
        raise CloudError(f"a row of {width} points of {layout.point_step} bytes does not fit in row_step, {row_step} bytes")
    needed = (height - 1) * row_step + row
    if needed > buffer.nbytes:
        raise CloudError(f"{height} rows of {width} points need {needed} bytes, and data has {buffer.nbytes}")
    return np.ndarray((height, width), dtype, buffer, strides=(row_step, layout.point_step))


def _points(records: NDArray[Any], dtype: np.dtype[Any], columns: list[tuple[str, int]]) -> NDArray[np.float32]:
    offsets = [offset for _, offset in columns[:3]]
    is_plain = all(form == "<f4" for form, _ in columns[:3]) and offsets == [offsets[0], offsets[0] + 4, offsets[0] + 8]
    if is_plain and records.size:
        # One copy of three numbers at a time, bit for bit.
        triples = np.dtype({"names": ["p"], "formats": [("<f4", (3,))], "offsets": [offsets[0]], "itemsize": dtype.itemsize})
        return np.ascontiguousarray(records.view(triples)["p"]).reshape(-1, 3)
    points = np.empty((records.size, 3), np.float32)
    with np.errstate(over="ignore"):
        for axis, name in enumerate("xyz"):
            points[:, axis] = records[name].reshape(-1)
    return points
