"""Questions about many elements: cut into parts that are taken at once, and their answers joined."""

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._arrays import Shape
from .._transport.deadline import Deadline
from ..errors import DeadlineExceeded, InvalidArgument, ServerError
from ..version import InParts, Version
from .scope import Scope

ELEMENTS_MAX = 2_000_000
"""Elements of a part, unless a server is set to another `points_per_request_max`."""

BYTES_MAX = 31 << 20
"""Bytes of the arrays of a part: what `message_bytes_max` of a server leaves to them, unless it is set to another."""

TOO_MUCH = ("batch_too_large", "body_too_large", "time_limit")
"""Reasons of refusals after which fewer elements may be taken."""

CUT_MIN = 16
"""Elements that are not cut further: then it is something else that is too much."""

Answer = TypeVar("Answer", bound=InParts)


Ask = Callable[[slice, Scope, "Deadline | None"], Answer]
"""Answers about some of the elements, by options of the question, until a moment: in arrays with one axis for the elements."""


def ask_in_parts(  # noqa: PLR0917 (a call by keywords takes longer)
    ask: Ask[Answer], scope: Scope, deadline: Deadline | None, count: int, array_bytes: int, shape: Shape
) -> Answer:
    """The answer about so many elements, whose arrays take so many bytes together, in the shape in which they were given.

    Of no elements it is asked about the first, which stands in for them. All are asked about at once where so many are taken; of
    several parts each is of a revision of its own, and of the map of the first.
    """
    if count == 0:
        return shaped(beginning_of(ask(slice(0, 1), scope, deadline), 0), shape)
    at_once = count
    if count > ELEMENTS_MAX or array_bytes > BYTES_MAX:
        at_once = -(-count // max(-(-count // ELEMENTS_MAX), -(-array_bytes // BYTES_MAX)))
    answers: list[Answer] = []
    begin = 0
    while begin < count:
        part = slice(begin, min(begin + at_once, count))
        try:
            answers.append(ask(part, scope, deadline))
        except (InvalidArgument, DeadlineExceeded) as refused:
            if refused.reason not in TOO_MUCH or at_once <= CUT_MIN:
                raise _of_part(refused, begin) from None
            at_once = -(-at_once // 2)
        else:
            if begin == 0 and part.stop < count:
                scope = {**scope, "map_uuid": answers[0].map_uuid}
            begin = part.stop
    answer = _joined(answers)
    return answer if shape == (count,) else shaped(answer, shape)


def _of_part(refused: ServerError, begin: int) -> ServerError:
    """The refusal of a part, which says where the part begins: elements are counted from there in it."""
    message = f"{refused.message}; counted from element {begin}, where a part of the question begins" if begin else refused.message
    return type(refused)(refused.status, refused.code, refused.reason, message, refused.retry_after_s)


def beginning_of(answer: Answer, count: int) -> Answer:
    """The beginning of an answer: that about so many elements, nothing of which is true."""
    beginning: Answer = _mapped(answer, lambda array: array[:count], lambda _: 0)
    return beginning


def _joined(answers: list[Answer]) -> Answer:
    """One answer of those about parts."""
    if len(answers) == 1:
        return answers[0]
    joined: Answer = _join(answers)
    return replace(joined, version_of_first=answers[0].version)


def _join(values: list[Any]) -> Any:
    last = values[-1]
    if isinstance(last, np.ndarray):
        array = np.concatenate(values)
        array.setflags(write=False)
        return array
    if isinstance(last, int):
        return sum(values)
    if last is None or isinstance(last, Version):
        return last
    assert is_dataclass(last)
    assert not isinstance(last, type)
    return replace(last, **{of.name: _join([getattr(value, of.name) for value in values]) for of in fields(last)})


def shaped(answer: Answer, shape: Shape) -> Answer:
    """The answer with the elements in the shape in which they were given."""
    shaped: Answer = _mapped(answer, lambda array: array.reshape((*shape, *array.shape[1:])), lambda number: number)
    return shaped


def _mapped(value: Any, of_array: Callable[[NDArray[Any]], NDArray[Any]], of_number: Callable[[int], int]) -> Any:
    if isinstance(value, np.ndarray):
        return of_array(value)
    if isinstance(value, int):
        return of_number(value)
    if value is None or isinstance(value, Version):
        return value
    assert is_dataclass(value)
    assert not isinstance(value, type)
    return type(value)(**{name: _mapped(of, of_array, of_number) for name, of in vars(value).items()})
