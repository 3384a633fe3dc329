"""Questions that this process answers, by the extension."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._arrays import F32, Bools
from .._fields import Fields
from .._transport.deadline import Deadline
from ..body import Body
from ..questions.backend import I32, I64, Answer, Backend, Names, PointQuery
from ..questions.scope import Scope
from ..version import Version
from .body import BYTES_MAX, PreparedBody
from .native import mrol_native

Told = tuple[int, str, "int | None"]
"""A version as the extension tells it: the revision, the uuid, and the hash of the voxels."""


class NativeAnswer(Answer):
    """An answer of the extension, whose arrays have their shapes."""

    def __init__(self, told: dict[str, Any], version: Version) -> None:
        super().__init__(Fields(told), version)
        self._arrays = told

    def bits(self, name: str, count: int, set_bits: "int | None" = None) -> Bools:
        """The booleans that it made."""
        array: Bools = self._arrays[name]
        return array

    def floats(self, name: str, count: int, *columns: int) -> F32:
        """The floats that it made."""
        array: F32 = self._arrays[name]
        return array

    def finite(self, name: str, count: int) -> F32:
        """The floats that it made, NaN where there is none."""
        return self.floats(name, count)

    def numbers(self, name: str, count: int) -> I64:
        """The numbers that it made, -1 where there is none."""
        array: I64 = self._arrays[name]
        return array

    def voxels(self, name: str, count: int) -> I32:
        """The indices that it made."""
        array: I32 = self._arrays[name]
        return array

    def names(self, name: str, count: int) -> Names:
        """Its list of names and None as an array."""
        found: Names = np.full(count, None, object)
        names = self._arrays[name]
        if names is not None:
            found[:] = names
        return found


class NativeBackend(Backend):
    """A map inside this process."""

    bytes_max = BYTES_MAX

    def __init__(self, native: mrol_native.NativeMap) -> None:
        self._native = native
        self._last: tuple[Told, Version] | None = None

    def query(self, points: F32, how: PointQuery, scope: Scope, deadline: "Deadline | None") -> tuple[Version, Bools, int]:
        """Asks with points where they are."""
        version, occupied, count = self._native.query(points, *how, scope or None)
        return self._version_of(version), occupied, count

    def ask(self, question: str, fields: Mapping[str, Any], scope: Scope, deadline: "Deadline | None" = None) -> NativeAnswer:
        """Asks the method of the question's name, whose arguments are the fields."""
        told = getattr(self._native, question)(scope or None, **fields)
        return NativeAnswer(told, self._version_of(told["version"]))

    def body_of(self, body: Body) -> PreparedBody:
        """A body that the extension has made."""
        return body if isinstance(body, PreparedBody) else PreparedBody(body)

    def deadline(self) -> None:
        """Nothing is waited for."""
        return

    def _version_of(self, told: Told) -> Version:
        """The version that an answer tells: most often that of the answer before, and making one takes as long as many look-ups."""
        last = self._last
        if last is None or last[0] != told:
            last = self._last = told, Version(*told)
        return last[1]
