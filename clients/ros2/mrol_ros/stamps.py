"""The stamps of clouds: their order, and the session in which they number scans."""

from __future__ import annotations

import uuid
from dataclasses import dataclass

SET_BACK_NS = 1_000_000_000
"""A stamp farther than this before the last one is of a clock that was set back; a nearer one comes too late."""

JUMP_NS = 3600 * 1_000_000_000
"""A stamp farther than this from the last one is left out, unless the next cloud is of that time too."""

REAL_CLOCK_NS = 946_684_800 * 1_000_000_000
"""Stamps before the year 2000 are of a clock that begins anew with each start."""


@dataclass(frozen=True)
class StampVerdict:
    """What a stamp is, after those before it."""

    is_later: bool
    """Later than the last one, or of a clock that was set: the cloud is taken."""
    is_set_back: bool = False
    oddity: str = ""
    """The kind of what a person should know; empty where there is nothing."""
    text: str = ""
    """The sentence about it."""


class CloudStamps:
    """The order of the stamps of clouds, and the session in which they number scans."""

    def __init__(self, session: str, *, is_simulated: bool) -> None:
        """`session` is the one that somebody has set, or empty."""
        self._given = session
        self._session = session or (_own_session() if is_simulated else "")
        self._last_ns: int | None = None
        self._jump_ns: int | None = None

    def judge(self, stamp_ns: int) -> StampVerdict:
        """What the stamp of the next cloud is."""
        if stamp_ns <= 0:
            return StampVerdict(
                False, oddity="stamp", text=f"a cloud with the stamp {stamp_ns} ns is left out: the driver has to stamp its clouds"
            )
        last_ns, is_set_back, text = self._last_ns, False, ""
        jump_ns, self._jump_ns = self._jump_ns, None
        is_jump = last_ns is not None and abs(stamp_ns - last_ns) > JUMP_NS
        if is_jump and (jump_ns is None or not 0 < stamp_ns - jump_ns <= JUMP_NS):
            self._jump_ns = stamp_ns
            return StampVerdict(False, oddity="jump", text=_jump(stamp_ns - (last_ns or 0)))
        if last_ns is not None and stamp_ns <= last_ns:
            back_ns = last_ns - stamp_ns
            if back_ns < SET_BACK_NS:
                return StampVerdict(False)
            is_set_back = True
            text = f"the stamps of clouds went back by {back_ns * 1e-9:.1f} s, as of a clock that was set"
            if not self._given and stamp_ns < REAL_CLOCK_NS:
                self._session = _own_session()
        self._last_ns = stamp_ns
        return StampVerdict(True, is_set_back, "clock" if is_set_back else "", text)

    def session_of(self, stamp_ns: int) -> str:
        """The session in which a stamp is unique."""
        if not self._session:
            self._session = "ros2" if stamp_ns >= REAL_CLOCK_NS else _own_session()
        return self._session


def _jump(off_ns: int) -> str:
    side = "ahead of" if off_ns > 0 else "behind"
    return (
        f"a cloud whose stamp is {abs(off_ns) / JUMP_NS:.1f} hours {side} the one before is left out; if the next ones "
        "follow it, they are taken"
    )


def _own_session() -> str:
    return f"ros2-{uuid.uuid4().hex[:12]}"
