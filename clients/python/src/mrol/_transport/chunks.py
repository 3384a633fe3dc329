"""A body in chunks, read strictly.

`http.client` takes a chunk of -1 bytes, which it reads until memory ends, numbers as Python writes them, and any two bytes behind a
chunk.
"""

from http.client import HTTPException, IncompleteRead
from io import BufferedIOBase

from ..errors import excerpt

LINE_BYTES_MAX = 4096
SIZE_DIGITS_MAX = 15
TRAILERS_MAX = 100

HEX_DIGITS = frozenset(b"0123456789abcdefABCDEF")


class Chunks:
    """The bytes of a body in chunks.

    Its methods raise `IncompleteRead` where the connection ends before the body does, and `HTTPException` for what are no chunks.
    """

    def __init__(self, source: BufferedIOBase) -> None:
        self._source = source
        self._left = 0
        """Bytes of the present chunk that are left."""
        self.has_ended = False

    def read(self, count: int) -> bytes:
        """So many bytes; less at the end of the body."""
        pieces: list[bytes] = []
        while count > 0 and (wanted := min(count, self._available())):
            piece = self._exactly(wanted)
            self._take(wanted)
            pieces.append(piece)
            count -= wanted
        return b"".join(pieces)

    def read_some(self, most: int) -> bytes:
        """What has come, once something has, so many bytes at most; nothing at the end of the body."""
        wanted = min(most, self._available())
        if wanted == 0:
            return b""
        piece = self._source.read1(wanted)
        if not piece:
            raise IncompleteRead(b"")
        self._take(len(piece))
        return piece

    def _available(self) -> int:
        """Bytes that are left of a chunk; 0 at the end of the body."""
        if self._left == 0 and not self.has_ended:
            self._left = self._size()
            if self._left == 0:
                self._skip_trailers()
                self.has_ended = True
        return self._left

    def _take(self, count: int) -> None:
        self._left -= count
        if self._left == 0 and self._exactly(2) != b"\r\n":
            raise HTTPException("a chunk that goes on behind its end")

    def _size(self) -> int:
        line = self._line()
        digits = line.partition(b";")[0].rstrip(b" \t")
        if not 0 < len(digits) <= SIZE_DIGITS_MAX or not HEX_DIGITS.issuperset(digits):
            raise HTTPException(f"a chunk whose size is none: {excerpt(line)}")
        return int(digits, 16)

    def _skip_trailers(self) -> None:
        for _ in range(TRAILERS_MAX + 1):
            if not self._line():
                return
        raise HTTPException(f"more than {TRAILERS_MAX} lines behind the last chunk")

    def _line(self) -> bytes:
        """A line, without its end."""
        line = self._source.readline(LINE_BYTES_MAX + 1)
        if line.endswith(b"\r\n"):
            return line[:-2]
        if len(line) > LINE_BYTES_MAX or line.endswith(b"\n"):
            raise HTTPException(f"a line between chunks that is none: {excerpt(line)}")
        raise IncompleteRead(b"")

    def _exactly(self, count: int) -> bytes:
        data = self._source.read(count)
        if len(data) < count:
            raise IncompleteRead(b"", count - len(data))
        return data
