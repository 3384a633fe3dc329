"""The secret that a caller shows."""

from contextlib import suppress

from .._files import File, read_secret_file, shown_path
from .._secrets import remember
from ..errors import ArgumentError

EXPECTED = "a secret as `mrol key new` prints it, in one line"
IN_FILE = "the path of a regular file with a secret as `mrol key new` prints it, in one line"


class Secret:
    """What a request shows: a secret, or nothing. It can be told from others, and shows itself nowhere else."""

    __slots__ = ("_text",)

    def __init__(self, text: str | None) -> None:
        self._text = text
        if text is not None:
            remember(text)

    def header(self) -> str | None:
        """The value of the header that shows it."""
        return None if self._text is None else f"Bearer {self._text}"

    def is_same(self, other: "Secret") -> bool:
        """Whether a request with the other one shows the same."""
        return self.header() == other.header()

    def __repr__(self) -> str:
        return "Secret(none)" if self._text is None else "Secret(...)"


class Key:
    """A secret, or none; one of a file is read again when the server does not take it any more."""

    def __init__(self, secret: str | None, file: File | None) -> None:
        if secret is not None and file is not None:
            raise ArgumentError("key", "a key and a key_file", "one of the two")
        self._file = file
        self._secret = Secret(_of_file(file) if file is not None else _given(secret))

    def secret(self) -> Secret:
        """What a request shows now."""
        return self._secret

    def renew(self, refused: Secret) -> bool:
        """Reads the file again; whether there is another secret now than the one that was refused.

        Other threads may have been refused as well, and one of them may have read the new one already.
        """
        if self._file is None:
            return False
        # Where it cannot be read it is about to be replaced: the server's own word says what is wrong.
        with suppress(ArgumentError):
            self._secret = Secret(_of_file(self._file))
        return not self._secret.is_same(refused)

    def __repr__(self) -> str:
        return "Key(none)" if self._secret.header() is None else "Key(...)"


def _given(secret: object) -> str | None:
    """The secret that is given, without the end of the line of a file that it was read from."""
    if secret is None:
        return None
    if isinstance(secret, str) and _can_be_sent(secret.rstrip("\r\n")):
        return secret.rstrip("\r\n")
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
