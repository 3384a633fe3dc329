"""The secret that a caller shows."""

from .._files import File, read_secret_file, shown_path
from ..errors import ArgumentError

EXPECTED = "a secret as `mrol key new` prints it, in one line"
IN_FILE = "the path of a file with a secret as `mrol key new` prints it, in one line"


class Key:
    """A secret, or none; one of a file is read again when the server does not take it any more."""

    def __init__(self, secret: str | None, file: File | None) -> None:
        if secret is not None and file is not None:
            raise ArgumentError("key", "a key and a key_file", "one of the two")
        self._file = file
        self._secret = _of_file(file) if file is not None else _given(secret)

    def headers(self) -> dict[str, str]:
        """The header that shows it."""
        return {} if self._secret is None else {"authorization": f"Bearer {self._secret}"}

    def renew(self) -> bool:
        """Reads the file again; whether it has another secret now."""
        if self._file is None:
            return False
        try:
            secret = _of_file(self._file)
        except ArgumentError:
            # It is about to be replaced: the server's own word says what is wrong.
            return False
        former, self._secret = self._secret, secret
        return former != secret

    def __repr__(self) -> str:
        return "Key(none)" if self._secret is None else "Key(...)"


def _given(secret: object) -> str | None:
    if secret is None or (isinstance(secret, str) and _can_be_sent(secret)):
        return secret
    raise ArgumentError("key", "something else", EXPECTED)


def _of_file(file: File) -> str:
    """The secret of a file. No error shows it, nor what a key that was given in the place of a path is."""
    # Bytes that are no characters are none of a secret either.
    secret = str(read_secret_file(file, "key_file", IN_FILE), "latin-1").strip()
    if not _can_be_sent(secret):
        lines = len(secret.splitlines())
        what = "nothing in it" if not secret else f"{lines} lines in it" if lines > 1 else "something else in it"
        raise ArgumentError("key_file", f"{shown_path(file)} with {what}", IN_FILE)
    return secret


def _can_be_sent(secret: str) -> bool:
    """Whether it can stand in a header."""
    return bool(secret) and secret.isascii() and secret.isprintable()
