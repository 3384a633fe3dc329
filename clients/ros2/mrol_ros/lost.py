"""Clouds that were published and never came, by the numbers that the middleware gives them."""

from __future__ import annotations


class LostClouds:
    """Counts them. A publisher numbers its messages one by one, but a message does not say whose it is.

    So gaps count if there was one publisher alone all the time, and its numbers went up.
    """

    def __init__(self) -> None:
        self.count = 0
        """So many were lost."""
        self._last: int | None = None
        self._missing = 0
        self._is_mixed = False
        self._publishers = 0

    def see(self, number: int) -> None:
        """Takes the number of a message that came. A middleware that has none gives the same one to each."""
        if self._last is not None:
            step = number - self._last
            self._missing += max(step - 1, 0)
            self._is_mixed = self._is_mixed or step <= 0
        self._last = number

    def settle(self, publishers: int) -> None:
        """Counts what is missing since the last time; `publishers` is how many there are now."""
        if self._publishers == publishers == 1 and not self._is_mixed:
            self.count += self._missing
        self._missing, self._is_mixed, self._publishers = 0, False, publishers
