"""Questions about many elements: cut into requests that the server takes, and their answers joined."""

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._arrays import Shape
from .._transport.deadline import Deadline
from ..errors import DeadlineExceeded, InvalidArgument, ServerError
from ..version import InParts, Version

ELEMENTS_MAX = 2_000_000
"""Elements of a request, unless the server is set to another `points_per_request_max`."""

BYTES_MAX = 31 << 20
"""Bytes of the arrays of a request: what `message_bytes_max` leaves to them, unless the server is set to another."""

TOO_MUCH = ("batch_too_large", "body_too_large", "time_limit")
"""Reasons of refusals after which fewer elements may be taken."""

CUT_MIN = 16
"""Elements that are not cut further: then it is something else that is too much."""

Answer = TypeVar("Answer", bound=InParts)


@dataclass(frozen=True)
class Part:
    """What one request asks about: these of the elements, of the map with a uuid where there is one, until a moment."""

    of: slice
    map_uuid: str | None
    deadline: Deadline


def ask_in_parts(deadline: Deadline, count: int, array_bytes: int, shape: Shape, ask: Callable[[Part], Answer]) -> Answer:
    """The answer about so many elements, whose arrays take so many bytes together, in the shape in which they were given.

    `ask` answers about a part, in arrays with one axis for the elements; of no elements it is asked about the first, which stands
    in for them. One request is made where the server takes so many; of several each is of a revision of its own.
    """
    if count == 0:
        return shaped(beginning_of(ask(Part(slice(0, 1), None, deadline)), 0), shape)
    requests = max(-(-count // ELEMENTS_MAX), -(-array_bytes // BYTES_MAX))
    at_once = -(-count // requests)
    answers: list[Answer] = []
    begin = 0
    while begin < count:
        part = slice(begin, min(begin + at_once, count))
        try:
            answers.append(ask(Part(part, answers[0].map_uuid if answers else None, deadline)))
        except (InvalidArgument, DeadlineExceeded) as refused:
            if refused.reason not in TOO_MUCH or at_once <= CUT_MIN:
                raise _of_part(refused, begin) from None
            at_once = -(-at_once // 2)
        else:
            begin = part.stop
    return shaped(_joined(answers), shape)


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
    return replace(value, **{of.name: _mapped(getattr(value, of.name), of_array, of_number) for of in fields(value)})
