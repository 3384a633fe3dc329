"""Where a server is."""

from dataclasses import dataclass
from urllib.parse import urlsplit

from ..errors import ArgumentError, excerpt

PORT = 7333
"""Where mrol serves HTTP unless it is told otherwise."""

EXPECTED = "host:port, http://host:port, https://host:port or unix:/path"


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
        if not isinstance(text, str):
            raise ArgumentError("address", excerpt(text), EXPECTED)
        if text.startswith("unix:"):
            path = text.removeprefix("unix:")
            path = path.removeprefix("//")
            if not path or "\0" in path:
                raise ArgumentError("address", excerpt(text), EXPECTED)
            return cls("localhost", 0, False, path)
        # Parsing an address drops ends of lines silently.
        if not text.isprintable() or " " in text:
            raise ArgumentError("address", excerpt(text), EXPECTED)
        has_scheme = "://" in text
        scheme = "https" if prefer_tls else "http"
        try:
            parts = urlsplit(text if has_scheme else f"{scheme}://{text}")
            port = parts.port
        except ValueError as error:
            raise ArgumentError("address", excerpt(text), EXPECTED) from error
        is_whole = parts.path in ("", "/") and not parts.query and not parts.fragment and not parts.username
        host = parts.hostname
        if parts.scheme not in ("http", "https") or not host or not is_whole:
            raise ArgumentError("address", excerpt(text), EXPECTED)
        return cls(host, PORT if port is None else port, parts.scheme == "https")

    @property
    def authority(self) -> str:
        """The value of the header `host`."""
        if self.socket_path is not None:
            return self.host
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}"

    def __str__(self) -> str:
        if self.socket_path is not None:
            return f"unix:{self.socket_path}"
        return f"{'https' if self.is_tls else 'http'}://{self.authority}"
