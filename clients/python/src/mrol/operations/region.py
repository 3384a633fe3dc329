"""A region as parameters of an address."""

from .._arrays import numbers_text, vector_of
from .._transport.request import Parameter
from ..pose import Pose
from ..shapes import Box, BoxLike, OrientedBox


def region_parameters(box: BoxLike | OrientedBox | None) -> dict[str, Parameter]:
    """A box along the map's axes as `min` and `max`, one with any orientation as `map_from_box` and `size`."""
    if box is None:
        return {}
    if isinstance(box, OrientedBox):
        pose = Pose.of(box.map_from_box, "box.map_from_box")
        size_m = vector_of(box.size_m, 3, "box.size_m", is_finite=True)
        return {"map_from_box": numbers_text(pose.seven()), "size": numbers_text(size_m)}
    min_m, max_m = Box.of(box).corners()
    return {"min": numbers_text(min_m), "max": numbers_text(max_m)}
