"""Scans and deletions taken back."""

from dataclasses import dataclass
from typing import Any

from .._arguments import text_of, word_of
from .._arrays import whole_of
from .._sessions import new_request_id
from ..errors import ArgumentError, MrolError, excerpt, is_outcome_unknown
from ..version import Version, Versioned
from .deletions import Deletion
from .handle import MapHandle
from .scans import ScanAnswer


@dataclass(frozen=True, eq=False)
class Undo(Versioned):
    """What an undo took back."""

    scans: int
    deletions: int
    removed: int
    """Voxels of level 0 that went."""
    restored: int
    """Voxels of level 0 that came back."""
    replayed: bool
    """Whether it was done before under its id; this is that answer."""


class UndoOperations(MapHandle):
    """Undo."""

    def undo(
        self,
        change: ScanAnswer | Deletion | None = None,
        *,
        robot: str | None = None,
        session: str | None = None,
        scan_id: int | None = None,
        since_revision: int | None = None,
        revision: int | None = None,
        request_id: str | None = None,
    ) -> Undo:
        """Takes a scan, a deletion, or all scans of a robot since a revision back: the map is then as if they had never come.

        Give as `change` what `insert` or `delete` answered; or `robot`, `session` and `scan_id`; or `robot` and `since_revision`;
        or the `revision` that the change made. `request_id` is a name by which the server knows the undo if it is sent twice; the
        package gives one. It takes a server with a data folder, and reaches back to `storage.undo_from_revision`.

        Raises `NotFound` (`scan_not_found`, `robot_not_found`), `FailedPrecondition` (`outside_undo_window`, `not_undoable`,
        `no_journal`).
        """
        target = {
            "robot": None if robot is None else word_of(robot, "robot"),
            "session": None if session is None else text_of(session, "session"),
            "scan_id": None if scan_id is None else whole_of(scan_id, "scan_id"),
            "since_revision": None if since_revision is None else whole_of(since_revision, "since_revision"),
            "revision": None if revision is None else whole_of(revision, "revision"),
        }
        if change is not None:
            if any(value is not None for value in target.values()):
                raise ArgumentError("change", "a change and more", "the only argument, beside request_id")
            target = _target_of(change)
        identity = {"request_id": new_request_id() if request_id is None else word_of(request_id, "request_id")}
        try:
            fields = self._send_json("POST", ("undo",), {**target, **identity})
        except MrolError as error:
            if is_outcome_unknown(error):
                error.repeat_with = identity
            raise
        done = Undo(
            Version.of(fields),
            fields.whole("scans"),
            fields.whole("deletions"),
            fields.whole("removed"),
            fields.whole("restored"),
            fields.flag("replayed"),
        )
        return self._noted(done)


def _target_of(change: object) -> dict[str, Any]:
    if isinstance(change, ScanAnswer) and change.scan_id is not None:
        return {"robot": change.robot, "session": change.session, "scan_id": change.scan_id}
    if isinstance(change, Deletion):
        return {"revision": change.revision}
    raise ArgumentError("change", excerpt(change), "what insert or delete answered")
