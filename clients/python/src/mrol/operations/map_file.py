"""A map as a file, and a map from one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from typing import IO

from .._arguments import flag_of
from .._fields import fields_of
from .._files import File, open_regular, path_of_file, replacing
from .._transport.caller import Body, Caller
from .._transport.deadline import Deadline, seconds
from .._transport.request import BYTES, Pieces, Request
from ..errors import ArgumentError, BadAnswer, ConnectionLost, MrolError, excerpt
from ..progress import Progress, Told, checked_progress, progress_of
from ..version import Version
from .description import MapInfo, map_info
from .handle import MapHandle

FILE_TIMEOUT_S = 600.0
"""How long a file may take."""

PIECE_BYTES = 1 << 20
"""Bytes that are read or sent at once."""

SOURCE = "the path of a map file, or the bytes of one"


class MapFileOperations(MapHandle):
    """Snapshots and restores."""

    def snapshot(self, file: File | None = None, *, progress: Progress = None, timeout_s: float = FILE_TIMEOUT_S) -> Version:
        """Writes the map, at one revision, to a map file; it may take `timeout_s`.

        `file` is its path, NAME.mrol in the current folder without it. A file of that name is replaced once the new one is whole
        and on the disk. Its mode, owner and group stay; where this process may not give a file to them, the mode gives nobody
        more than it gave. A new one has the mode that the umask leaves. Of a symbolic link that is replaced which it leads to.
        `progress` is told how many bytes of how many are there, or shows a bar (True, where tqdm is installed). What it raises
        ends the call, and leaves what was there.
        """
        path = path_of_file(f"{self._name}.mrol" if file is None else file, "file")
        checked, file_s = checked_progress(progress), seconds(timeout_s, "timeout_s")
        with replacing(path, "file") as written:
            deadline = Deadline(file_s)
            return self._caller.whole(lambda: self._write(written, checked, deadline))

    def restore(
        self, source: File | bytes, *, replace: bool = True, progress: Progress = None, timeout_s: float = FILE_TIMEOUT_S
    ) -> MapInfo:
        """Makes this map what a map file holds: `source` is the path of a regular file, or the bytes of one.

        `progress` is as of `snapshot`; it may take `timeout_s`.
        The map of that name is kept as NAME-replaced-REVISION; with `replace=False` there must be none. It is not sent again where
        the connection breaks: ask the server what is there.

        Raises `InvalidArgument` (`bad_map_file`), `Conflict` (`map_exists`), `PermissionDenied` (replacing takes a key for all
        maps), and `MrolError` where the file changes its length meanwhile or cannot be read to its end: nothing is restored then.
        """
        return restore(self._caller, self._target("snapshot", replace=flag_of(replace, "replace")), source, progress, timeout_s)

    def _write(self, written: IO[bytes], progress: Progress, deadline: Deadline) -> Version:
        caller = self._caller.with_timeout(min(deadline.remaining_s(), self._caller.bounds.timeout_s))
        written.seek(0)
        written.truncate()
        request = Request("GET", self._target("snapshot"))
        with caller.stream(request) as body, progress_of(progress, self._name, body.length) as told:
            _copy(body, written, told, deadline)
            return Version.of_headers(body.answer)


def restore(caller: Caller, target: str, source: File | bytes, progress: Progress, timeout_s: float) -> MapInfo:
    """Sends a map file to where a map is made from it."""
    of_file, checked = caller.with_timeout(timeout_s), checked_progress(progress)
    with _pieces(source) as pieces:
        total = pieces.nbytes
        with progress_of(checked, "restore", total) as told:
            request = Request("PUT", target, BYTES, pieces, is_repeatable=False, on_sent=lambda sent: told(sent, total))
            answer = of_file.call(request)
    return map_info(fields_of(answer.body))


def _copy(body: Body, written: IO[bytes], told: Told, deadline: Deadline) -> None:
    total, done = body.length, 0
    while piece := body.read(PIECE_BYTES, deadline):
        written.write(piece)
        done += len(piece)
        told(done, total)
    if total is not None and done != total:
        raise ConnectionLost(f"the map file broke off after {done} of {total} bytes")
    if done == 0:
        raise BadAnswer("an answer without a byte, which is no map file")


@contextmanager
def _pieces(source: File | bytes) -> Iterator[Pieces]:
    if isinstance(source, bytes | bytearray | memoryview):
        yield _BytePieces(_bytes_of(source))
        return
    path = path_of_file(source, "source", SOURCE)
    try:
        opened = open_regular(path)
    except OSError as error:
        raise ArgumentError("source", f"{excerpt(path)}: {error.strerror or error}", SOURCE) from error
    with opened:
        yield _FilePieces(opened, path)


class _BytePieces:
    """Bytes in memory, piece by piece."""

    def __init__(self, whole: memoryview) -> None:
        self._whole = whole

    @property
    def nbytes(self) -> int:
        return self._whole.nbytes

    def __iter__(self) -> Iterator[memoryview]:
        for at in range(0, self.nbytes, PIECE_BYTES):
            yield self._whole[at : at + PIECE_BYTES]


class _FilePieces:
    """The bytes of a file, piece by piece, as many as it had when it was opened.

    It is read and not mapped: the system ends a process that touches a mapped page which the file has no more.
    """

    def __init__(self, file: FileIO, path: str) -> None:
        self._file = file
        self._path = path
        self.nbytes = os.fstat(file.fileno()).st_size

    def __iter__(self) -> Iterator[memoryview]:
        buffer = memoryview(bytearray(min(PIECE_BYTES, self.nbytes)))
        left = self.nbytes
        self._file.seek(0)
        while left:
            count = self._read_into(buffer[:left])
            left -= count
            # Before the last piece is sent, behind which the server has a whole request.
            if count == 0 or (left == 0 and self._size() != self.nbytes):
                raise MrolError(
                    f"{excerpt(self._path)} changed while it was sent: it had {self.nbytes} bytes, and has {self._size()}"
                )
            yield buffer[:count]

    def _size(self) -> int:
        return os.fstat(self._file.fileno()).st_size

    def _read_into(self, buffer: memoryview) -> int:
        try:
            return self._file.readinto(buffer) or 0
        except OSError as error:
            raise MrolError(f"{excerpt(self._path)} cannot be read: {error.strerror or error}") from error


def _bytes_of(source: bytes | bytearray | memoryview) -> memoryview:
    try:
        return memoryview(source).cast("B")
    except (TypeError, ValueError) as error:
        raise ArgumentError("source", f"{excerpt(source)}: {error}", f"{SOURCE}, which lie together") from error
