"""Arguments that are no arrays: levels, flags, names, words of a choice."""

from collections.abc import Sequence

from ._arrays import whole_of
from .errors import ArgumentError, excerpt

LEVEL_MAX = 31
"""The coarsest level of any map."""


def level_of(value: object, argument: str = "level") -> int:
    """A level; how many the map has is not known here."""
    return whole_of(value, argument, 0, LEVEL_MAX)


def flag_of(value: object, argument: str) -> bool:
    """True or False: what merely counts as true may be another argument in the wrong place."""
    if not isinstance(value, bool):
        raise ArgumentError(argument, excerpt(value), "True or False")
    return value


def choice_of(value: object, argument: str, choices: Sequence[str]) -> str:
    """One of some words."""
    if not isinstance(value, str) or value not in choices:
        raise ArgumentError(argument, excerpt(value), " or ".join(map(repr, choices)))
    return value


def word_of(value: object, argument: str) -> str:
    """A name; the server knows its rules. An empty one, or one that is a path, would name another resource."""
    word = text_of(value, argument, "a name")
    if word in ("", ".", ".."):
        raise ArgumentError(argument, excerpt(value), "a name")
    return word


def text_of(value: object, argument: str, expected: str = "text") -> str:
    """Text that can be sent."""
    if not isinstance(value, str):
        raise ArgumentError(argument, excerpt(value), expected)
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise ArgumentError(argument, excerpt(value), expected) from error
    return value
