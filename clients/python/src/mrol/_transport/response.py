"""An answer's status and headers, read strictly.

`http.client` reads headers by the parser of mails, which forgives much and takes as long as all the rest of a small answer. Here a
line is a name and a value, and what could be understood in two ways is refused. Bodies in chunks are read by `Chunks`, others by
`http.client`.
"""

from collections.abc import Callable
from http.client import BadStatusLine, HTTPException, HTTPResponse, LineTooLong, RemoteDisconnected
from typing import Any, cast

from ..errors import excerpt
from .chunks import Chunks

LINE_BYTES_MAX = 16 << 10
HEADERS_MAX = 100
LENGTH_DIGITS_MAX = 18

SWITCHED = 101
"""Behind this status comes another protocol, and no answer."""

Headers = dict[str, str]
"""Values by names in lower case."""


class Response(HTTPResponse):
    """What `http.client` makes for an answer, with another way to begin."""

    plain_headers: Headers
    _chunks: Chunks

    def begin(self) -> None:
        """Reads up to the body.

        Raises `HTTPException` for what is no answer.
        """
        status = self._status()
        while 100 <= status < 200 and status != SWITCHED:
            # It may say any number of times that it goes on, or what will come; the deadline bounds it.
            self._header_lines()
            status = self._status()
        headers = self._header_lines()
        self.status = self.code = status
        self.plain_headers = headers
        self.headers = self.msg = cast(Any, headers)
        self.chunked = headers.get("transfer-encoding", "").lower() == "chunked"
        self._chunks = Chunks(self.fp)
        self.length = _length(status, headers)
        self.will_close = self.version == 10 or headers.get("connection", "").lower() == "close"

    def read(self, amt: int | None = None) -> bytes:
        """Reads up to so many bytes of the body; less at its end."""
        if not self.chunked:
            return super().read(amt)
        assert amt is not None
        return b"" if self.fp is None else self._read_chunks(self._chunks.read, amt)

    def read1(self, n: int = -1) -> bytes:
        """Reads what has come of the body, once something has, so many bytes at most; nothing at its end."""
        if not self.chunked:
            return super().read1(n)
        return b"" if self.fp is None else self._read_chunks(self._chunks.read_some, n)

    def _read_chunks(self, read: Callable[[int], bytes], most: int) -> bytes:
        data = read(most)
        if self._chunks.has_ended:
            # Then http.client takes the next request.
            self.close()
        return data

    def _status(self) -> int:
        line = self._line()
        if not line:
            raise RemoteDisconnected("the server closed the connection without an answer")
        words = line.split(None, 2)
        if len(words) < 2 or words[0] not in (b"HTTP/1.1", b"HTTP/1.0") or len(words[1]) != 3 or not words[1].isdigit():
            raise BadStatusLine(excerpt(line))
        self.version = 11 if words[0] == b"HTTP/1.1" else 10
        self.reason = str(words[2], "latin-1").strip() if len(words) > 2 else ""
        return int(words[1])

    def _header_lines(self) -> Headers:
        headers: Headers = {}
        for _ in range(HEADERS_MAX + 1):
            line = self._line()
            if line in (b"\r\n", b"\n", b""):
                return headers
            name, colon, value = line.partition(b":")
            word = str(name, "latin-1").lower()
            if not colon or not word or word != word.strip():
                raise HTTPException(f"a header that is none: {excerpt(line)}")
            text = str(value, "latin-1").strip()
            # Two lengths are none.
            headers[word] = f"{headers[word]}, {text}" if word in headers else text
        raise HTTPException(f"more than {HEADERS_MAX} headers")

    def _line(self) -> bytes:
        line = self.fp.readline(LINE_BYTES_MAX + 1)
        if len(line) > LINE_BYTES_MAX:
            raise LineTooLong("header")
        return line


def _length(status: int, headers: Headers) -> int | None:
    """Bytes of the body, where they are told."""
    if status in (204, 304):
        return 0
    text = headers.get("content-length")
    if "transfer-encoding" in headers:
        if text is not None or headers["transfer-encoding"].lower() != "chunked":
            raise HTTPException("a body of another coding than chunked, or one with a length as well")
        return None
    if text is None:
        return None
    if not text.isascii() or not text.isdigit() or len(text) > LENGTH_DIGITS_MAX:
        raise HTTPException(f"a length that is none: {excerpt(text)}")
    return int(text)
