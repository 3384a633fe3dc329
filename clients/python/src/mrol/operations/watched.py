"""What a watch tells: states, changes and heartbeats, read from the messages of `proto/mrol/v1/occupancy.proto`."""

from dataclasses import dataclass, field
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

from .._bits import BLOCK, blocks_of, voxels_of
from .._protobuf import Message
from ..pose import Pose
from ..shapes import Box, OrientedBox, Prism, Shape, Sphere
from ..version import Version, Versioned
from .keep_outs import KeepOut

Blocks = NDArray[Any]

NO_BLOCKS: Blocks = np.zeros(0, BLOCK)


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """Where a scan was taken, and how far it saw from there: `docs/design/free-space.md` says what the bytes mean."""

    revision: int
    map_from_sensor: Pose
    image: bytes


@dataclass(frozen=True, eq=False)
class WatchedState(Versioned):
    """All that the map holds at one revision: what was told before holds no more."""

    resolution_m: float
    """The side of voxels of level 0."""
    levels: int
    level: int
    """The level of the voxels."""
    blocks: Blocks
    """The occupied voxels, 8 x 8 x 8 of them a block; see `VoxelBlocks.blocks`."""
    keep_outs: tuple[KeepOut, ...]
    viewpoints: tuple[Viewpoint, ...]

    def indices(self) -> NDArray[np.int32]:
        """Indices i j k of the occupied voxels, shape (n, 3)."""
        return voxels_of(self.blocks)


@dataclass(frozen=True, eq=False)
class WatchedScan:
    """A change by a scan."""

    robot: str
    session: str
    scan_id: int | None
    timestamp_ns: int | None
    map_from_sensor: Pose
    carved_voxels: int


@dataclass(frozen=True)
class WatchedDeletion:
    """A change by a deletion."""


@dataclass(frozen=True)
class WatchedUndo:
    """A change by an undo: the revisions of what was taken back, ascending."""

    scans: tuple[int, ...]
    deletions: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class WatchedKeepOut:
    """A change of a keep-out: put, or ended."""

    name: str
    put: KeepOut | None
    """The keep-out as it is now; None of one that ended."""


Cause = Union[WatchedScan, WatchedDeletion, WatchedUndo, WatchedKeepOut, None]


@dataclass(frozen=True, eq=False)
class WatchedChange(Versioned):
    """One change of the map: voxels of `removed_blocks` go, and those of `added_blocks` come."""

    removed_blocks: Blocks
    added_blocks: Blocks
    cause: Cause
    """None of a cause that this version of the package does not know."""
    viewpoint: bytes | None
    """Where viewpoints are watched: the image of the one that the scan left."""
    displaced: tuple[int, ...]
    """The revisions of the scans whose viewpoints went for want of memory."""

    def removed(self) -> NDArray[np.int32]:
        """Indices i j k of the voxels that go, shape (n, 3)."""
        return voxels_of(self.removed_blocks)

    def added(self) -> NDArray[np.int32]:
        """Indices i j k of the voxels that come, shape (n, 3): of changes those that a scan touched, new or not."""
        return voxels_of(self.added_blocks)


@dataclass(frozen=True, eq=False)
class Heartbeat(Versioned):
    """Nothing has changed for a while: everything up to this revision was told."""


WatchEvent = Union[WatchedState, WatchedChange, Heartbeat]


@dataclass
class StateParts:
    """The parts of a state that have come."""

    blocks: list[Blocks] = field(default_factory=list)
    keep_outs: list[KeepOut] = field(default_factory=list)
    viewpoints: list[Viewpoint] = field(default_factory=list)

    def add(self, state: Message, map_uuid: str, state_hash: int | None) -> WatchedState | None:
        """Takes a part; the whole state where it is the last one."""
        self.blocks.append(blocks_of(bytes(state.data(8))))
        self.keep_outs += [_keep_out(of) for of in state.messages(9)]
        self.viewpoints += [_viewpoint(of) for of in state.messages(10)]
        if not state.flag(2):
            return None
        return WatchedState(
            version=Version(state.whole(3), map_uuid, state.whole(4), state_hash),
            resolution_m=state.double(5),
            levels=state.whole(6),
            level=state.whole(7),
            blocks=np.concatenate(self.blocks),
            keep_outs=tuple(self.keep_outs),
            viewpoints=tuple(self.viewpoints),
        )


@dataclass
class ChangeParts:
    """The parts of a change that have come."""

    removed: list[Blocks] = field(default_factory=list)
    added: list[Blocks] = field(default_factory=list)

    def add(self, change: Message, map_uuid: str, state_hash: int | None) -> WatchedChange | None:
        """Takes a part; the whole change where it is the last one."""
        self.removed.append(blocks_of(bytes(change.data(4))))
        self.added.append(blocks_of(bytes(change.data(5))))
        if not change.flag(2):
            return None
        viewpoint = change.message(10)
        content_hash = change.whole(3) if change.has(3) else None
        return WatchedChange(
            version=Version(change.whole(1), map_uuid, content_hash, state_hash),
            removed_blocks=np.concatenate(self.removed),
            added_blocks=np.concatenate(self.added),
            cause=_cause(change),
            viewpoint=bytes(viewpoint.data(1)) if change.has(10) else None,
            displaced=viewpoint.wholes(2),
        )


def _cause(change: Message) -> Cause:
    if change.has(6):
        return _scan(change.message(6))
    if change.has(7):
        return WatchedDeletion()
    if change.has(8):
        undo = change.message(8)
        return WatchedUndo(undo.wholes(1), undo.wholes(2))
    if change.has(9):
        of = change.message(9)
        return WatchedKeepOut(of.text(1), _keep_out(of.message(2)) if of.has(2) else None)
    return None


def _scan(of: Message) -> WatchedScan:
    return WatchedScan(
        robot=of.text(1),
        session=of.text(2),
        scan_id=of.whole(3) if of.has(3) else None,
        timestamp_ns=of.signed(4) if of.has(4) else None,
        map_from_sensor=_pose(of.message(5)),
        carved_voxels=of.whole(6),
    )


def _viewpoint(of: Message) -> Viewpoint:
    return Viewpoint(of.whole(1), _pose(of.message(2)), bytes(of.data(3)))


def _pose(of: Message) -> Pose:
    rotation = of.message(2)
    return Pose.of((_vector(of.message(1)), [rotation.double(number) for number in (1, 2, 3, 4)]))


def _vector(of: Message) -> list[float]:
    return [of.double(number) for number in (1, 2, 3)]


def _keep_out(of: Message) -> KeepOut:
    return KeepOut(
        name=of.text(1),
        shape=_shape(of.message(2)),
        made_revision=of.whole(4),
        made_by=of.text(3) or None,
        expires_at_ns=of.signed(5) if of.has(5) else None,
    )


def _shape(of: Message) -> Shape:
    region, prism = of.message(1), of.message(2)
    if region.has(1):
        box = region.message(1)
        return Box(_vector(box.message(1)), _vector(box.message(2)))
    if region.has(2):
        sphere = region.message(2)
        return Sphere(_vector(sphere.message(1)), sphere.double(2))
    if region.has(3):
        oriented = region.message(3)
        return OrientedBox(_pose(oriented.message(1)), _vector(oriented.message(2)))
    if of.has(2):
        return Prism(np.array(prism.doubles(1)).reshape(-1, 2), prism.double(2), prism.double(3))
    raise ValueError("a keep-out of a shape that this version of the package does not know")
