"""Questions that a server answers, over HTTP."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from .._arrays import F32, Bools, numbers_text, raw
from .._bits import unpacked
from .._fields import reading
from .._question import QuestionAnswer, body_of_question
from .._revisions import Revisions
from .._transport.caller import Caller
from .._transport.deadline import Deadline
from .._transport.request import BYTES, Answer, Parameter, Request, path_of, target_of
from ..body import Body
from ..errors import FailedPrecondition
from ..questions.backend import Backend, PointQuery
from ..questions.scope import Scope
from ..version import Version, whole_header

Of = TypeVar("Of")


class ServerBackend(Backend):
    """A map of a server, which answers questions in the form for programs."""

    def __init__(self, caller: Caller, name: str, revisions: Revisions) -> None:
        self._caller = caller
        self._name = name
        self._revisions = revisions
        self._path = path_of("v1", "maps", name)
        self.bytes_max = caller.bounds.request_bytes_max

    def query(self, points: F32, how: PointQuery, scope: Scope, deadline: "Deadline | None") -> tuple[Version, Bools, int]:
        """Asks with points as they are, and is answered by bits and headers."""
        return self.in_order(lambda scope, until: self._query(points, how, scope, until), lambda answer: answer[0], scope, deadline)

    def _query(self, points: F32, how: PointQuery, scope: Scope, deadline: "Deadline | None") -> tuple[Version, Bools, int]:
        map_from_points, lookup, keep_out = how
        parameters: dict[str, Parameter] = {
            "pose": None if map_from_points is None else numbers_text(map_from_points),
            # What stands at its default is not sent: a short query is mostly its address.
            "lookup": None if lookup == "exact" else lookup,
            "keep_out": keep_out or None,
            **scope,
        }
        answer = self._post("occupancy", parameters, [raw(points)], deadline)
        with reading("the answer"):
            if whole_header(answer, "mrol-points") != len(points):
                raise ValueError("it is of another number of points")
            count = whole_header(answer, "mrol-points-occupied")
            return Version.of_headers(answer), unpacked(answer.body, len(points), count), count

    def ask(self, question: str, fields: Mapping[str, Any], scope: Scope, deadline: "Deadline | None" = None) -> QuestionAnswer:
        """Asks with a head in JSON and arrays behind it."""
        return self.in_order(
            lambda scope, until: self._ask(question, fields, scope, until), lambda answer: answer.version, scope, deadline
        )

    def _ask(self, question: str, fields: Mapping[str, Any], scope: Scope, deadline: "Deadline | None") -> QuestionAnswer:
        body = body_of_question({**fields, **scope})
        return QuestionAnswer(self._post(question, {}, body, deadline).body)

    def in_order(
        self,
        ask: "Callable[[Scope, Deadline | None], Of]",
        version_of: Callable[[Of], Version],
        scope: Scope,
        deadline: "Deadline | None",
    ) -> Of:
        """The answer to a question: of several servers, one that is as far as any of them has told."""
        if not self._caller.has_several:
            return ask(scope, deadline)
        until = self.deadline() if deadline is None else deadline
        raised = self._revisions.raised(self._name, scope)
        try:
            answer = ask(raised, until)
        except FailedPrecondition as refused:
            if refused.reason != "map_replaced" or raised.get("map_uuid") == scope.get("map_uuid"):
                raise
            # The caller did not ask for that map: the name is that of another one now.
            self._revisions.forget(self._name, raised["map_uuid"])
            answer = ask(scope, until)
        self.note(version_of(answer))
        return answer

    def note(self, version: Version) -> None:
        """Notes the version that an answer told, where there are several servers."""
        if self._caller.has_several:
            self._revisions.note(self._name, version)

    def body_of(self, body: Body) -> dict[str, Any]:
        """A body as the head of a question has it."""
        return body.fields(self.bytes_max)

    def deadline(self) -> Deadline:
        """The time of one call."""
        return Deadline(self._caller.bounds.timeout_s)

    def _post(
        self, question: str, parameters: Mapping[str, Parameter], body: "list[bytes | memoryview]", deadline: "Deadline | None"
    ) -> Answer:
        request = Request("POST", target_of(f"{self._path}/{question}", parameters), BYTES, body)
        return self._caller.call(request, deadline)
