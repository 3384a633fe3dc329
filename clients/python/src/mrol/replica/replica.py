"""A copy of a server's map, which follows it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from .._arguments import flag_of, text_of
from .._arrays import whole_of
from .._files import File, read_secret_file
from .._transport.address import EXPECTED, Address, texts_of
from ..errors import ArgumentError
from ..shapes import Box, BoxLike
from ..version import Version
from .clock import seconds_of
from .in_process import InProcessMap
from .native import mrol_native

TIMEOUT_S = 60.0
"""How long the first copy may take."""


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
    last_error: str | None
    """Why the last watch ended, where it did."""
    age_s: float
    """How long ago the server was heard last, seconds. It says something at least every `watch_heartbeat_s`: an older copy may lack
    changes, even while `is_connected` is true."""
    has_ended: bool
    """Whether the replica follows no longer, since the server refused its key several times in a row: the copy stays as it is."""


class Replica(InProcessMap):
    """A copy of a map in this process: it follows the server's and answers without a call, at the revision that each answer names.

    `address` is the server's gRPC address, `http://127.0.0.1:7334` or `unix:/run/mrol/grpc.sock`; `https://` with `ca`, the path of
    the PEM file of the authority, where it is not one that the system trusts. An address with a user, a path or a query is refused,
    and not shown: `key` is the caller's secret. Several, in a list or with commas between them, are those of servers of the same
    maps: the copy follows one of them until it is gone, then the next. `region` copies the voxels of a box alone, and then
    questions are refused that what lies outside could change. `blocks_max` bounds the copy (72 bytes and what levels take for each
    block of 8 x 8 x 8 voxels). With `bloom` it has filters, without `viewpoints` it does not know what is free. Where the
    connection breaks it comes back by itself; `status` tells. With `age_max_s`, more than the server's `watch_heartbeat_s`,
    questions raise `Unavailable` (`replica_stale`) where the server was heard longer ago; without, answers may be of any age.

    Raises `ConnectFailed`, `NotFound` (`map_not_found`), `Unauthenticated`, `PermissionDenied`, `TimedOut`.
    """

    def __init__(
        self,
        address: str | Sequence[str],
        map: str,
        *,
        key: str | None = None,
        ca: File | None = None,
        certificate: File | None = None,
        private_key: File | None = None,
        timeout_s: float = TIMEOUT_S,
        silence_s: float | None = None,
        region: BoxLike | None = None,
        blocks_max: int | None = None,
        bloom: bool = False,
        viewpoints: bool = True,
        age_max_s: float | None = None,
    ) -> None:
        given = _address_of(address)
        if (certificate is None) != (private_key is None):
            missing = "private_key" if private_key is None else "certificate"
            raise ArgumentError(missing, "nothing", "given together with certificate and private_key, or neither of them")
        opened = mrol_native.NativeReplica(
            given,
            text_of(map, "map"),
            key=None if key is None else _secret_of(key),
            ca=_bytes_of(ca, "ca", "a file of certificates (PEM)"),
            certificate=_bytes_of(certificate, "certificate", "a file with a certificate (PEM)"),
            private_key=_bytes_of(private_key, "private_key", "a file with a private key (PEM)"),
            timeout_s=seconds_of(timeout_s, "timeout_s"),
            silence_s=None if silence_s is None else seconds_of(silence_s, "silence_s"),
            region=None if region is None else Box.of(region, "region").corners("region"),
            blocks_max=None if blocks_max is None else whole_of(blocks_max, "blocks_max", 1),
            bloom=flag_of(bloom, "bloom"),
            viewpoints=flag_of(viewpoints, "viewpoints"),
            age_max_s=None if age_max_s is None else seconds_of(age_max_s, "age_max_s"),
        )
        super().__init__(opened)
        self._opened = opened
        self._name = f"{map!r} of {given}"

    @property
    def status(self) -> ReplicaStatus:
        """How far it is."""
        version, head_revision, is_connected, resets, last_error, age_s, has_ended = self._opened.status()
        return ReplicaStatus(Version(*version), head_revision, is_connected, resets, last_error, age_s, has_ended)

    @property
    def revision(self) -> int:
        """The revision of the copy."""
        return self.status.version.revision

    def check_age(self, age_max_s: float) -> None:
        """Refuses a copy whose server was heard longer ago, before a question whose answer must not be older.

        Raises `Unavailable` (`replica_stale`).
        """
        self._opened.check_age(seconds_of(age_max_s, "age_max_s"))

    def wait_for_revision(self, revision: int, timeout_s: float = 10.0) -> None:
        """Waits until the copy has a revision, that of a change which was acknowledged for example.

        Raises `DeadlineExceeded` (`revision_not_reached`) where it does not come in time.
        """
        self._opened.wait_for_revision(whole_of(revision, "revision"), seconds_of(timeout_s, "timeout_s"))

    def __repr__(self) -> str:
        return f"<replica of mrol map {self._name}>"


def _address_of(address: object) -> str:
    """An address with its scheme, or several with commas between them: each a host and a port, without a user, a path or a query.

    What is none is not shown: it may have a key in it, or be one.
    """
    texts = texts_of(address) if isinstance(address, str) else address
    if isinstance(texts, list | tuple) and texts and all(isinstance(text, str) and text.isprintable() for text in texts):
        with suppress(ArgumentError):
            Address.parse_all(texts)
            return ",".join(text if "://" in text or text.startswith("unix:") else f"http://{text}" for text in texts)
    raise ArgumentError("address", f"an object of {type(address).__name__} that is none (it is not shown)", EXPECTED)


def _secret_of(key: object) -> str:
    if not isinstance(key, str) or not key.isascii():
        raise ArgumentError("key", "something else", "a secret as `mrol key new` prints it, in one line")
    return key


def _bytes_of(file: File | None, argument: str, expected: str) -> bytes | None:
    return None if file is None else read_secret_file(file, argument, expected)
