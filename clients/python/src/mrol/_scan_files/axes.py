"""Which columns, properties or fields are coordinates."""

from collections.abc import Sequence

AXES = ("x", "y", "z")

Columns = tuple[int, int, int]
"""Where x, y and z are."""


class AxisMissing(Exception):
    """None of the names is that of a coordinate."""

    def __init__(self, axis: str) -> None:
        super().__init__(axis)
        self.axis = axis


class AxisTwice(AxisMissing):
    """Two of the names are that of one coordinate."""


def axes_of(names: Sequence[str]) -> Columns:
    """Where x, y and z are among names: in small letters, or in capitals where there is none in small ones."""
    found = []
    for axis in AXES:
        has_small = axis in names
        places = [i for i, name in enumerate(names) if name == axis or (not has_small and name == axis.upper())]
        if not places:
            raise AxisMissing(axis)
        if len(places) > 1:
            raise AxisTwice(axis)
        found.append(places[0])
    x, y, z = found
    return x, y, z
