"""What `nav_msgs/OccupancyGrid` holds."""

from __future__ import annotations

import numpy as np
from mrol import Grid
from numpy.typing import NDArray

OCCUPIED, FREE, UNKNOWN = 100, 0, -1


def grid_cells(grid: Grid) -> NDArray[np.int8]:
    """The cells of a grid row by row from the smallest y, as the message has them: 100 occupied, 0 free, -1 unknown.

    A grid that does not tell the unknown cells has all others free.
    """
    cells = np.full(grid.occupied.shape, FREE if grid.free is None else UNKNOWN, np.int8)
    if grid.free is not None:
        cells[grid.free] = FREE
    cells[grid.occupied] = OCCUPIED
    return cells.reshape(-1)
