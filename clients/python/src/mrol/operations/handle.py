"""A map of a server by its name, and how requests to it are made."""

import json
from collections.abc import Callable, Mapping
from typing import Any

from .._arrays import Shape, whole_of
from .._fields import Fields, fields_of
from .._question import Arrays, QuestionAnswer
from .._sessions import Sessions
from .._transport.caller import Caller
from .._transport.deadline import Deadline
from .._transport.request import BYTES, JSON, Answer, Parameter, Request, path_of, target_of
from ..errors import ArgumentError, excerpt
from .parts import Answer as OfParts
from .parts import Part, ask_in_parts


class MapHandle:
    """What all operations on a map use."""

    def __init__(self, caller: Caller, name: str, robot: str, sessions: Sessions) -> None:
        self._caller = caller
        self._name = word_of(name, "name")
        self._robot = word_of(robot, "robot")
        self._sessions = sessions

    @property
    def name(self) -> str:
        """The map's name."""
        return self._name

    @property
    def robot(self) -> str:
        """The robot in whose name scans are sent where none is given."""
        return self._robot

    @property
    def _request_bytes_max(self) -> int:
        return self._caller.bounds.request_bytes_max

    def _target(self, *segments: str, **parameters: Parameter) -> str:
        return target_of(path_of("v1", "maps", self._name, *segments), parameters)

    def _get(self, *segments: str, **parameters: Parameter) -> Answer:
        return self._caller.call(Request("GET", self._target(*segments, **parameters)))

    def _get_fields(self, *segments: str, **parameters: Parameter) -> Fields:
        return fields_of(self._get(*segments, **parameters).body)

    def _send_json(self, method: str, segments: tuple[str, ...], body: Mapping[str, Any]) -> Fields:
        given = {name: value for name, value in body.items() if value is not None}
        request = Request(method, self._target(*segments), JSON, [json.dumps(given, allow_nan=False).encode()])
        return fields_of(self._caller.call(request).body)

    def _send_bytes(
        self, segment: str, pieces: list[memoryview], parameters: Mapping[str, Parameter], part: Part | None = None
    ) -> Answer:
        given = {**parameters, **_of_part(part)}
        request = Request("POST", self._target(segment, **given), BYTES, pieces)
        return self._caller.call(request, None if part is None else part.deadline)

    def _ask(self, question: str, head: Mapping[str, Any], arrays: Arrays, part: Part | None = None) -> QuestionAnswer:
        given = {name: value for name, value in {**head, **_of_part(part)}.items() if value is not None}
        request = Request("POST", self._target(question), BYTES, arrays.body_of(given))
        return QuestionAnswer(self._caller.call(request, None if part is None else part.deadline).body)

    def _in_parts(self, count: int, array_bytes: int, shape: Shape, ask: Callable[[Part], OfParts]) -> OfParts:
        """Asks about any number of elements, all of it within the time of one call: see `ask_in_parts`."""
        return ask_in_parts(Deadline(self._caller.bounds.timeout_s), count, array_bytes, shape, ask)


def _of_part(part: Part | None) -> dict[str, str]:
    """What makes sure that all parts are of one map."""
    return {} if part is None or part.map_uuid is None else {"map_uuid": part.map_uuid}


def asked(level: int, ignore_keep_outs: bool, min_revision: int | None, map_uuid: str | None) -> dict[str, Any]:
    """What all planners' questions have in common."""
    return {
        "level": level_of(level),
        "ignore_keep_outs": flag_of(ignore_keep_outs, "ignore_keep_outs"),
        "min_revision": None if min_revision is None else whole_of(min_revision, "min_revision"),
        "map_uuid": None if map_uuid is None else word_of(map_uuid, "map_uuid"),
    }


def level_of(level: object, argument: str = "level") -> int:
    """A level; the server knows how many the map has."""
    return whole_of(level, argument, 0, 31)


def flag_of(value: object, argument: str) -> bool:
    """True or False: what merely counts as true may be another argument in the wrong place."""
    if not isinstance(value, bool):
        raise ArgumentError(argument, excerpt(value), "True or False")
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
