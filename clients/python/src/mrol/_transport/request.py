"""A request, and what is answered to it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol
from urllib.parse import quote, urlencode

JSON = "application/json"
BYTES = "application/octet-stream"

Parameter = str | int | float | bool | None


class Pieces(Protocol):
    """A body that is made while it is sent. It can be sent again, and each piece counts until the next one is asked for."""

    @property
    def nbytes(self) -> int:
        """Bytes of all pieces."""

    def __iter__(self) -> Iterator[bytes | memoryview]:
        """The pieces, from the first one."""


@dataclass(frozen=True)
class Request:
    """A request without its key.

    `is_repeatable` says that it may be sent again where it is not known whether the server got it: it changes nothing, or has an id
    by which the server knows it. `on_sent` is told how many bytes of the body were sent.
    """

    method: str
    target: str
    content_type: str | None = None
    body: Sequence[bytes | memoryview] | Pieces = ()
    accept: str | None = None
    is_repeatable: bool = True
    on_sent: Callable[[int], None] | None = None

    @property
    def body_bytes(self) -> int:
        """Bytes of the body."""
        if isinstance(self.body, Sequence):
            return sum(memoryview(piece).nbytes for piece in self.body)
        return self.body.nbytes


@dataclass(frozen=True)
class Answer:
    """A whole answer."""

    status: int
    headers: Mapping[str, str]
    body: memoryview = field(repr=False)

    def header(self, name: str) -> str | None:
        """The value of a header, whose name is in lower case."""
        return self.headers.get(name)


def path_of(*segments: str) -> str:
    """A path of segments, each escaped."""
    return "".join(f"/{quote(segment, safe='')}" for segment in segments)


def target_of(path: str, parameters: Mapping[str, Parameter]) -> str:
    """A path and parameters; those that are None are left out."""
    given = {name: _text(value) for name, value in parameters.items() if value is not None}
    return f"{path}?{urlencode(given, safe=',')}" if given else path


def _text(value: str | float | bool) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return value if isinstance(value, str) else repr(value)
