"""The servers that a client may ask: one, or several that serve the same maps."""

from collections.abc import Sequence

from ..errors import ConnectFailed, TimedOut
from .address import Address
from .connection import Connection
from .deadline import Deadline
from .pool import Pool

CONNECT_MAX_S = 3.0
"""How long one of several servers may take to answer a connection before the next is tried."""


class Servers:
    """Servers, one of which is in use until it is gone.

    No lock is needed: each change is one assignment, and threads that find the same server gone leave it for the same one.
    """

    def __init__(self, pools: Sequence[Pool]) -> None:
        self._pools = tuple(pools)
        self._current = 0

    def __len__(self) -> int:
        return len(self._pools)

    @property
    def current(self) -> Pool:
        """The server in use."""
        return self._pools[self._current]

    def next(self, pool: Pool) -> Pool:
        """The server behind another."""
        return self._pools[(self._pools.index(pool) + 1) % len(self._pools)]

    def leave(self, pool: Pool) -> None:
        """Goes on at the next server, where this one is in use."""
        place = self._pools.index(pool)
        if self._current == place:
            self._current = (place + 1) % len(self._pools)

    def of(self, address: Address) -> "Pool | None":
        """The server at an address, where it is one of these."""
        return next((pool for pool in self._pools if pool.address == address), None)

    def take(self, pool: Pool, deadline: Deadline, may_be_kept: bool = True) -> tuple[Connection, bool]:
        """A connection as `Pool.take` has it; one of several servers has a part of the time alone.

        Raises `ConnectFailed`, and `TimedOut` where no time is left.
        """
        if len(self) == 1:
            return pool.take(deadline, may_be_kept)
        most_s = min(CONNECT_MAX_S, deadline.remaining_s() / len(self))
        try:
            return pool.take(deadline.within(most_s), may_be_kept)
        except TimedOut as error:
            deadline.remaining_s()
            raise ConnectFailed(f"cannot connect to {pool.address.shown}: no answer within {most_s:.3g} s") from error

    def close(self) -> None:
        """Closes the connections that are kept."""
        for pool in self._pools:
            pool.close()
