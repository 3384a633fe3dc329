"""The tree of frames that `/tf` and `/tf_static` describe, and where one frame is in another at a time.

The rules are those of `mrol insert` for recorded logs: poses are interpolated at constant velocity, gaps above 2 s are not
bridged, and nothing is extrapolated by more than 0.1 s.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from mrol import Pose

from .motion import extrapolate, share_of_motion

EXTRAPOLATION_MAX_NS = 100_000_000
"""How far beyond its first and last pose a track is believed, nanoseconds."""

LATE_MAX_NS = 1_000_000_000
"""How late a transform may come, nanoseconds."""

GAP_MAX_NS = 2_000_000_000
KEPT_NS = 10_000_000_000
POSES_MAX = 10_000
"""Poses of a frame that are kept, at most."""

TREE_POSES_MAX = 200_000
"""Poses of all frames together that are kept, at most: each frame that moves has its share."""

SAME_M = 1e-3
SAME_DEG = 0.1
"""Two poses of a frame as close as this are told as the same."""

JUMP_M = 1.0
JUMP_M_PER_S = 100.0
"""A frame that goes farther from one pose to the next, and faster, has jumped."""

JUMPS_MIN = 3
"""So many jumps in ten seconds are of two publishers that tell different things; one is of an odometry that began anew."""

FRAMES_MAX = 1000
DEPTH_MAX = 64
NAME_BYTES_MAX = 256
FRAMES_LISTED = 12


class BadTransform(ValueError):
    """A transform that cannot be part of the tree."""


class NoTransform(LookupError):
    """It is not known where one frame is in another at a time.

    `may_come` says that a later message is likely to tell it: the newest is a little older than the time.
    """

    may_come = False


@dataclass
class Track:
    """Poses of one frame in another over the last ten seconds."""

    stamps_ns: list[int] = field(default_factory=list)
    """Ascending, all different."""
    poses: list[tuple[float, ...]] = field(default_factory=list)
    """x y z qx qy qz qw."""
    jumps_ns: deque[int] = field(default_factory=lambda: deque(maxlen=JUMPS_MIN))
    """When it jumped."""

    @property
    def is_torn(self) -> bool:
        """Whether it jumps to and fro."""
        return len(self.jumps_ns) == JUMPS_MIN and self.stamps_ns[-1] - self.jumps_ns[0] <= KEPT_NS

    def insert(self, stamp_ns: int, seven: tuple[float, ...], most: int = POSES_MAX) -> None:
        """Adds a pose; one of the same stamp is replaced. The newest `most` are kept.

        Poses more than ten seconds older than the newest are dropped. A new pose that old is of a clock that was set back:
        all poses before it are dropped.
        """
        if self.stamps_ns and self.stamps_ns[-1] - stamp_ns > KEPT_NS:
            self.stamps_ns.clear()
            self.poses.clear()
            self.jumps_ns.clear()
        at = bisect_left(self.stamps_ns, stamp_ns)
        if at < len(self.stamps_ns) and self.stamps_ns[at] == stamp_ns:
            self.poses[at] = seven
            return
        if self.stamps_ns and at == len(self.stamps_ns):
            gone_m, took_s = math.dist(seven[:3], self.poses[-1][:3]), (stamp_ns - self.stamps_ns[-1]) * 1e-9
            if gone_m > max(JUMP_M, JUMP_M_PER_S * took_s):
                self.jumps_ns.append(stamp_ns)
        self.stamps_ns.insert(at, stamp_ns)
        self.poses.insert(at, seven)
        self.cut(most)

    def cut(self, most: int) -> None:
        """Drops poses that are older than ten seconds, and all but the newest `most`."""
        old = bisect_left(self.stamps_ns, self.stamps_ns[-1] - KEPT_NS)
        old = max(old, len(self.stamps_ns) - most)
        if old > 0:
            del self.stamps_ns[:old]
            del self.poses[:old]

    def at(self, stamp_ns: int, beyond_ns: int) -> Pose:
        """The pose at a time, or continued from the nearest end by at most `beyond_ns`.

        Raises `NoTransform`, whose text continues "where A is in B".
        """
        stamps_ns = self.stamps_ns
        if not stamps_ns:
            raise NoTransform("was not published yet")
        after = bisect_left(stamps_ns, stamp_ns)
        if after < len(stamps_ns) and stamps_ns[after] == stamp_ns:
            return self._pose(after)
        if 0 < after < len(stamps_ns):
            begin_ns, end_ns = stamps_ns[after - 1], stamps_ns[after]
            nearest_ns = min(stamp_ns - begin_ns, end_ns - stamp_ns)
            if end_ns - begin_ns > GAP_MAX_NS and nearest_ns > beyond_ns:
                raise _other_time(nearest_ns, "from", beyond_ns)
            begin, end = self._pose(after - 1), self._pose(after)
            return begin @ share_of_motion(begin.inverse() @ end, (stamp_ns - begin_ns) / (end_ns - begin_ns))
        end, inner = (0, 1) if after == 0 else (len(stamps_ns) - 1, len(stamps_ns) - 2)
        off_ns = stamp_ns - stamps_ns[end]
        if abs(off_ns) > beyond_ns:
            error = _other_time(abs(off_ns), "before" if off_ns > 0 else "after", beyond_ns)
            error.may_come = 0 < off_ns <= LATE_MAX_NS
            raise error
        if not 0 <= inner < len(stamps_ns) or abs(stamps_ns[end] - stamps_ns[inner]) > GAP_MAX_NS:
            return self._pose(end)
        return extrapolate(self._pose(inner), self._pose(end), off_ns / (stamps_ns[end] - stamps_ns[inner]))

    def _pose(self, at: int) -> Pose:
        return Pose.of(self.poses[at])


@dataclass
class _Link:
    parent: str
    fixed: Pose | None = None
    track: Track = field(default_factory=Track)
    contradiction: str = ""


class FrameTree:
    """The tree of frames that several publishers describe, each of them a part."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}
        self._poses_max = POSES_MAX

    def fix(self, parent: str, child: str, seven: Sequence[float]) -> None:
        """Notes where `child` always is in `parent`: x y z qx qy qz qw of `parent_from_child`.

        Raises `BadTransform`.
        """
        pose = Pose.of(checked_transform(parent, child, seven))
        link = self._link(parent, child)
        if link.fixed is not None:
            off = link.fixed.inverse() @ pose
            off_m, off_deg = float(np.linalg.norm(off.translation_m)), _degrees(off)
            if off_m > SAME_M or off_deg > SAME_DEG:
                link.contradiction = (
                    f"frame {child!r} is fixed in {parent!r} at two poses, {off_m:.3f} m and {off_deg:.1f} degrees apart, and the "
                    "last one counts: is one of two publishers wrong?"
                )
        elif link.track.stamps_ns:
            link.contradiction = _fixed_and_moving(parent, child)
            link.track = Track()
        link.fixed = pose

    def note(self, parent: str, child: str, stamp_ns: int, seven: Sequence[float]) -> None:
        """Notes where `child` was in `parent` at a time. A frame that is fixed stays so.

        Raises `BadTransform`.
        """
        checked = checked_transform(parent, child, seven)
        link = self._link(parent, child)
        if link.fixed is not None:
            link.contradiction = _fixed_and_moving(parent, child)
            return
        is_first = not link.track.stamps_ns
        link.track.insert(stamp_ns, checked, self._poses_max)
        if is_first:
            tracks = [of.track for of in self._links.values() if of.track.stamps_ns]
            self._poses_max = min(POSES_MAX, TREE_POSES_MAX // len(tracks))
            for track in tracks:
                track.cut(self._poses_max)

    def forget_motions(self) -> None:
        """Forgets where frames were that move; those that are fixed stay."""
        for link in self._links.values():
            link.track = Track()

    def poses(self) -> int:
        """How many poses are kept."""
        return sum(len(link.track.stamps_ns) for link in self._links.values())

    def contradictions(self, frame: str) -> list[str]:
        """What publishers say against each other of a frame and those above it, a sentence each."""
        links = [(of, self._links[of]) for of in self.ancestors(frame) if of in self._links]
        torn = [jumping(link.parent, of) for of, link in links if link.track.is_torn]
        return [link.contradiction for _, link in links if link.contradiction] + torn

    def has(self, frame: str) -> bool:
        """Whether a frame is a child or a parent."""
        return frame in self._links or any(link.parent == frame for link in self._links.values())

    def ancestors(self, frame: str) -> Iterator[str]:
        """A frame, its parent, and so on up to a root."""
        for _ in range(DEPTH_MAX):
            yield frame
            link = self._links.get(frame)
            if link is None:
                return
            frame = link.parent

    def transform(self, target: str, source: str, stamp_ns: int, beyond_ns: int = 0) -> Pose:
        """Where `source` is in `target` at a time: `target_from_source`.

        Poses are interpolated, and extrapolated by at most `beyond_ns`, which counts as 0.1 s at most.

        Raises `NoTransform`: a frame is not known, the two are not connected, or a transform is known at other times alone.
        """
        if target == source:
            return Pose.identity()
        for frame in (target, source):
            if not self.has(frame):
                raise NoTransform(f"there is no frame {frame!r}; there are {self.listed()}")
        up = list(self.ancestors(target))
        common = next((name for name in self.ancestors(source) if name in up), None)
        if common is None:
            raise NoTransform(
                f"frames {target!r} and {source!r} are not connected: they end at {up[-1]!r} and {self._root(source)!r}"
            )
        beyond_ns = min(beyond_ns, EXTRAPOLATION_MAX_NS)
        target_side = self._in_ancestor(common, target, stamp_ns, beyond_ns)
        source_side = self._in_ancestor(common, source, stamp_ns, beyond_ns)
        return target_side.inverse() @ source_side if target != common else source_side

    def listed(self) -> str:
        """The names of the frames, as many as an error may list."""
        names = sorted(set(self._links) | {link.parent for link in self._links.values()})
        more = f" and {len(names) - FRAMES_LISTED} more" if len(names) > FRAMES_LISTED else ""
        return (" ".join(names[:FRAMES_LISTED]) + more) or "none at all"

    def _root(self, frame: str) -> str:
        return list(self.ancestors(frame))[-1]

    def _in_ancestor(self, ancestor: str, frame: str, stamp_ns: int, beyond_ns: int) -> Pose:
        pose: Pose | None = None
        for child in self.ancestors(frame):
            if child == ancestor:
                break
            link = self._links[child]
            try:
                step = link.fixed or link.track.at(stamp_ns, beyond_ns)
            except NoTransform as error:
                told = NoTransform(f"where {child!r} is in {link.parent!r} {error}")
                told.may_come = error.may_come
                raise told from None
            pose = step if pose is None else step @ pose
        return pose or Pose.identity()

    def _link(self, parent: str, child: str) -> _Link:
        link = self._links.get(child)
        if link is not None and link.parent == parent:
            return link
        above = list(self.ancestors(parent))
        if child in above:
            raise BadTransform(f"frame {child!r} cannot be a child of {parent!r}, which lies below it")
        if len(above) >= DEPTH_MAX:
            raise BadTransform(f"frame {child!r} is left out: {DEPTH_MAX} frames are above it, which is the limit")
        if link is None and len(self._links) >= FRAMES_MAX:
            raise BadTransform(f"frame {child!r} is left out: there are {FRAMES_MAX} frames, which is the limit")
        told = ""
        if link is not None:
            one, other = sorted((link.parent, parent))
            told = f"frame {child!r} hangs on {one!r} and on {other!r}: two publishers tell of it, and the last one counts"
        link = self._links[child] = _Link(parent, contradiction=told)
        return link


def plain_frame(name: str) -> str:
    """A frame's name without the leading slash of older programs."""
    return name.removeprefix("/")


def is_frame_name(name: str) -> bool:
    """Whether a name is short enough to be kept, and may be shown."""
    return 0 < len(name.encode(errors="replace")) <= NAME_BYTES_MAX and name.isprintable()


def checked_transform(parent: str, child: str, seven: Sequence[float]) -> tuple[float, ...]:
    """The numbers of a transform, with a unit quaternion: programs round them, so any length from 0.5 to 2 is taken.

    Raises `BadTransform`.
    """
    for name in (parent, child):
        if not is_frame_name(name):
            got = len(name.encode(errors="replace"))
            raise BadTransform(f"a frame's name must be 1 to {NAME_BYTES_MAX} printable bytes, got {got}: {name[:40]!r}")
    x, y, z, qx, qy, qz, qw = (float(number) for number in seven)
    length = math.hypot(qx, qy, qz, qw)
    if not (all(map(math.isfinite, (x, y, z))) and 0.5 <= length <= 2.0):
        raise BadTransform(f"the transform from {child!r} to {parent!r} has numbers that are no pose")
    return x, y, z, qx / length, qy / length, qz / length, qw / length


def jumping(parent: str, child: str) -> str:
    """A sentence about a frame whose track is torn."""
    return f"frame {child!r} jumps to and fro in {parent!r}: do two publishers tell of it?"


def _degrees(turn: Pose) -> float:
    vector, scalar = turn.rotation_xyzw[:3], float(turn.rotation_xyzw[3])
    return math.degrees(2 * math.atan2(float(np.linalg.norm(vector)), abs(scalar)))


def _fixed_and_moving(parent: str, child: str) -> str:
    return f"frame {child!r} is told by /tf and by /tf_static in {parent!r}: it counts as fixed"


def _other_time(off_ns: int, side: str, beyond_ns: int) -> NoTransform:
    return NoTransform(f"is known {off_ns * 1e-9:.3f} s {side} the cloud at the nearest, and {beyond_ns * 1e-9:.3f} s are bridged")
