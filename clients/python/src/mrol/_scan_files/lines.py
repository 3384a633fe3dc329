"""Lines of a file, whatever ends them."""

import re
from collections.abc import Callable, Iterable, Iterator

from .problem import Problem

SPACES = b" \t\n\x0c\r"
"""What divides words; a vertical tab does not."""

_END = re.compile(rb"[\r\n]")
_UTF8_MARK = b"\xef\xbb\xbf"
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_COMMENT_MARKS = (b"#", b"//", b"%")
_WORD = re.compile(r"[^ \t\n\x0c\r]+")

Line = tuple[int, bytes]
"""A line's number, counted from 1, and what it has between its spaces."""


class Lines:
    """The lines of a file with their numbers. Each ends with LF, CR LF or, as the line before it, CR alone."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = len(_UTF8_MARK) if data.startswith(_UTF8_MARK) else 0
        self._number = 0
        self.ends_with_cr = False

    def copy(self) -> "Lines":
        """The same lines from here on, taken apart from these."""
        copied = Lines(self._data)
        copied.go_back_to(self)
        return copied

    def go_back_to(self, before: "Lines") -> None:
        """Goes on with the line that comes next in a copy that was taken before."""
        self._at, self._number, self.ends_with_cr = before._at, before._number, before.ends_with_cr  # noqa: SLF001

    @property
    def at(self) -> int:
        """Bytes of the file that were taken."""
        return self._at

    @property
    def left(self) -> int:
        """Bytes that were not taken."""
        return len(self._data) - self._at

    def rest(self) -> bytes:
        """The bytes after the lines that were taken."""
        return self._data[self._at :]

    def __iter__(self) -> Iterator[Line]:
        while self._at < len(self._data):
            yield self._next()

    def _next(self) -> Line:
        end = _END.search(self._data, self._at)
        if end is None:
            line, self._at = self._data[self._at :], len(self._data)
        else:
            place = end.start()
            line = self._data[self._at : place]
            is_cr = self._data[place] == 0x0D
            if is_cr and not self.ends_with_cr and self._data[place + 1 : place + 2] == b"\n":
                self._at = place + 2
            else:
                # Data may begin with the byte of a line feed, where a header ends its lines with CR.
                self.ends_with_cr |= is_cr
                self._at = place + 1
        self._number += 1
        return self._number, line.strip(SPACES)


def text_of(line: bytes) -> str:
    """A line's text; characters that are not UTF-8, as in the comments of older programs, are replaced."""
    return line.decode("utf-8", "replace")


def words_of(text: str) -> list[str]:
    """The words of a line."""
    return _WORD.findall(text)


def comment(line: bytes) -> bytes | None:
    """A line without the mark of a comment; None of a line that is none."""
    mark = next((mark for mark in _COMMENT_MARKS if line.startswith(mark)), None)
    return None if mark is None else line[len(mark) :]


def is_content(line: bytes) -> bool:
    """Whether a line is neither blank nor a comment."""
    return bool(line) and comment(line) is None


def content(lines: Lines) -> Iterator[tuple[int, str]]:
    """Those lines that are neither blank nor a comment, as text."""
    return ((number, text_of(line)) for number, line in lines if is_content(line))


def read_each(lines: Iterable[tuple[int, str]], read: Callable[[str], list[float]]) -> list[list[float]]:
    """What is read of each line; a problem is that of its line."""

    def of_line(number: int, text: str) -> list[float]:
        try:
            return read(text)
        except Problem as problem:
            raise Problem(problem.text, number) from None

    return [of_line(number, text) for number, text in lines]


def check_text(data: bytes) -> None:
    """Refuses a file of text in another encoding."""
    if data.startswith(_UTF16_MARKS):
        raise Problem("UTF-16 text: save the file as UTF-8", 1)
