"""A map of a server, with all that can be asked of it."""

from .errors import ArgumentError, excerpt
from .operations.blocks import BlockOperations
from .operations.deletions import DeletionOperations
from .operations.description import DescriptionOperations
from .operations.events import EventOperations
from .operations.keep_outs import KeepOutOperations
from .operations.localization import LocalizationOperations
from .operations.map_file import MapFileOperations
from .operations.observers import ObserverOperations
from .operations.scans import ScanOperations
from .operations.trajectory import TrajectoryOperations
from .operations.undo import UndoOperations
from .operations.voxels import VoxelOperations
from .operations.watch import WatchOperations
from .operations.whole_grid import WholeGridOperations


class Map(
    ScanOperations,
    LocalizationOperations,
    WholeGridOperations,
    VoxelOperations,
    BlockOperations,
    ObserverOperations,
    TrajectoryOperations,
    WatchOperations,
    EventOperations,
    KeepOutOperations,
    DeletionOperations,
    UndoOperations,
    MapFileOperations,
    DescriptionOperations,
):
    """A map by its name: `mrol.connect(...).map(...)` makes one.

    It holds no connection of its own and costs nothing. Threads may share it, and so may processes that fork: a child opens
    connections of its own, and sends scans in a session of its own.

    All methods raise `ArgumentError` for arguments that cannot be sent, `ServerError` for refusals, and `TransportError` or
    `BadAnswer` where there is no answer (`mrol.errors`). Lengths are meters; a pose `a_from_b` carries points of frame b into
    frame a.
    """

    def with_timeout(self, timeout_s: float) -> "Map":
        """The same map, of which each call may take `timeout_s`, tries and waits included."""
        return Map(self._caller.with_timeout(timeout_s), self._name, self._robot, self._sessions, self._revisions)

    def with_robot(self, robot: str) -> "Map":
        """The same map, to which scans are sent in the name of another `robot`."""
        return Map(self._caller, self._name, robot, self._sessions, self._revisions)

    def __reduce__(self) -> "tuple[object, ...]":
        raise ArgumentError("the map", excerpt(self), "made anew in each process: a key is not to be written down with it")

    def __repr__(self) -> str:
        return f"<mrol map {self._name!r} of {self._caller.address}>"
