"""Named parts of space where no robot may go."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timezone

from numpy.typing import ArrayLike

from .._arguments import word_of
from .._arrays import whole_of
from .._fields import Fields, fields_of
from .._sessions import new_request_id
from .._transport.request import Request
from ..errors import ArgumentError, MrolError, excerpt, is_outcome_unknown
from ..shapes import KINDS, BoxLike, OrientedBox, Prism, Shape, Sphere, shape_in, shape_json, shape_of
from ..version import Version, Versioned
from .handle import MapHandle

EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


@dataclass(frozen=True, eq=False)
class KeepOut:
    """A named part of space that questions of planners count as occupied."""

    name: str
    shape: Shape
    made_revision: int
    made_by: str | None
    """The name of the key that it was made with."""
    expires_at_ns: int | None
    """When the server ends it, nanoseconds since 1970."""


@dataclass(frozen=True, eq=False)
class KeepOuts(Versioned):
    """All keep-outs of a map, by name."""

    keep_outs: tuple[KeepOut, ...]


@dataclass(frozen=True, eq=False)
class KeepOutChange(Versioned):
    """What putting or removing a keep-out made."""

    replayed: bool


class KeepOutOperations(MapHandle):
    """Keep-outs."""

    def keep_out(
        self,
        name: str,
        *,
        box: BoxLike | None = None,
        sphere: Sphere | tuple[ArrayLike, float] | None = None,
        oriented_box: OrientedBox | None = None,
        prism: Prism | None = None,
        expires_at: datetime | int | None = None,
        request_id: str | None = None,
    ) -> KeepOutChange:
        """Puts a keep-out in the map, in the place of the one of its `name`.

        Give one shape, in the map frame, meters: a `box` (a `Box` or its two corners), a `sphere` (a `Sphere` or its center and
        radius), an `oriented_box` or a `prism`. `request_id` is a name by which the server knows the change if it is sent twice;
        the package gives one. `expires_at` is a time with a zone, or nanoseconds since 1970, after which the server ends it.

        Raises `InvalidArgument` (`bad_keep_out`, `bad_expiry`), `ResourceExhausted` (`too_many_keep_outs`).
        """
        shapes = {"box": box, "sphere": sphere, "oriented_box": oriented_box, "prism": prism}
        given = {argument: shape for argument, shape in shapes.items() if shape is not None}
        if len(given) != 1:
            raise ArgumentError("the shape", " and ".join(given) or "nothing", "exactly one of box, sphere, oriented_box and prism")
        ((argument, value),) = given.items()
        shape = shape_json(shape_of(value, argument), argument, (KINDS[argument],))
        identity = {"request_id": new_request_id() if request_id is None else word_of(request_id, "request_id")}
        expiry = {"expires_at_ns": None if expires_at is None else _nanoseconds(expires_at)}
        try:
            fields = self._send_json("PUT", ("keep-outs", word_of(name, "name")), {**shape, **expiry, **identity})
        except MrolError as error:
            if is_outcome_unknown(error):
                error.repeat_with = identity
            raise
        return self._noted(KeepOutChange(Version.of(fields), fields.flag("replayed")))

    def remove_keep_out(self, name: str, *, request_id: str | None = None) -> KeepOutChange:
        """Removes the keep-out of a `name`; `request_id` is as of `keep_out`.

        Raises `NotFound` (`keep_out_not_found`).
        """
        identity = {"request_id": new_request_id() if request_id is None else word_of(request_id, "request_id")}
        target = self._target("keep-outs", word_of(name, "name"), **identity)
        try:
            fields = fields_of(self._caller.call(Request("DELETE", target)).body)
        except MrolError as error:
            if is_outcome_unknown(error):
                error.repeat_with = identity
            raise
        return self._noted(KeepOutChange(Version.of(fields), fields.flag("replayed")))

    def keep_outs(self) -> KeepOuts:
        """All keep-outs of the map."""
        fields = self._get_fields("keep-outs")
        return self._noted(KeepOuts(Version.of(fields), tuple(_keep_out(of) for of in fields.objects("keep_outs"))))


def _keep_out(fields: Fields) -> KeepOut:
    return KeepOut(
        name=fields.text("name"),
        shape=shape_in(fields),
        made_revision=fields.whole("made_revision"),
        made_by=fields.optional("made_by", fields.text),
        expires_at_ns=fields.optional("expires_at_ns", fields.whole),
    )


def _nanoseconds(moment: datetime | int) -> int:
    if not isinstance(moment, datetime):
        return _in_range(moment)
    if moment.tzinfo is None:
        raise ArgumentError("expires_at", excerpt(moment), "a time with a zone: datetime.now(timezone.utc) + ...")
    since = moment - EPOCH
    return _in_range(((since.days * 86_400 + since.seconds) * 1_000_000 + since.microseconds) * 1000)


def _in_range(nanoseconds: object) -> int:
    return whole_of(nanoseconds, "expires_at", -(1 << 63), (1 << 63) - 1)
