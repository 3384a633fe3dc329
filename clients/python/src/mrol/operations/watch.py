"""The changes of a map, as they become durable."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing, suppress
from dataclasses import replace

import numpy as np

from .._arguments import flag_of, level_of, word_of
from .._arrays import whole_of
from .._fields import reading
from .._protobuf import Message
from .._transport.caller import Caller
from .._transport.deadline import Deadline, seconds
from .._transport.request import Parameter, Request
from .._transport.stop import Stop
from ..errors import ArgumentError, MrolError, excerpt
from ..progress import Progress, Told, checked_progress, progress_of
from ..shapes import BoxLike, OrientedBox
from ..version import Version, Versioned
from .following import SILENCE_MAX_S, following
from .framing import failure_of, next_message
from .handle import MapHandle
from .region import region_parameters
from .stream import Watch
from .watched import ChangeParts, Heartbeat, StateParts, WatchedChange, WatchedState, WatchEvent


class WatchOperations(MapHandle):
    """Watches."""

    def watch(
        self,
        since: Version | Versioned | None = None,
        *,
        delta_level: int | None = None,
        box: BoxLike | OrientedBox | None = None,
        viewpoints: bool = False,
        heartbeats: bool = False,
        progress: Progress = None,
        silence_max_s: float = SILENCE_MAX_S,
    ) -> Watch[WatchEvent]:
        """Tells of the map's changes as they become durable, for as long as it is iterated and not closed.

        First comes the whole state (`WatchedState`), unless `since` names a version from which the server can go on; then each
        change (`WatchedChange`), without a gap. After a lost connection or a restart of the server it goes on where it was; where
        that is not possible, or the map is another one, a `WatchedState` comes again. Without `delta_level` changes are the
        finest voxels as they were recorded; with it, voxels of that level that really appeared and went. The hashes of `since` go
        along: where the map had others at that revision, since an older data folder was put back, a `WatchedState` comes first.
        The version of an answer has the hash of voxels alone, that of an event the hash of keep-outs and viewpoints too. `box`
        leaves other voxels out. With `viewpoints` it tells the viewpoints of scans too, by which a copy knows what is free. With
        `heartbeats` it also tells that nothing has changed (`Heartbeat`). `progress` is told of the bytes of the state; what it
        raises ends the watch. A server that says nothing for `silence_max_s`, no heartbeat either, counts as lost.

        Raises what ends it for good: `NotFound` (the map was deleted), `Unauthenticated`, and `TransportError` where the server
        does not come back within `patience_s`.
        """
        parameters: dict[str, Parameter] = {
            "delta_level": None if delta_level is None else level_of(delta_level, "delta_level"),
            "viewpoints": flag_of(viewpoints, "viewpoints"),
            **region_parameters(box),
        }
        version = since.version if isinstance(since, Versioned) else since
        if version is not None:
            if not isinstance(version, Version):
                raise ArgumentError("since", excerpt(since), "a Version, or an answer with one")
            whole_of(version.revision, "since.revision")
            word_of(version.map_uuid, "since.map_uuid")
            if version.content_hash is not None:
                whole_of(version.content_hash, "since.content_hash")
            if version.state_hash is not None:
                whole_of(version.state_hash, "since.state_hash")
        wants_heartbeats = flag_of(heartbeats, "heartbeats")
        silent_s = seconds(silence_max_s, "silence_max_s")
        # What is wrong with the arguments is said here, and not when the first event is waited for.
        told = checked_progress(progress)
        return Watch(self._caller, lambda stop: self._events(parameters, version, wants_heartbeats, told, silent_s, stop=stop))

    def _events(
        self,
        parameters: dict[str, Parameter],
        version: Version | None,
        heartbeats: bool,
        progress: Progress,
        silent_s: float,
        *,
        stop: Stop,
    ) -> Generator[WatchEvent, None, None]:
        def connect() -> Generator[WatchEvent, None, None]:
            if version is not None and self._caller.has_several:
                self._wait_to_go_on(version, stop)
            request = Request("GET", self._target("watch", **parameters, **_since(version)))
            return _told(self._caller, request, silent_s, told, stop)

        with progress_of(progress, self._name, None) as told, closing(following(self._caller, connect, stop)) as events:
            for event in events:
                # A heartbeat has no content hash: that of the revision that it confirms still holds.
                if isinstance(event, Heartbeat) and version is not None and _is_at(event.version, version):
                    version = replace(version, state_hash=event.version.state_hash)
                else:
                    version = event.version
                if heartbeats or not isinstance(event, Heartbeat):
                    yield event

    def _wait_to_go_on(self, version: Version, stop: Stop) -> None:
        """Waits for one of several servers that has the version from which a watch goes on.

        One that is behind would tell of an older state. Where none has it the watch begins all the same, as after an older data
        folder was put back.
        """
        asked = {"min_revision": version.revision, "map_uuid": version.map_uuid}
        deadline = Deadline(self._caller.bounds.timeout_s, stop)
        with suppress(MrolError):
            self._server.query(np.zeros((1, 3), np.float32), (None, "exact", False), asked, deadline)


def _is_at(one: Version, other: Version) -> bool:
    return (one.revision, one.map_uuid) == (other.revision, other.map_uuid)


def _since(version: Version | None) -> dict[str, Parameter]:
    if version is None:
        return {}
    content_hash, state_hash = map(_digits, (version.content_hash, version.state_hash))
    since: dict[str, Parameter] = {"since_revision": version.revision, "map_uuid": version.map_uuid}
    return since | {"since_content_hash": content_hash, "since_state_hash": state_hash}


def _digits(hash_: int | None) -> str | None:
    return None if hash_ is None else f"{hash_:016x}"


def _told(caller: Caller, request: Request, silent_s: float, told: Told, stop: Stop) -> Generator[WatchEvent, None, None]:
    """The events of one connection, until it ends by an error."""
    states, changes, state_bytes, change_bytes = StateParts(), ChangeParts(), 0, 0
    with caller.stream(request, stop) as body:
        while True:
            data = next_message(body, Deadline(silent_s), caller.bounds.answer_bytes_max)
            with reading("a message of the watch"):
                message = Message(data)
                event: WatchEvent | None = None
                map_uuid, state_hash = message.text(1), message.whole(7) if message.has(7) else None
                if message.has(3):
                    part = message.message(3)
                    if part.flag(1):
                        states, state_bytes = StateParts(), 0
                    state_bytes += data.nbytes
                    if state_bytes > caller.bounds.answer_bytes_max:
                        raise ValueError("the state has more bytes than answer_bytes_max allows")
                    told(state_bytes, state_bytes if part.flag(2) else None)
                    event = states.add(part, map_uuid, state_hash)
                elif message.has(4):
                    change_bytes += data.nbytes
                    if change_bytes > caller.bounds.answer_bytes_max:
                        raise ValueError("a change has more bytes than answer_bytes_max allows")
                    event = changes.add(message.message(4), map_uuid, state_hash)
                elif message.has(5):
                    event = Heartbeat(Version(message.whole(2), map_uuid, state_hash=state_hash))
                elif message.has(6):
                    raise failure_of(message.message(6))
            if isinstance(event, WatchedState):
                states = StateParts()
            elif isinstance(event, WatchedChange):
                changes, change_bytes = ChangeParts(), 0
            if event is not None:
                yield event
