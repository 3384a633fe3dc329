"""Where a server is."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from urllib.parse import urlsplit

from .._files import shown_path
from ..errors import ArgumentError

PORT = 7333
"""Where mrol serves HTTP unless it is told otherwise."""

_HOST = re.compile(r"[\w.-]+|[\da-f:.]+(%[\w.-]+)?")
"""A name, or a number of IPv6, which may have a zone."""

EXPECTED = "host:port, http://host:port, https://host:port or unix:/path"

_SEPARATOR = re.compile(r"\s*,\s*")
_BEHIND_PATH = re.compile(r"\s*,\s*(?=https?://|unix:)")
"""What separates the path of a socket, which may have commas, from the next address."""


@dataclass(frozen=True)
class Address:
    """A host and a port, or the path of a Unix socket."""

    host: str
    port: int
    is_tls: bool
    socket_path: str | None = None

    @classmethod
    def parse(cls, text: str, prefer_tls: bool = False) -> "Address":
        """The address that a text names; without a scheme it is https where `prefer_tls` is true."""
        found = _parsed(text, prefer_tls) if isinstance(text, str) else None
        if found is None:
            # Here no exception has a part of the address in it any more, which may be a key or have a password in it.
            raise ArgumentError("address", _kind_of(text), EXPECTED)
        return found

    @classmethod
    def parse_all(cls, given: "str | Sequence[str]", prefer_tls: bool = False) -> "tuple[Address, ...]":
        """The addresses of a list, or of a text in which commas separate them; each counts once."""
        texts = texts_of(given) if isinstance(given, str) else given
        if not isinstance(texts, list | tuple) or not texts:
            raise ArgumentError("address", _kind_of(given), f"{EXPECTED}, or a list of them")
        return tuple(dict.fromkeys(cls.parse(text, prefer_tls) for text in texts))

    @property
    def authority(self) -> str:
        """The value of the header `host`."""
        if self.socket_path is not None:
            return self.host
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}"

    @property
    def shown(self) -> str:
        """The address as a message shows it: without a path that names nothing, which may be a key in the wrong place."""
        return str(self) if self.socket_path is None else f"unix:{shown_path(self.socket_path)}"

    def __str__(self) -> str:
        if self.socket_path is not None:
            return f"unix:{self.socket_path}"
        return f"{'https' if self.is_tls else 'http'}://{self.authority}"


def texts_of(given: str) -> list[str]:
    """The addresses in a text, which commas separate; a path of a socket may have commas, too."""
    return list(_texts(given))


def _texts(given: str) -> Iterator[str]:
    rest: str | None = given
    while rest is not None:
        separator = _BEHIND_PATH if rest.lstrip().startswith("unix:") else _SEPARATOR
        parts = separator.split(rest, 1)
        # One address alone is as it is, spaces and all.
        yield given if parts[0] == given else parts[0].strip()
        rest = parts[1] if len(parts) > 1 else None


def _kind_of(address: object) -> str:
    return "something else" if isinstance(address, str) else f"an object of {type(address).__name__}"


def _parsed(text: str, prefer_tls: bool) -> Address | None:
    if text.startswith("unix:"):
        path = text.removeprefix("unix:").removeprefix("//")
        return Address("localhost", 0, False, path) if path and "\0" not in path else None
    # Parsing an address drops ends of lines silently.
    if not text.isprintable() or " " in text:
        return None
    scheme = "https" if prefer_tls else "http"
    try:
        parts = urlsplit(text if "://" in text else f"{scheme}://{text}")
        port, host = parts.port, parts.hostname
    except ValueError:
        return None
    is_whole = parts.path in ("", "/") and not parts.query and not parts.fragment and "@" not in parts.netloc
    if parts.scheme not in ("http", "https") or not host or not is_whole or not _HOST.fullmatch(host):
        return None
    return Address(host, PORT if port is None else port, parts.scheme == "https")
