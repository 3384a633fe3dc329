"""Lists of options in docstrings: what several methods take is described once."""

import inspect
from collections.abc import Callable, Mapping
from textwrap import fill
from typing import Any, TypeVar

Method = TypeVar("Method", bound=Callable[..., Any])

WIDTH = 120
"""Columns of what is added to a docstring."""


def append_options(method: Callable[..., Any], title: str, descriptions: Mapping[str, str]) -> None:
    """Adds a list of options, each with its description, to a method's docstring."""
    described = [f"`{name}`: {description}" for name, description in descriptions.items()]
    lines = [fill(text, WIDTH, initial_indent=8 * " ", subsequent_indent=12 * " ") for text in described]
    method.__doc__ = "\n".join([f"{(method.__doc__ or '').rstrip()}\n\n        {title}\n", *lines, 8 * " "])


def documents(descriptions: Mapping[str, str]) -> Callable[[Method], Method]:
    """Tells `help` of those of these options that a method has, in the order of its signature."""

    def documented(method: Method) -> Method:
        own = {name: descriptions[name] for name in inspect.signature(method).parameters if name in descriptions}
        append_options(method, "Options:", own)
        return method

    return documented
