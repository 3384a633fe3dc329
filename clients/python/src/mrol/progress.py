"""How far long work has come: told to a function, or shown by tqdm where it is installed."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Union

from .errors import ArgumentError, excerpt

Told = Callable[[int, "int | None"], None]
Progress = Union[Told, bool, None]
"""A function of bytes done and bytes in all (None where nobody knows); or True for a bar of tqdm, where it is installed."""


@contextmanager
def progress_of(progress: Progress, what: str, total: int | None) -> Iterator[Told]:
    """What to call as the work goes on."""
    if progress is None or progress is False:
        yield _silent
    elif callable(progress):
        yield progress
    elif progress is True:
        with _bar(what, total) as told:
            yield told
    else:
        raise ArgumentError("progress", excerpt(progress), "a function of done and total, True, or None")


@contextmanager
def _bar(what: str, total: int | None) -> Iterator[Told]:
    try:
        tqdm = import_module("tqdm").tqdm
    except ImportError:
        yield _silent
        return
    with tqdm(total=total, desc=what, unit="B", unit_scale=True) as bar:

        def told(done: int, of: int | None) -> None:
            bar.total = of
            bar.update(done - bar.n)

        yield told


def _silent(_done: int, _total: int | None) -> None:
    return None
