"""A map of a server by its name, and how requests to it are made."""

import json
from collections.abc import Mapping
from typing import Any, TypeVar

from .._arguments import word_of
from .._fields import Fields, fields_of
from .._revisions import Revisions
from .._sessions import Sessions
from .._transport.caller import Caller
from .._transport.request import BYTES, JSON, Answer, Parameter, Request, path_of, target_of
from ..questions.all import Questions
from ..version import Versioned
from .backend import ServerBackend

Of = TypeVar("Of", bound=Versioned)


class MapHandle(Questions):
    """What all operations on a map use, and the questions, which the server answers."""

    def __init__(self, caller: Caller, name: str, robot: str, sessions: Sessions, revisions: Revisions | None = None) -> None:
        self._caller = caller
        self._name = word_of(name, "name")
        self._robot = word_of(robot, "robot")
        self._sessions = sessions
        self._revisions = Revisions() if revisions is None else revisions
        self._server = ServerBackend(caller, self._name, self._revisions)
        self._backend = self._server

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

    def _noted(self, answer: Of) -> Of:
        """An answer, whose version is noted where there are several servers."""
        self._server.note(answer.version)
        return answer

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

    def _send_bytes(self, segment: str, pieces: list[memoryview], parameters: Mapping[str, Parameter]) -> Answer:
        return self._caller.call(Request("POST", self._target(segment, **parameters), BYTES, pieces))
