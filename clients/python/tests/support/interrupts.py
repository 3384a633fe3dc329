"""Ctrl-C, at any place of a call, and calls that must not hang."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import mrol


def is_interrupted_at(line: int, call: Callable[[], object]) -> bool:
    """Interrupts a call before so many lines of the package are run; whether it comes to so many."""
    package = str(Path(mrol.__file__).parent)
    lines = 0

    def trace(frame: FrameType, event: str, _: object) -> Any:
        nonlocal lines
        if not frame.f_code.co_filename.startswith(package):
            return None
        if event == "line":
            lines += 1
            if lines == line:
                sys.settrace(None)
                raise KeyboardInterrupt
        return trace

    former = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    except KeyboardInterrupt:
        pass
    finally:
        sys.settrace(former)
    # One that comes while an object is destroyed ends no call.
    return lines >= line


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Ends what takes longer, wherever it waits."""

    def hangs(*_: object) -> None:
        raise AssertionError(f"no end after {seconds} s")

    former = signal.signal(signal.SIGALRM, hangs)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, former)
