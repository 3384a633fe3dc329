"""A copy of a server's map, which follows it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Union

from mrol import Version
from mrol._arrays import number_of, whole_of
from mrol.errors import ArgumentError, excerpt
from mrol.shapes import Box, BoxLike

from . import _native
from ._questions import Questions, version_of

TIMEOUT_S = 60.0
"""How long the first copy may take."""

File = Union[str, Path]


@dataclass(frozen=True, eq=False)
class ReplicaStatus:
    """How far a replica is."""

    version: Version
    """The state of the copy."""
    head_revision: int
    """The newest revision that the server told of: the copy lags as far behind it."""
    is_connected: bool
    """Whether the server is telling of changes."""
    resets: int
    """How often all of it was copied."""
    last_error: "str | None"
    """Why the last watch ended, where it did."""


class Replica(Questions):
    """A copy of a map in this process: it follows the server's and answers without a call, at the revision that each answer names.

    `address` is the server's gRPC address, `http://127.0.0.1:7334` or `unix:/run/mrol/grpc.sock`; `https://` with `ca`, the path of
    the PEM file of the authority, where it is not one that the system trusts. `key` is the caller's secret. `region` copies the
    voxels of a box alone, and then questions are refused that what lies outside could change. `blocks_max` bounds the copy
    (72 bytes and what levels take for each block of 8 x 8 x 8 voxels). With `bloom` it has filters, without `viewpoints` it does
    not know what is free. Where the connection breaks it comes back by itself; `status` tells.

    Raises `ConnectFailed`, `NotFound` (`map_not_found`), `Unauthenticated`, `PermissionDenied`, `TimedOut`.
    """

    def __init__(
        self,
        address: str,
        map: str,
        *,
        key: "str | None" = None,
        ca: "File | None" = None,
        certificate: "File | None" = None,
        private_key: "File | None" = None,
        timeout_s: float = TIMEOUT_S,
        silence_s: "float | None" = None,
        region: "BoxLike | None" = None,
        blocks_max: "int | None" = None,
        bloom: bool = False,
        viewpoints: bool = True,
    ) -> None:
        given = address if "://" in address or address.startswith("unix:") else f"http://{address}"
        opened = _native.NativeReplica(
            given,
            map,
            key=key,
            ca=_bytes_of(ca),
            certificate=_bytes_of(certificate),
            private_key=_bytes_of(private_key),
            timeout_s=_seconds(timeout_s, "timeout_s"),
            silence_s=None if silence_s is None else _seconds(silence_s, "silence_s"),
            region=None if region is None else Box.of(region, "region").corners("region"),
            blocks_max=None if blocks_max is None else whole_of(blocks_max, "blocks_max", 1),
            bloom=bool(bloom),
            viewpoints=bool(viewpoints),
        )
        super().__init__(opened)
        self._opened = opened
        self._name = f"{map!r} of {given}"

    @property
    def status(self) -> ReplicaStatus:
        """How far it is."""
        version, head_revision, is_connected, resets, last_error = self._opened.status()
        return ReplicaStatus(version_of(version), head_revision, is_connected, resets, last_error)

    @property
    def revision(self) -> int:
        """The revision of the copy."""
        return self.status.version.revision

    def wait_for_revision(self, revision: int, timeout_s: float = 10.0) -> None:
        """Waits until the copy has a revision, that of a change which was acknowledged for example.

        Raises `DeadlineExceeded` (`revision_not_reached`) where it does not come in time.
        """
        self._opened.wait_for_revision(whole_of(revision, "revision"), _seconds(timeout_s, "timeout_s"))

    def __repr__(self) -> str:
        return f"<replica of mrol map {self._name}>"


def _bytes_of(file: "File | None") -> "bytes | None":
    return None if file is None else Path(file).read_bytes()


def _seconds(value: float, argument: str) -> float:
    seconds = number_of(value, argument)
    if not 0 <= seconds <= 1e9:
        raise ArgumentError(argument, excerpt(value), "seconds, 0 to 1e9")
    return seconds
