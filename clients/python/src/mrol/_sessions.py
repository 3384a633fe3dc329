"""Names and numbers by which the server knows a scan that is sent twice."""

import os
import uuid
from threading import Lock

ID_FIRST = 1


class Session:
    """One run of a program: a name that no other run has, and the ids of the scans that it sends."""

    def __init__(self) -> None:
        self.process = os.getpid()
        self.name = f"py-{uuid.uuid4().hex[:20]}"
        self._lock = Lock()
        self._next: dict[tuple[str, str], int] = {}

    def next_id(self, map_name: str, robot: str, given: int | None) -> int:
        """The id of the next scan of a robot in a map: the one that is given, or the next after all before it."""
        with self._lock:
            following = self._next.get((map_name, robot), ID_FIRST)
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
