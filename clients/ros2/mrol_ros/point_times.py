"""Times of points, in seconds from the cloud's stamp.

Names tell no unit. The unit is the one of s, ms, us and ns in which a cloud lasts 1 ms to 1 s, as for `mrol insert` of a log; it is
found at the first cloud that has times, and holds from then on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .clouds import TIME_FIELDS, Cloud

UNITS_NS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1000, "ns": 1}
"""Units by their signs, the longest first, in nanoseconds."""

ORIGINS = ("stamp", "epoch", "first", "last")
"""From where times count: the cloud's stamp, 1970, or so that the first or the last point was measured at the stamp."""

SWEEP_MIN_NS = 1e6
SWEEP_MAX_NS = 1e9
FROM_STAMP_MAX_NS = 1_500_000_000
"""Times this far from the stamp are those of its sweep: the longest sweep, and half of one more."""

ORIGINS_APART = 0.2
"""Of two origins the nearer one is taken where they differ by more than this share of the sweep."""

WHOLE_MAX = float(1 << 62)
"""Floats beyond it are no times, and have no whole number of 64 bits."""


class NoTimes(ValueError):
    """A cloud has no times of points: it is mapped as if it was measured at once."""


@dataclass(frozen=True)
class TimesRule:
    """How times of points are read."""

    unit: str
    """A key of `UNITS_NS`."""
    origin: str
    """One of `ORIGINS`."""


def parse_times(text: str) -> tuple[str, TimesRule] | None:
    """The field and the rule of `FIELD:UNIT:FROM`, such as `t:ns:stamp`; None of an empty text.

    Raises `ValueError`.
    """
    if not text:
        return None
    parts = text.split(":")
    if len(parts) != 3 or not parts[0] or parts[1] not in UNITS_NS or parts[2] not in ORIGINS:
        units, origins = ", ".join(UNITS_NS), ", ".join(ORIGINS)
        raise ValueError(f"times must be FIELD:UNIT:FROM with a unit of {units} and from {origins}, got {text[:80]!r}")
    return parts[0], TimesRule(parts[1], parts[2])


def find_rule(cloud: Cloud, stamp_ns: int) -> tuple[TimesRule, str]:
    """The rule that the times of a cloud follow, and what is odd about them; an empty text where nothing is.

    Raises `NoTimes`.
    """
    counted = _counted(cloud)
    first, last = counted.min(), counted.max()
    name = cloud.times_field
    if first == last:
        raise NoTimes(f"field {name} is {first} at all points")
    spread = float(last) - float(first)
    unit = next((unit for unit, ns in UNITS_NS.items() if SWEEP_MIN_NS <= spread * ns <= SWEEP_MAX_NS), None)
    if unit is None:
        raise NoTimes(
            f"field {name} runs from {first} to {last}: that is a sweep of 1 ms to 1 s in none of s, ms, us, ns; the parameter "
            f"times, {name}:UNIT:FROM, says what it is"
        )
    first_ns, last_ns = (int(of) for of in _nanoseconds(np.array([first, last]), unit))

    def is_near(origin_ns: int) -> bool:
        return max(abs(first_ns - origin_ns), abs(last_ns - origin_ns)) <= FROM_STAMP_MAX_NS

    if is_near(0) and is_near(stamp_ns):
        # A simulated clock begins at 0. A sweep begins or ends at its stamp, or the stamp lies in it.
        off_stamp_ns, off_epoch_ns = (max(first_ns - origin_ns, origin_ns - last_ns, 0) for origin_ns in (0, stamp_ns))
        if stamp_ns != 0 and abs(off_stamp_ns - off_epoch_ns) < ORIGINS_APART * (last_ns - first_ns):
            raise NoTimes(
                f"the times in field {name} may count from the stamp or from the begin of the clock, which are too near each other "
                f"to tell; the parameter times, {name}:UNIT:FROM, says which"
            )
        return TimesRule(unit, "stamp" if off_stamp_ns <= off_epoch_ns else "epoch"), ""
    if is_near(0):
        return TimesRule(unit, "stamp"), ""
    if is_near(stamp_ns):
        return TimesRule(unit, "epoch"), ""
    off_s = (first_ns - stamp_ns) * 1e-9
    doubt = (
        f"the times of points are by another clock than the stamps, {off_s:.0f} s off: the first point is taken to be at the stamp"
    )
    return TimesRule(unit, "first"), doubt


def times_s(rule: TimesRule, cloud: Cloud, stamp_ns: int) -> NDArray[np.float32]:
    """The times of the points, seconds from the stamp, shape (n,); those of points that are no returns may be NaN.

    Raises `NoTimes` where they are not within 1.5 s of it.
    """
    counted = _nanoseconds(_counted(cloud), rule.unit)
    assert cloud.times is not None
    first_ns, last_ns = int(counted.min()), int(counted.max())
    origin_ns = {"stamp": 0, "epoch": stamp_ns, "first": first_ns, "last": last_ns}[rule.origin]
    if max(abs(first_ns - origin_ns), abs(last_ns - origin_ns)) > FROM_STAMP_MAX_NS:
        raise NoTimes(
            f"field {cloud.times_field}, in {rule.unit}, has times from {(first_ns - origin_ns) * 1e-9} to "
            f"{(last_ns - origin_ns) * 1e-9} s from the stamp, and 1.5 s are believed"
        )
    from_stamp_ns = _nanoseconds(cloud.times, rule.unit) - origin_ns
    seconds = (from_stamp_ns * 1e-9).astype(np.float32)
    seconds[np.abs(from_stamp_ns) > FROM_STAMP_MAX_NS] = np.nan
    return seconds


def _counted(cloud: Cloud) -> NDArray[Any]:
    """The times of the points that are returns: drivers leave anything in the others."""
    if cloud.times is None:
        raise NoTimes(f"the clouds have none of the fields {', '.join(TIME_FIELDS)}")
    counted: NDArray[Any] = cloud.times[cloud.returns]
    if counted.size == 0:
        raise NoTimes("no point of the cloud is a return")
    if counted.dtype.kind == "f" and not np.isfinite(counted).all():
        raise NoTimes(f"field {cloud.times_field} has a time that is no number, at a point that is a return")
    return counted


def _nanoseconds(values: NDArray[Any], unit: str) -> NDArray[np.int64]:
    """Times in nanoseconds, to the nearest one that the numbers can tell; cut at the ends of the numbers."""
    factor = UNITS_NS[unit]
    most = (1 << 62) // factor
    if values.dtype.kind != "f":
        return (
            np.clip(values, -most if values.dtype.kind == "i" else 0, min(most, np.iinfo(values.dtype).max)).astype(np.int64)
            * factor
        )
    # Of a time since 1970 in seconds the product would lose a digit that the number has.
    wide = np.clip(np.nan_to_num(values.astype(np.float64), nan=WHOLE_MAX), -float(most), float(most))
    whole = np.trunc(wide)
    return whole.astype(np.int64) * factor + np.rint((wide - whole) * factor).astype(np.int64)
