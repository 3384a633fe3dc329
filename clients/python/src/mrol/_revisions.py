"""The last revisions that the servers told, map by map."""

from collections.abc import Mapping
from typing import Any

from .version import Version


class Revisions:
    """The highest revision of each map that answers have named.

    Servers of the same maps need not be equally far: a question that passes on what is known here is answered at that revision or a
    later one, whichever of them is asked.

    No lock is needed: each change is one of a container's own, and of a map all revisions are kept until they are known not to be
    the highest.
    """

    def __init__(self) -> None:
        self._uuids: dict[str, str] = {}
        # By uuid.
        self._told: dict[str, set[int]] = {}

    def note(self, name: str, version: Version) -> None:
        """Notes what an answer about the map `name` told. A map with another uuid starts anew."""
        told = self._told.setdefault(version.map_uuid, set())
        told.add(version.revision)
        known = told.copy()
        for lower in known - {max(known)}:
            told.discard(lower)
        former = self._uuids.get(name)
        self._uuids[name] = version.map_uuid
        if former not in (None, version.map_uuid):
            self._told.pop(former, None)

    def forget(self, name: str, map_uuid: str) -> None:
        """Forgets a map whose name another one has now."""
        if self._uuids.get(name) == map_uuid:
            self._uuids.pop(name, None)
        self._told.pop(map_uuid, None)

    def raised(self, name: str, scope: Mapping[str, Any]) -> Mapping[str, Any]:
        """The options of a question that waits for the highest revision of the map `name`.

        A larger `min_revision` of the caller stays, and so does a question about a map of another uuid.
        """
        uuid = self._uuids.get(name)
        known = self._told.get(uuid, set()).copy() if uuid is not None else None
        if not known or scope.get("map_uuid", uuid) != uuid:
            return scope
        own = scope.get("min_revision")
        return {**scope, "min_revision": max(known) if own is None else max(own, *known), "map_uuid": uuid}
