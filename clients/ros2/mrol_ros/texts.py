"""Texts of others as they may be logged and sent."""

from __future__ import annotations

TEXT_MAX = 500
"""Characters of a text that are shown."""


def shown(text: str, most: int = TEXT_MAX) -> str:
    """A text in one line of printable characters, cut where it is long."""
    line = "".join(of if of.isprintable() else " " for of in text[:most])
    return line if len(text) <= most else f"{line}..."
