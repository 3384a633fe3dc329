"""How many numbers bare floats have a row, as far as they show it.

The same bytes can be read as rows of three, four or five numbers. Rows of the wrong length mix coordinates with intensities and
with each other.
"""

import numpy as np
from numpy.typing import NDArray

NAMES = {3: "x y z", 4: "x y z i", 5: "x y z i ring"}
"""Columns that rows of so many numbers mostly have."""

SAMPLE = 1_200_000
"""Numbers that are looked at: whole rows of each length."""

STEP_RATIO = 4.0
"""How many times larger the step from a row to the next one is, in the wrong rows, that they are told by it."""

CHANCE_MAX = 1e-9
"""How likely it may be that a column of mixed coordinates has none outside of the range of an intensity."""


def other_row_length(values: NDArray[np.float32], length: int) -> int | None:
    """The length that rows rather have than the given one, where the numbers show it.

    Two things show it: numbers of one column change little from a row to the next, and intensities lie between 0 and 1 or 0 and 255
    where coordinates do not.
    """
    sample = values[:SAMPLE].astype(np.float64)
    if not np.isfinite(sample).any():
        return None
    step = _step(sample, length)
    for other in NAMES:
        if other != length and len(values) % other == 0:
            is_smoother = _step(sample, other) * STEP_RATIO < step
            if is_smoother or (other > length and _has_intensities(sample, other)):
                return other
    return None


def _step(sample: NDArray[np.float64], length: int) -> float:
    """The middle one of all differences between a number and the one a row later, but for those between zeros, of no return."""
    before, after = sample[:-length], sample[length:]
    counts = np.isfinite(before) & np.isfinite(after) & ((before != 0) | (after != 0))
    return float(np.median(np.abs(after[counts] - before[counts]))) if counts.any() else np.nan


def _has_intensities(sample: NDArray[np.float64], length: int) -> bool:
    """Whether a column behind the third is one of intensities, which cannot be by chance."""
    rows = sample[: len(sample) // length * length].reshape(-1, length)
    for column in rows.T[3:]:
        if not np.isfinite(column).all() or column.min(initial=0.0) < 0:
            continue
        most = next((most for most in (1.0, 255.0) if column.max(initial=0.0) <= most), None)
        if most is None:
            continue
        finite = sample[np.isfinite(sample)]
        outside = np.count_nonzero((finite < 0) | (finite > most)) / len(finite)
        if (1 - outside) ** len(column) < CHANCE_MAX:
            return True
    return False
