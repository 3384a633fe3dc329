"""What became of the scans that robots sent."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from .._arguments import word_of
from .._arrays import F64, whole_of
from .._fields import Fields, fields_of, reading
from .._transport.caller import Caller
from .._transport.deadline import Deadline, seconds
from .._transport.request import Parameter, Request
from .._transport.stop import Stop
from ..errors import server_error
from ..pose import Pose, pose_in
from .following import SILENCE_MAX_S, Lines, following
from .handle import MapHandle
from .scans import ScanAnswer, answer_in
from .stream import Watch

STATUS = {
    "unauthenticated": 401,
    "permission_denied": 403,
    "not_found": 404,
    "resource_exhausted": 429,
    "unavailable": 503,
}
"""The status of HTTP of each code with which a stream ends."""


@dataclass(frozen=True, eq=False)
class FailedScan:
    """Why a request failed."""

    reason: str
    """The stable word for programs."""
    detail: str
    """A sentence for people."""


@dataclass(frozen=True, eq=False)
class ScanEvent:
    """What became of a scan that was sent for insertion."""

    number: int
    """Greater than that of every event of the map before it."""
    time_ms: float
    """When it was answered, milliseconds since 1970."""
    robot: str
    session: str
    scan_id: int | None
    points: int
    """Its points, whether they counted or not."""
    duration_ms: float
    """From the whole request to its answer."""
    guess: Pose | None
    """The pose that its guess stood for; None of a request that failed, and of an answer that is given again."""
    sample: F64
    """Of a robot's last scan, where it was refused: some of its points in the sensor frame, shape (n, 3)."""
    answer: ScanAnswer | None
    """What was answered; None of a request that failed."""
    error: FailedScan | None
    """Why the request failed; None of one that was answered."""

    @property
    def accepted(self) -> bool:
        """Whether it is in the map."""
        return self.answer is not None and self.answer.accepted


class EventOperations(MapHandle):
    """The last answers to robots."""

    def events(self, *, robot: str | None = None, since_number: int = 0) -> tuple[ScanEvent, ...]:
        """What became of the last scans, the oldest first: of all robots or of one `robot`, those after the event `since_number`.

        The server keeps them in memory, so many a map (`events_per_map_max`); a restart forgets them.
        """
        fields = self._get_fields("events", **_query(robot, since_number))
        return tuple(_event(of) for of in fields.objects("events"))

    def watch_events(
        self, *, robot: str | None = None, since_number: int = 0, silence_max_s: float = SILENCE_MAX_S
    ) -> Watch[ScanEvent]:
        """The same, then each as it comes, for as long as it is iterated and not closed.

        `robot` and `since_number` choose as of `events`. A server that says nothing for `silence_max_s`, no heartbeat either,
        counts as lost. It comes back after a lost connection, and where a restored map takes the place of this one.

        Raises what ends it for good: `NotFound` (the map was deleted), `Unauthenticated`, and `TransportError` where the server
        does not come back within `patience_s`.
        """
        query, silent_s = _query(robot, since_number), seconds(silence_max_s, "silence_max_s")
        # What is wrong with the arguments is said here, and not when the first event is waited for.
        return Watch(self._caller, lambda stop: self._follow_events(query, silent_s, stop))

    def _follow_events(self, query: dict[str, Parameter], silent_s: float, stop: Stop) -> Generator[ScanEvent, None, None]:
        def connect() -> Generator[ScanEvent, None, None]:
            return _told(self._caller, Request("GET", self._target("events", "watch", **query)), silent_s, stop)

        with closing(following(self._caller, connect, stop)) as events:
            for event in events:
                query["since_number"] = event.number
                yield event


def _query(robot: str | None, since_number: int) -> dict[str, Parameter]:
    return {
        "robot": None if robot is None else word_of(robot, "robot"),
        "since_number": whole_of(since_number, "since_number") or None,
    }


def _told(caller: Caller, request: Request, silent_s: float, stop: Stop) -> Generator[ScanEvent, None, None]:
    """The events of one connection, until it ends by an error."""
    with caller.stream(request, stop) as body:
        lines = Lines(body, caller.bounds.answer_bytes_max)
        while True:
            fields = fields_of(lines.next(Deadline(silent_s)))
            if fields.has("error") and not fields.has("number"):
                of = fields.object("error")
                code = of.text("code")
                raise server_error(STATUS.get(code, 500), code, of.text("reason"), of.text("detail"))
            if fields.has("number"):
                yield _event(fields)


def _event(fields: Fields) -> ScanEvent:
    robot, session = fields.text("robot"), fields.text("session")
    scan_id = fields.optional("scan_id", fields.whole)
    answer = error = None
    if fields.has("answer"):
        answer = answer_in(fields.object("answer"), (fields.whole("points"),), robot, session, scan_id)
    if fields.has("error"):
        of = fields.object("error")
        error = FailedScan(of.text("reason"), of.text("detail"))
    with reading("the sample"):
        sample = fields.numbers("sample", (-1, 3)) if fields.has("sample") else _no_points()
    return ScanEvent(
        number=fields.whole("number"),
        time_ms=fields.number("time_ms"),
        robot=robot,
        session=session,
        scan_id=scan_id,
        points=fields.whole("points"),
        duration_ms=fields.number("duration_ms"),
        guess=pose_in(fields, "guess") if fields.has("guess") else None,
        sample=sample,
        answer=answer,
        error=error,
    )


def _no_points() -> F64:
    points = np.zeros((0, 3))
    points.setflags(write=False)
    return points
