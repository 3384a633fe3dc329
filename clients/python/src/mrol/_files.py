"""Paths that callers give, and files that are replaced whole."""

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from typing import IO, Any, Union

from .errors import ArgumentError, excerpt

File = Union[str, PathLike[str]]

_MODE_OF_NEW = 0o666
"""What the umask is taken from, where no file is there."""


def path_of_file(value: object, argument: str, expected: str = "a path: text, or an object with one") -> str:
    """The path that a value is.

    A number is none, although the system would take it for a file that is open already, and close that.
    """
    path: Any = None
    with suppress(Exception):
        # Whatever an object's own conversion raises.
        path = os.fspath(value)  # type: ignore[call-overload]
    if isinstance(path, str) and path and "\0" not in path:
        with suppress(UnicodeEncodeError):
            os.fsencode(path)
            return path
    raise ArgumentError(argument, excerpt(value), expected)


def read_secret_file(value: object, argument: str, expected: str) -> bytes:
    """The bytes of a file that may hold a secret.

    What is wrong is told without the path where there is none such: it may be the secret itself, in the wrong argument.
    """
    wrong = ""
    try:
        with open(path_of_secret(value, argument, expected), "rb") as opened:
            return opened.read()
    except OSError as error:
        wrong = error.strerror or type(error).__name__
    # Here no exception has the path in it any more.
    raise ArgumentError(argument, f"{shown_path(value)}: {wrong}", expected)


def path_of_secret(value: object, argument: str, expected: str) -> str:
    """The path that a value is; an error does not show the value."""
    with suppress(ArgumentError):
        return path_of_file(value, argument, expected)
    raise ArgumentError(argument, f"an object of {type(value).__name__}, which is no path", expected)


def shown_path(value: object) -> str:
    """A path as a message shows it where its place may have got a secret: what names nothing that is there is not shown."""
    try:
        is_there = os.path.lexists(value)  # type: ignore[arg-type]
    except (OSError, ValueError, TypeError):
        is_there = False
    return excerpt(os.fspath(value)) if is_there else "no file that is there (what was given is not shown)"  # type: ignore[call-overload]


@contextmanager
def replacing(path: str, argument: str) -> Iterator[IO[bytes]]:
    """A file to write to, which takes the place of the one at `path` when all is done: on the disk, or not at all.

    Mode and owner of a file that is there stay; a new one has what the umask leaves. A symbolic link stays one, and the file
    that it leads to is replaced.

    Raises `OSError`, also where the new file is in its place and its folder cannot be written to the disk.
    """
    target = os.path.realpath(path)
    folder = os.path.dirname(target)
    former = _former(target, argument)
    mode = _MODE_OF_NEW if former is None else stat.S_IMODE(former.st_mode)
    aside = os.path.join(folder, f".unfinished-{secrets.token_hex(8)}")
    # Not readable by others at any time, where the one that is there is not.
    descriptor = os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
    try:
        with open(descriptor, "wb") as written:
            if former is not None:
                with suppress(PermissionError):
                    os.fchown(descriptor, former.st_uid, former.st_gid)
                os.fchmod(descriptor, mode)
            yield written
            written.flush()
            os.fsync(descriptor)
        os.replace(aside, target)
    except BaseException:
        with suppress(FileNotFoundError):
            os.unlink(aside)
        raise
    _sync_folder(folder)


def _former(target: str, argument: str) -> os.stat_result | None:
    """What is known of the file that is replaced, where there is one."""
    try:
        found = os.stat(target)
    except FileNotFoundError:
        return None
    if not stat.S_ISREG(found.st_mode):
        # It would be gone: a device, a pipe or a folder.
        raise ArgumentError(argument, f"{excerpt(target)}, which is no file", "the path of a file, or of none yet")
    return found


def _sync_folder(folder: str) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
