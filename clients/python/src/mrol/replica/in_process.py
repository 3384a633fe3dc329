"""What replicas and maps without a server have in common."""

from __future__ import annotations

from types import TracebackType
from typing import TypeVar

from .._arrays import F32
from ..errors import ArgumentError, excerpt
from ..questions.all import Questions
from ..questions.scope import QuestionScope
from .backend import NativeBackend
from .body import PreparedBody
from .native import mrol_native

Opened = TypeVar("Opened", bound="InProcessMap")


class InProcessMap(Questions):
    """A map inside this process, and what it is asked.

    Threads may share it: questions run beside each other, without the lock of the interpreter. It stays with the process that
    opened it; a child that was forked gets an error. Arrays may be changed again as soon as a call returns.
    """

    def __init__(self, native: mrol_native.NativeMap) -> None:
        self._backend = NativeBackend(native)
        self._native = native
        # The innermost loop of a planner calls the extension itself.
        vars(self)["motion_is_free"] = native.motion_is_free

    def motion_is_free(
        self, body: PreparedBody, configurations: F32, *, unknown_is_occupied: bool = False, scope: QuestionScope | None = None
    ) -> bool:
        """Whether one motion is free, for the innermost loop of a planner.

        `configurations` is contiguous and aligned float32 with two or more rows of x y z qx qy qz qw for each link: nothing is
        converted, and anything else is refused. `scope` has the options of all questions, `{"level": 1}` for example, in a dict:
        a call that takes them as keywords is slower.
        """
        return self._native.motion_is_free(body, configurations, unknown_is_occupied=unknown_is_occupied, scope=scope)

    def close(self) -> None:
        """Gives its memory back, once the last call that uses it returns. Every later call is an error."""
        self._native.close()

    def __enter__(self: Opened) -> Opened:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, traceback: TracebackType | None) -> None:
        self.close()

    def __reduce__(self) -> tuple[object, ...]:
        raise ArgumentError("the map", excerpt(self), "opened anew in each process")
