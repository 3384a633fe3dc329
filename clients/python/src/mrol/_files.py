"""Paths that callers give, and files that are replaced whole."""

import errno
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from io import FileIO
from os import PathLike
from typing import IO, Any, Union

from .errors import ArgumentError, excerpt

File = Union[str, PathLike[str]]

SECRET_BYTES_MAX = 16 << 20
"""Bytes of a file with a key or certificates: some times what the authorities of a whole system take."""

_MODE_OF_NEW = 0o666
"""What the umask is taken from, where no file is there."""

_IRREGULAR = "it is no regular file"


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
        with open_regular(path_of_secret(value, argument, expected)) as opened:
            data = opened.read(SECRET_BYTES_MAX + 1) or b""
            if len(data) <= SECRET_BYTES_MAX:
                return data
            wrong = f"more than {SECRET_BYTES_MAX} bytes"
    except OSError as error:
        wrong = error.strerror or type(error).__name__
    # Here no exception has the path in it any more.
    raise ArgumentError(argument, f"{shown_path(value)}: {wrong}", expected)


def open_regular(path: str) -> FileIO:
    """Opens a file to be read that is a regular one: of a pipe it would wait for a writer, and a device has no end.

    Raises `OSError`.
    """
    # Opening a pipe waits as well, unless it is told not to.
    opened = FileIO(path, opener=_open_at_once)
    if not stat.S_ISREG(os.fstat(opened.fileno()).st_mode):
        opened.close()
        raise OSError(errno.EINVAL, _IRREGULAR)
    return opened


def _open_at_once(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK)


def check_regular(path: str) -> None:
    """Makes sure that what somebody else opens is a regular file.

    Raises `OSError`.
    """
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise OSError(errno.EINVAL, _IRREGULAR)


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

    Mode, owner and group of a file that is there stay as far as this process may give files away; a new one has what the umask
    leaves. Where owner or group cannot stay, the mode gives nobody more than it gave. A symbolic link stays one, and the file that
    it leads to is replaced.

    Raises `OSError`, also where the new file is in its place and its folder cannot be written to the disk.
    """
    if os.path.basename(path) in ("", ".", ".."):
        # It would be a file of the name that the folder was to have.
        raise ArgumentError(argument, f"{excerpt(path)}, which is the name of a folder", "the path of a file, or of none yet")
    target = os.path.realpath(path)
    folder = os.path.dirname(target)
    former = _former(target, argument)
    aside = os.path.join(folder, f".unfinished-{secrets.token_hex(8)}")
    # Not readable by others at any time, where the one that is there is not.
    opener = partial(os.open, mode=_MODE_OF_NEW if former is None else 0o600)
    try:
        # Wherever Ctrl-C may come, a file object has the descriptor, and its name is known.
        with open(aside, "xb", opener=opener) as written:
            if former is not None:
                _keep_owner_and_mode(written.fileno(), former)
            yield written
            written.flush()
            os.fsync(written.fileno())
        os.replace(aside, target)
    except BaseException:
        with suppress(OSError):
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


def _keep_owner_and_mode(descriptor: int, former: os.stat_result) -> None:
    try:
        os.fchown(descriptor, former.st_uid, former.st_gid)
    except OSError:
        # To another owner root alone gives a file; to another group its owner does, who is in that group.
        with suppress(OSError):
            os.fchown(descriptor, -1, former.st_gid)
    mode, now = stat.S_IMODE(former.st_mode), os.fstat(descriptor)
    if now.st_uid != former.st_uid or now.st_gid != former.st_gid:
        # Nobody becomes another by running it.
        mode &= 0o777
    if now.st_gid != former.st_gid:
        # Who is in the one group may not be in the other: each has what both the group and all others had.
        common = mode >> 3 & mode & 0o7
        mode = mode & 0o700 | common << 3 | common
    os.fchmod(descriptor, mode)


def _sync_folder(folder: str) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
