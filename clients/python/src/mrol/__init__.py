"""mrol: the 3-D map of a robot fleet, from Python.

    import mrol

    m = mrol.connect("localhost:7333").map("office-tour", resolution=0.05)
    m.insert(points)                  # float32 of shape (n, 3), sensor frame, meters
    m.query([[1, 2, 0.5]]).occupied   # array([ True])

`mrol.connect` has keys, TLS and time-outs, `mrol.Map` all that can be asked of a map, `mrol.errors` what goes wrong.
`mrol.replica` has maps inside this process, where its extension is installed.
`python -m mrol` prints how to start.
"""

from . import errors
from ._scan_files.reader import read_scan, scan_files
from .body import Body, Link
from .client import Client, Health, Maps, connect
from .errors import (
    ArgumentError,
    BadAnswer,
    Conflict,
    ConnectFailed,
    ConnectionLost,
    DeadlineExceeded,
    FailedPrecondition,
    Internal,
    InvalidArgument,
    MrolError,
    NotFound,
    PermissionDenied,
    ResourceExhausted,
    ScanFileError,
    ServerError,
    TimedOut,
    TransportError,
    Unauthenticated,
    Unavailable,
    WrongPort,
)
from .map import Map
from .operations.blocks import DistanceField, VoxelBlocks
from .operations.deletions import Deletion
from .operations.description import FilterSettings, Level, MapInfo, Sighting, Storage
from .operations.events import FailedScan, ScanEvent
from .operations.keep_outs import KeepOut, KeepOutChange, KeepOuts
from .operations.localization import Candidate, Localization
from .operations.observers import Observers, ObservingScan
from .operations.scans import OpenDirection, RayAgreement, RayCounts, Rival, ScanAnswer
from .operations.stream import Watch
from .operations.trajectory import MappedScan, Trajectory
from .operations.undo import Undo
from .operations.voxels import View, Voxels
from .operations.watched import (
    Heartbeat,
    Viewpoint,
    WatchedChange,
    WatchedDeletion,
    WatchedKeepOut,
    WatchedScan,
    WatchedState,
    WatchedUndo,
    WatchEvent,
)
from .operations.whole_grid import WholeGrid
from .pose import Pose
from .questions.all import Questions
from .questions.checks import Clearances, Collisions, FirstHits
from .questions.classification import Classification
from .questions.frontiers import Frontier, Frontiers, FrontierView
from .questions.grid import Grid
from .questions.motions import Motions
from .questions.nearest import Nearest
from .questions.occupancy import Occupancy
from .questions.rays import Rays
from .questions.scope import QuestionScope
from .shapes import Box, OrientedBox, Prism, Sphere
from .version import Version, Versioned

__version__ = "0.2.0"

__all__ = [
    "ArgumentError",
    "BadAnswer",
    "Body",
    "Box",
    "Candidate",
    "Classification",
    "Clearances",
    "Client",
    "Collisions",
    "Conflict",
    "ConnectFailed",
    "ConnectionLost",
    "DeadlineExceeded",
    "Deletion",
    "DistanceField",
    "FailedPrecondition",
    "FailedScan",
    "FilterSettings",
    "FirstHits",
    "Frontier",
    "FrontierView",
    "Frontiers",
    "Grid",
    "Health",
    "Heartbeat",
    "Internal",
    "InvalidArgument",
    "KeepOut",
    "KeepOutChange",
    "KeepOuts",
    "Level",
    "Link",
    "Localization",
    "Map",
    "MapInfo",
    "MappedScan",
    "Maps",
    "Motions",
    "MrolError",
    "Nearest",
    "NotFound",
    "Observers",
    "ObservingScan",
    "Occupancy",
    "OpenDirection",
    "OrientedBox",
    "PermissionDenied",
    "Pose",
    "Prism",
    "QuestionScope",
    "Questions",
    "RayAgreement",
    "RayCounts",
    "Rays",
    "ResourceExhausted",
    "Rival",
    "ScanAnswer",
    "ScanEvent",
    "ScanFileError",
    "ServerError",
    "Sighting",
    "Sphere",
    "Storage",
    "TimedOut",
    "Trajectory",
    "TransportError",
    "Unauthenticated",
    "Unavailable",
    "Undo",
    "Version",
    "Versioned",
    "View",
    "Viewpoint",
    "VoxelBlocks",
    "Voxels",
    "Watch",
    "WatchEvent",
    "WatchedChange",
    "WatchedDeletion",
    "WatchedKeepOut",
    "WatchedScan",
    "WatchedState",
    "WatchedUndo",
    "WholeGrid",
    "WrongPort",
    "connect",
    "errors",
    "read_scan",
    "scan_files",
]
