"""Names and numbers by which the server knows a scan that is sent twice."""

import os
import uuid
from threading import Lock

from ._arrays import WORD_MAX
from .errors import ArgumentError

ID_FIRST = 1


class Session:
    """One run of a program: a name that no other run has, and the ids of the scans that it sends."""

    def __init__(self) -> None:
        self.process = os.getpid()
        self.name = f"py-{uuid.uuid4().hex[:20]}"
        self._lock = Lock()
        self._next: dict[tuple[str, str], int] = {}

    def next_id(self, map_name: str, robot: str, given: int | None) -> int:
        """The id of the next scan of a robot in a map: the one that is given, or the next after all before it.

        Raises `ArgumentError` where there is none after the largest. It begins no other session by itself: under that a scan which
        is sent again by its id would be another one.
        """
        with self._lock:
            following = self._next.get((map_name, robot), ID_FIRST)
            if given is None and following > WORD_MAX:
                what_to_do = "given with a session of your own (session=...), or the server connected to anew, which begins one"
                raise ArgumentError("scan_id", f"none, and {WORD_MAX} was given before, the last of this session", what_to_do)
            scan_id = following if given is None else given
            self._next[map_name, robot] = max(following, scan_id + 1)
            return scan_id


class Sessions:
    """The session of this process: a forked child has one of its own, since parent and child would give out the same ids."""

    def __init__(self) -> None:
        self._session = Session()

    def current(self) -> Session:
        """The session of this process."""
        session = self._session
        if session.process != os.getpid():
            session = self._session = Session()
        return session


def new_request_id() -> str:
    """An id of a deletion, an undo or a change of a keep-out."""
    return uuid.uuid4().hex
