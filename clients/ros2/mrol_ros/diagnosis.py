"""What diagnostics say of the node."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

from .map_feed import MapFeed
from .mapper import Mapper
from .odometry import Odometry
from .own_scans import OwnScans
from .texts import shown

Status = tuple[str, str, str, Mapping[str, object]]
"""Name, level (ok, warn, error), sentence, values."""


class Diagnosis:
    """Sentences of the node's state; those of clouds count since the last time that they were asked for."""

    def __init__(self, mapper: Mapper, feed: MapFeed, odometry: Odometry, own_scans: OwnScans) -> None:
        self._mapper = mapper
        self._feed = feed
        self._odometry = odometry
        self._own_scans = own_scans
        self._before = self._numbers()

    def statuses(self, publishers: int) -> list[Status]:
        """All statuses; `publishers` is how many publish clouds."""
        told = [self._of_clouds(publishers), self._of_server(), self._of_frames(), self._of_map()]
        return [
            (name, level, shown(text), {key: shown(str(value)) for key, value in values.items()})
            for name, level, text, values in told
        ]

    def _numbers(self) -> dict[str, int]:
        queue, lost = self._mapper.queue, self._mapper.lost.count
        return {"received": queue.received, "lost": lost, "dropped": queue.dropped, **asdict(self._mapper.state.counts)}

    def _of_clouds(self, publishers: int) -> Status:
        self._mapper.lost.settle(publishers)
        numbers, state = self._numbers(), self._mapper.state
        since = {name: numbers[name] - self._before[name] for name in numbers}
        self._before = numbers
        values = {
            **numbers,
            "verdict": state.verdict,
            "reason": state.reason,
            "times of points": state.times,
            "publishers": publishers,
        }
        if self._mapper.is_paused:
            level, text = "warn", "paused"
        elif publishers == 0:
            level, text = "error", "nobody publishes clouds"
        elif since["received"] == 0:
            level = "error"
            text = "no cloud came: the publisher's QoS may not match (clouds_reliable), or the network drops large ones"
        elif state.needs_pose:
            level, text = "error", "the server does not know where the robot is: publish initialpose, or call localize"
        elif stranger := self._own_scans.stranger():
            level, text = "error", stranger
        elif since["refused"] > since["accepted"]:
            level, text = "warn", f"clouds do not fit: {state.reason}"
        elif since["unreadable"]:
            level, text = "error", f"clouds cannot be read: {state.left_out}"
        elif since["failed"]:
            level, text = "error", state.left_out
        elif since["late"] > since["accepted"]:
            level = "warn"
            text = f"{since['late']} of {since['received']} clouds were left out: their stamps are not later than the one before"
        elif since["not_sent"] > since["accepted"]:
            level, text = "error", f"the server does not take clouds: {state.left_out}"
        elif since["dropped"] + since["lost"] > since["accepted"]:
            level = "warn"
            text = f"{since['dropped']} of {since['received']} clouds were dropped for newer ones, and {since['lost']} never came"
        else:
            level, text = "ok", "clouds are mapped"
        return "clouds", level, text, values

    def _of_server(self) -> Status:
        error = self._mapper.state.server_error or self._feed.error
        if not error and self._feed.revision is None:
            return "server", "warn", "the server was not reached yet", {}
        return "server", "error" if error else "ok", error or "the server answers", {}

    def _of_frames(self) -> Status:
        missing = self._mapper.state.missing
        last = self._mapper.last_cloud
        if last is None:
            missing = "no cloud says yet which frames are needed"
        elif not missing:
            missing = "; ".join(self._odometry.contradictions(last.frame))
        return "frames", "warn" if missing else "ok", missing or "odometry is known", {}

    def _of_map(self) -> Status:
        feed = self._feed
        values = {"revision": feed.revision, "grid revision": feed.grid_revision, "voxels outside of octrees": feed.outside}
        text = "the map is followed" if feed.revision is not None else "nothing is known of the map yet"
        return "map", "ok" if feed.revision is not None and not feed.error else "warn", feed.error or text, values
