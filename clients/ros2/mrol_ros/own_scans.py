"""The scans of this node among those that the map tells of."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from threading import Lock

from mrol import WatchedScan

KEPT_MAX = 2000
"""Scans that are known as own ones: three minutes at 10 Hz."""

STRANGERS_MIN = 3
"""So many scans of another program are more than one that was under way as this node began."""

STRANGERS_S = 10.0
"""How long a scan of another program counts."""


class OwnScans:
    """Tells scans that this node has sent from those that another program sends under the same robot's name.

    The server takes the motion of each as that since the last one of either, so that both go astray. Threads may share it.
    """

    def __init__(self, robot: str, now_s: Callable[[], float] = time.monotonic) -> None:
        self._robot = robot
        self._now_s = now_s
        self._lock = Lock()
        self._sent: deque[tuple[str, int]] = deque(maxlen=KEPT_MAX)
        self._strangers_s: deque[float] = deque(maxlen=STRANGERS_MIN)

    def sent(self, session: str, scan_id: int) -> None:
        """Takes note of a scan before it is sent."""
        with self._lock:
            if (session, scan_id) not in self._sent:
                self._sent.append((session, scan_id))

    def see(self, scan: WatchedScan) -> None:
        """Takes a scan that came into the map."""
        with self._lock:
            if scan.robot == self._robot and (scan.session, scan.scan_id) not in self._sent:
                self._strangers_s.append(self._now_s())

    def stranger(self) -> str:
        """A sentence while another program sends scans under this robot's name; empty while none does."""
        with self._lock:
            times_s = list(self._strangers_s)
        if len(times_s) < STRANGERS_MIN or self._now_s() - times_s[0] > STRANGERS_S:
            return ""
        return (
            f"another program sends scans as robot {self._robot!r}, and both go astray: give each robot a name of its own "
            "(namespace, or parameter robot)"
        )
