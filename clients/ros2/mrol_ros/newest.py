"""A queue of one: the newest wins."""

from __future__ import annotations

from threading import Condition
from typing import Generic, TypeVar

Item = TypeVar("Item")


class NewestQueue(Generic[Item]):
    """A queue of one item between threads: a newer item takes the place of one that was not taken yet, which counts as dropped."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._item: Item | None = None
        self._is_closed = False
        self._received = 0
        self._dropped = 0

    @property
    def received(self) -> int:
        """Items that were put."""
        return self._received

    @property
    def dropped(self) -> int:
        """Items whose place a newer one took."""
        return self._dropped

    def put(self, item: Item) -> None:
        """Puts an item; it never waits."""
        with self._changed:
            self._received += 1
            self._dropped += self._item is not None
            self._item = item
            self._changed.notify_all()

    def take(self, timeout_s: float) -> Item | None:
        """The item, waited for as long as `timeout_s`; None without one, and once the queue is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._item is not None or self._is_closed, timeout_s)
            item, self._item = self._item, None
            return None if self._is_closed else item

    def close(self) -> None:
        """Ends the waiting."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
