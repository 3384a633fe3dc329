"""Clouds as drivers write them."""

import struct

import numpy as np
import pytest

from mrol_ros.clouds import POINTS_MAX, CloudError, CloudField, CloudLayout, read_cloud

TYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}

DRIVERS = {
    "velodyne": [("x", "f4", 0), ("y", "f4", 4), ("z", "f4", 8), ("intensity", "f4", 12), ("ring", "u2", 16), ("time", "f4", 18)],
    "ouster": [("x", "f4", 0), ("y", "f4", 4), ("z", "f4", 8), ("intensity", "f4", 16), ("t", "u4", 20), ("ring", "u1", 26)],
    "hesai": [("x", "f4", 0), ("y", "f4", 4), ("z", "f4", 8), ("intensity", "f4", 16), ("timestamp", "f8", 24), ("ring", "u2", 32)],
    "livox": [("x", "f4", 0), ("y", "f4", 4), ("z", "f4", 8), ("tag", "u1", 16), ("line", "u1", 17), ("timestamp", "f8", 18)],
    "realsense": [("x", "f4", 0), ("y", "f4", 4), ("z", "f4", 8), ("rgb", "f4", 16)],
    "turned around": [("z", "f4", 1), ("t", "u4", 17), ("y", "f4", 9), ("x", "f4", 5)],
    "doubles": [("x", "f8", 0), ("y", "f8", 8), ("z", "f8", 16), ("time", "f8", 24)],
    "whole numbers": [("x", "i2", 0), ("y", "i2", 2), ("z", "i2", 4), ("time", "f4", 6)],
    "forty fields": [(f"f{k}", "f4", 4 * k) for k in range(37)] + [("x", "f4", 148), ("y", "f4", 152), ("z", "f4", 156)],
}


def written(fields, step, points, times, *, big=False, width=None, row_padding=0):
    """A message, byte by byte."""
    order = ">" if big else "<"
    letters = {"f4": "f", "f8": "d", "u4": "I", "u2": "H", "i2": "h", "u1": "B"}
    width = width or len(points)
    rows = []
    for begin in range(0, len(points), width):
        row = bytearray()
        for point, time in zip(points[begin : begin + width], times[begin : begin + width], strict=True):
            record = bytearray(b"\xa5" * step)
            values = {**dict(zip("xyz", point, strict=True)), **dict.fromkeys(("t", "time", "timestamp"), time)}
            for name, form, offset in fields:
                value = values.get(name, 7)
                struct.pack_into(order + letters[form], record, offset, value if form[0] == "f" else int(value))
            row += record
        rows.append(bytes(row) + b"\x5a" * row_padding)
    columns = [CloudField(name, offset, TYPES[form]) for name, form, offset in fields]
    layout = CloudLayout(width, len(rows), step, width * step + row_padding, big, columns)
    return layout, b"".join(rows)


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("driver", DRIVERS)
def test_points_are_those_that_the_driver_wrote(driver, big):
    fields = DRIVERS[driver]
    is_whole = driver == "whole numbers"
    points = np.random.default_rng(1).uniform(-50, 50, (60, 3)).astype(np.float32)
    points = np.rint(points).astype(np.float32) if is_whole else points
    if not is_whole:
        points[7] = np.nan
        points[8] = 0
    times = np.arange(60) * 1000.0 + 5
    step = max(offset + int(form[1]) for _, form, offset in fields) + 3
    for width, padding in ((60, 0), (20, 13)):
        layout, data = written(fields, step, points.tolist(), times.tolist(), big=big, width=width, row_padding=padding)
        cloud = read_cloud(layout, bytearray(data))
        assert cloud.points.dtype == np.float32
        assert cloud.points.tobytes() == points.tobytes()
        has_times = any(name in ("t", "time", "timestamp") for name, *_ in fields)
        assert (cloud.times is None) == (not has_times)
        if has_times:
            assert cloud.times.astype(float).tolist() == times.tolist()
        assert cloud.returns.sum() == (60 if is_whole else 58)


def layout(**changes):
    fields = [CloudField(name, 4 * axis, 7) for axis, name in enumerate("xyz")]
    return CloudLayout(
        **{"width": 2, "height": 1, "point_step": 12, "row_step": 24, "is_bigendian": False, "fields": fields, **changes}
    )


def test_what_is_no_cloud_is_refused_with_field_value_and_limit():
    good = bytes(24)
    assert read_cloud(layout(), good).points.shape == (2, 3)
    assert read_cloud(layout(width=0), b"").points.shape == (0, 3)
    xyz = layout().fields
    for changes, data, words in [
        ({"fields": xyz[:2]}, good, "no field 'z'; it has x y"),
        ({"fields": [*xyz[:2], CloudField("z", 9, 7)]}, good, "field 'z' ends at byte 13 of a point, and a point has 12 bytes"),
        ({"fields": [*xyz[:2], CloudField("z", 8, 77)]}, good, "field 'z' is of the unknown type 77"),
        ({"height": 2, "row_step": 23}, bytes(99), "does not fit in row_step, 23 bytes"),
        ({"height": 2}, good, "2 rows of 2 points need 48 bytes, and data has 24"),
        ({"width": 1 << 31}, good, f"the cloud has {1 << 31} points, and {POINTS_MAX} are read"),
        ({"fields": []}, good, "it has none"),
    ]:
        with pytest.raises(CloudError) as error:
            read_cloud(layout(**changes), data)
        assert words in str(error.value)
    with pytest.raises(CloudError, match="no field 'stamp'"):
        read_cloud(layout(), good, "stamp")


def test_a_field_that_is_there_twice_is_the_first_one():
    fields = [*layout().fields, CloudField("x", 4, 7)]
    data = np.arange(6, dtype="<f4").tobytes()
    assert read_cloud(layout(fields=fields), data).points.tolist() == [[0, 1, 2], [3, 4, 5]]
