"""An iterator over what a server tells, which any thread may close."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from threading import Lock
from types import TracebackType
from typing import Generic, TypeVar

from .._transport.caller import Caller
from .._transport.stop import Stop
from ..errors import ArgumentError, excerpt

Item = TypeVar("Item")


class Watch(Iterator[Item], Generic[Item]):
    """What `Map.watch` and `Map.watch_events` return: an iterator with `close`, which is a context manager too.

    One thread iterates it; any thread may close it.
    """

    def __init__(self, caller: Caller, begin: Callable[[Stop], Generator[Item, None, None]]) -> None:
        self._stop = Stop()
        self._items = begin(self._stop)
        # Held while an item is waited for, and never waited for itself.
        self._running = Lock()
        caller.streams.add(self)

    def __iter__(self) -> Watch[Item]:
        return self

    def __next__(self) -> Item:
        if not self._running.acquire(blocking=False):
            if self._stop.is_set:
                raise StopIteration
            raise ArgumentError("the watch", excerpt(self), "iterated by one thread at a time")
        try:
            if self._stop.is_set:
                self._items.close()
            return next(self._items)
        finally:
            if self._stop.is_set:
                self._items.close()
            self._running.release()

    def close(self) -> None:
        """Ends the iteration, as at its end: a thread that waits for the next event stops waiting, without an error.

        It may be called by any thread, by a handler of a signal, and twice. `Client.close` closes all watches of a client.
        """
        self._stop.set()
        # A thread that waits closes its connection itself.
        if self._running.acquire(blocking=False):
            try:
                self._items.close()
            finally:
                self._running.release()

    def __enter__(self) -> Watch[Item]:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        return "<mrol watch, closed>" if self._stop.is_set else "<mrol watch>"
