"""The secret that a caller shows."""

from os import PathLike, fspath

from ..errors import ArgumentError, excerpt


class Key:
    """A secret, or none; one of a file is read again when the server does not take it any more."""

    def __init__(self, secret: str | None, file: str | PathLike[str] | None) -> None:
        if secret is not None and file is not None:
            raise ArgumentError("key", "a key and a key_file", "one of the two")
        self._file = file
        self._secret = _checked(_read(file) if file is not None else secret)

    def headers(self) -> dict[str, str]:
        """The header that shows it."""
        return {} if self._secret is None else {"authorization": f"Bearer {self._secret}"}

    def renew(self) -> bool:
        """Reads the file again; whether it has another secret now."""
        if self._file is None:
            return False
        try:
            secret = _checked(_read(self._file))
        except ArgumentError:
            # It is about to be replaced: the server's own word says what is wrong.
            return False
        former, self._secret = self._secret, secret
        return former != secret

    def __repr__(self) -> str:
        return "Key(none)" if self._secret is None else "Key(...)"


def _checked(secret: str | None) -> str | None:
    """The secret, where it can stand in a header; an error does not show it."""
    if secret is None or (isinstance(secret, str) and secret.isascii() and secret.isprintable() and secret):
        return secret
    raise ArgumentError("key", "something else", "a secret as `mrol key new` prints it, in one line")


def _read(file: str | PathLike[str]) -> str:
    try:
        with open(file, encoding="ascii") as opened:
            return opened.read().strip()
    except (OSError, ValueError) as error:
        raise ArgumentError("key_file", f"{excerpt(fspath(file))}: {error}", "a file with a secret") from error
