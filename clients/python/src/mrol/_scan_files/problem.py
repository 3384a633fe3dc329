"""What is wrong with the content of a scan file, before the file's name is known."""

QUOTE_MAX = 80
"""Characters of a file that a message repeats: a hostile file writes no gigabyte into a log."""

_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t", "\0": "\\0"}


class Problem(Exception):
    """A problem of the content, of a line where it has one, counted from 1."""

    def __init__(self, text: str, line: int | None = None) -> None:
        super().__init__(text)
        self.text = text
        self.line = line


def quoted(text: str) -> str:
    """A text in quotes, shortened."""
    shown = "".join(_ESCAPES.get(c, c if c.isprintable() else f"\\u{{{ord(c):x}}}") for c in text[:QUOTE_MAX])
    return f'"{shown}"' + ("..." if len(text) > QUOTE_MAX else "")
