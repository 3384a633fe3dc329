"""How far long work has come: told to a function, or shown by tqdm where it is installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from importlib import import_module
from types import TracebackType
from typing import Union

from .errors import ArgumentError, excerpt

Told = Callable[[int, "int | None"], None]
Progress = Union[Told, bool, None]
"""A function of bytes done and bytes in all (None where nobody knows); or True for a bar of tqdm, where it is installed."""


class _Raised(BaseException):
    """What a caller's function raised, on its way through this package.

    An error of its own kind would be told as one of the connection that it is called between.
    """

    def __init__(self, error: BaseException) -> None:
        super().__init__()
        self.error = error


class _Unchanged(AbstractContextManager[Told]):
    """Lets what a caller's function raised come out as it was."""

    def __init__(self, telling: AbstractContextManager[Told]) -> None:
        self._telling = telling

    def __enter__(self) -> Told:
        return self._telling.__enter__()

    def __exit__(self, kind: type[BaseException] | None, raised: BaseException | None, trace: TracebackType | None) -> None:
        self._telling.__exit__(kind, raised, trace)
        if not isinstance(raised, _Raised):
            return
        error, context = raised.error, raised.error.__context__
        try:
            raise error
        finally:
            # Raising it here makes the way that it came its context.
            error.__context__ = context


def checked_progress(progress: Progress) -> Progress:
    """A progress that can be told.

    Raises `ArgumentError` for everything else.
    """
    if progress is None or isinstance(progress, bool) or callable(progress):
        return progress
    raise ArgumentError("progress", excerpt(progress), "a function of done and total, True, or None")


def progress_of(progress: Progress, what: str, total: int | None) -> AbstractContextManager[Told]:
    """What to call as the work goes on. What a caller's function raises ends the work, and comes out of it unchanged."""
    return _Unchanged(_telling(progress, what, total))


@contextmanager
def _telling(progress: Progress, what: str, total: int | None) -> Iterator[Told]:
    if callable(progress):
        yield _guarded(progress)
    elif progress:
        with _bar(what, total) as told:
            yield _guarded(told)
    else:
        yield _silent


def _guarded(told: Told) -> Told:
    def call(done: int, total: int | None) -> None:
        try:
            told(done, total)
        except BaseException as error:
            raise _Raised(error) from None

    return call


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
