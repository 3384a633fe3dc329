"""A server, and how to reach it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal

from numpy.typing import ArrayLike

from ._arguments import flag_of, word_of
from ._arrays import number_of, seconds_of, vector_of, whole_of
from ._fields import Fields, fields_of, reading
from ._files import File
from ._revisions import Revisions
from ._sessions import Sessions
from ._transport.address import Address
from ._transport.caller import Bounds, Caller
from ._transport.deadline import seconds
from ._transport.key import Key
from ._transport.pool import Pool
from ._transport.protocol import right_address
from ._transport.request import JSON, Request, path_of, target_of
from ._transport.servers import Servers
from ._transport.stop import OpenStreams
from ._transport.tls import tls_context
from .errors import (
    ArgumentError,
    BadAnswer,
    ConnectFailed,
    ConnectionLost,
    MrolError,
    PermissionDenied,
    ServerError,
    WrongPort,
    excerpt,
)
from .map import Map
from .operations.description import FilterSettings, MapInfo, map_info
from .operations.map_file import FILE_TIMEOUT_S, restore
from .progress import Progress

TIMEOUT_S = 30.0
PATIENCE_S = 15.0
REQUEST_BYTES_MAX = 1 << 30
ANSWER_BYTES_MAX = 1 << 30
ROBOT = "python"

LIVE = b"ok"
"""What a server says of itself at `/livez`."""

FIRST_PAUSE_S = 0.1
TRY_MIN_S = 1.0
"""How long one try of several may take at least: less than that a server that is there may need as well."""


@dataclass(frozen=True)
class Maps:
    """The maps of a server."""

    maps: tuple[MapInfo, ...]
    unavailable: dict[str, str]
    """Maps that could not be opened, and why."""


@dataclass(frozen=True)
class Health:
    """Whether a server takes requests."""

    ready: bool
    reason: str | None
    """Why it does not: `starting` or `draining`."""
    details: dict[str, Any]
    """All that `/readyz` says."""


class Client:
    """A server, or several that serve the same maps: `mrol.connect` makes one.

    Threads may share it, and so may processes that fork.

    Used as a context manager, or closed by `close`, it ends its watches and closes the connections that it keeps; it opens others
    if it is used again.
    """

    def __init__(self, caller: Caller) -> None:
        self._caller = caller
        self._sessions = Sessions()
        self._revisions = Revisions()

    @property
    def address(self) -> str:
        """The server's address; of several, that of the one in use."""
        return self._caller.address

    @property
    def session(self) -> str:
        """The name under which this process counts its scans."""
        return self._sessions.current().name

    def map(
        self,
        name: str,
        resolution: float | None = None,
        *,
        levels: int | None = None,
        filter: FilterSettings | Literal["none"] | None = None,
        moments: bool | None = None,
        origin: ArrayLike | None = None,
        robot: str = ROBOT,
    ) -> Map:
        """The map `name`, which is made where it is not there if a `resolution` is given.

        `resolution` is the side of a voxel, meters. Without it the map has to be there.

        `levels` (6) halve the resolution each; `filter="none"` and `moments=False` are for maps that are only queried. `robot`
        is the name in which scans are sent: give each robot one of its own. `origin` x y z, meters, says where the map's origin
        lies in the coordinates of a survey: subtract it, in float64, from points before they are sent. It is kept with the map.

        A key that may not make maps gets one that is there with these settings.

        Raises `NotFound` (`map_not_found`), `Conflict` (`map_exists`: it is there with other settings), `InvalidArgument`
        (`bad_settings`, `bad_name`), `PermissionDenied` (`scope_too_small`: it is not there, and the key may not make it).
        """
        found = Map(self._caller, name, robot, self._sessions, self._revisions)
        if resolution is None:
            if any(of is not None for of in (levels, filter, moments, origin)):
                raise ArgumentError("resolution", "None with other settings", "given where a map is to be made")
            found.describe()
            return found
        settings = {
            "resolution_m": number_of(resolution, "resolution"),
            "levels": None if levels is None else whole_of(levels, "levels", 0, (1 << 32) - 1),
            "filter": _filter_json(filter),
            "moments": None if moments is None else flag_of(moments, "moments"),
            "origin_m": None if origin is None else vector_of(origin, 3, "origin", is_finite=True),
        }
        given = json.dumps({key: value for key, value in settings.items() if value is not None}).encode()
        try:
            self._caller.call(Request("PUT", path_of("v1", "maps", found.name), JSON, [given]))
        except PermissionDenied as denied:
            # These two are not compared.
            is_comparable = filter is None and origin is None
            if not (denied.reason == "scope_too_small" and is_comparable and _is_there(found, settings)):
                raise
        return found

    def maps(self) -> Maps:
        """All maps that the key may name."""
        fields = fields_of(self._caller.call(Request("GET", "/v1/maps")).body)
        unavailable = fields.objects("unavailable") if fields.has("unavailable") else []
        return Maps(
            tuple(map_info(of) for of in fields.objects("maps")),
            {of.text("map"): of.text("reason") for of in unavailable},
        )

    def rename_map(self, name: str, to: str, *, robot: str = ROBOT) -> Map:
        """Gives the map `name` another name, `to`, which no map has, and returns it; its uuid, its revision and its robots stay.

        `robot` is the name in which scans are sent, as of `map`. Watches and changes that are under way under the former name end
        with `NotFound` (`map_not_found`). It is not sent again where the connection breaks, since somebody may have made a map of
        the former name meanwhile.

        Raises `NotFound` (`map_not_found`), `Conflict` (`map_exists`: a map has that name), `InvalidArgument` (`bad_name`).
        """
        renamed = Map(self._caller, word_of(to, "to"), robot, self._sessions, self._revisions)
        target = path_of("v1", "maps", word_of(name, "name"), "rename")
        self._caller.call(Request("POST", target, JSON, [json.dumps({"to": to}).encode()], is_repeatable=False))
        return renamed

    def delete_map(self, name: str) -> None:
        """Deletes the map `name`: memory and files are gone.

        It is not sent again where the connection breaks, since somebody may have made a map of that name meanwhile.

        Raises `NotFound` (`map_not_found`).
        """
        target = path_of("v1", "maps", word_of(name, "name"))
        self._caller.call(Request("DELETE", target, is_repeatable=False))

    def restore(
        self,
        name: str,
        source: File | bytes,
        *,
        replace: bool = False,
        robot: str = ROBOT,
        progress: Progress = None,
        timeout_s: float = FILE_TIMEOUT_S,
    ) -> Map:
        """Makes a map `name` of a map file: `source` is its path, or the bytes of one.

        A map of that name is kept as NAME-replaced-REVISION with `replace`; without, there must be none. `robot` is the name in
        which scans are sent, as of `map`. `progress` and `timeout_s` are as of `Map.restore`, and so are the errors.
        """
        made = Map(self._caller, name, robot, self._sessions, self._revisions)
        target = target_of(path_of("v1", "maps", name, "snapshot"), {"replace": flag_of(replace, "replace")})
        restore(self._caller, target, source, progress, timeout_s)
        return made

    def health(self) -> Health:
        """Whether the server takes requests. It takes no key."""
        try:
            body = self._caller.call(Request("GET", "/readyz")).body
        except ServerError as error:
            if error.status != 503:
                raise
            return Health(False, error.reason, {"detail": error.message})
        with reading("the answer's JSON"):
            details = json.loads(bytes(body))
        return Health(Fields(details).flag("ready"), None, details)

    def metrics(self) -> str:
        """The server's metrics, in Prometheus' text form."""
        return str(self._caller.call(Request("GET", "/metrics")).body, "utf-8", "replace")

    def with_timeout(self, timeout_s: float) -> Client:
        """The same server, of which each call may take `timeout_s`, tries and waits included.

        Its watches end with this client, and those of this client do not end with it.
        """
        client = Client(self._caller.with_timeout(timeout_s, OpenStreams(self._caller.streams)))
        client._sessions = self._sessions
        client._revisions = self._revisions
        return client

    def close(self) -> None:
        """Ends the watches, without an error in the threads that iterate them, and closes the connections that are kept."""
        self._caller.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def __reduce__(self) -> tuple[object, ...]:
        raise ArgumentError("the client", excerpt(self), "connected anew in each process: a key is not to be written down with it")

    def __repr__(self) -> str:
        return f"<mrol server {self.address}>"


def connect(
    address: str | Sequence[str] = "localhost:7333",
    *,
    key: str | None = None,
    key_file: File | None = None,
    ca: File | None = None,
    client_cert: File | None = None,
    client_key: File | None = None,
    timeout_s: float = TIMEOUT_S,
    patience_s: float = PATIENCE_S,
    wait_s: float = 0.0,
    request_bytes_max: int = REQUEST_BYTES_MAX,
    answer_bytes_max: int = ANSWER_BYTES_MAX,
) -> Client:
    """Connects to a server's HTTP: `address` is `host:port`, `https://host:port`, or `unix:/path` of a socket.

    A list of addresses, or a text in which commas separate them, is that of servers of the same maps. The first that answers is
    used until it is gone, then the next. A question is asked again there, and a change is sent again; `delete_map`, `rename_map`
    and `restore`, which have no ids, only if they were not sent before. A server may send a request on to another (HTTP 307): it
    is followed to these addresses alone, so that the key goes nowhere else. Questions wait for the last revision that any of the
    servers told (`min_revision`), so that the map never goes back; listings, blocks, trajectories and descriptions do not.

    `key` is a secret, `key_file` a file with one, which is read again when the server refuses it: so a key may be rotated under a
    running program. Without either the variables MROL_KEY and MROL_KEY_FILE count, if they are set. `ca` (or MROL_CA) is a file of
    the authorities that may sign the server's certificate (PEM), those of the system without it; with `ca`, an address without a
    scheme is https. `client_cert` and `client_key` are shown to a server that asks for them.

    Each call takes `timeout_s` at most, tries, waits and all addresses of the host's name included. It is tried again for
    `patience_s` where the server cannot be reached, starts, drains or is overloaded, and where a connection broke; all changes
    have ids by which the server knows what it has done already. Here alone nothing is tried again unless `wait_s` says how long
    to wait for the server to be there; the last try may take a second more. Requests and answers of more than `request_bytes_max`
    and `answer_bytes_max` bytes are refused.

    Files of keys and certificates are regular ones: pipes and devices are refused.

    Raises `ConnectFailed`, `BadAnswer` where no mrol server is there (`WrongPort` where it is gRPC that is spoken, or TLS without
    https), and `ArgumentError` for what is no address, key or certificate. No error shows a key of 8 characters or
    more, also where a peer says it again; nor an address that is refused, nor a path that names nothing, since those may be a key
    in the wrong argument.
    """
    if key is None and key_file is None:
        key, key_file = _from_environment()
    own_ca = ca
    ca = os.environ.get("MROL_CA") or None if ca is None else ca
    places = Address.parse_all(address, prefer_tls=ca is not None or client_cert is not None)
    bounds = Bounds(
        timeout_s=seconds(timeout_s, "timeout_s"),
        patience_s=seconds_of(patience_s, "patience_s"),
        request_bytes_max=whole_of(request_bytes_max, "request_bytes_max"),
        answer_bytes_max=whole_of(answer_bytes_max, "answer_bytes_max"),
    )
    in_clear = next((place for place in places if not place.is_tls), None)
    if in_clear is not None:
        for name, file in (("ca", own_ca), ("client_cert", client_cert), ("client_key", client_key)):
            if file is not None:
                # A key would travel in the clear although its owner thinks that it does not.
                raise ArgumentError(name, f"a file for {in_clear.shown}", "given with an https:// address alone")
    tls = tls_context(ca, client_cert, client_key) if any(place.is_tls for place in places) else None
    servers, secret = Servers([Pool(place, tls if place.is_tls else None) for place in places]), Key(key, key_file)
    impatient = Caller(servers, secret, Bounds(bounds.timeout_s, 0.0, bounds.request_bytes_max, bounds.answer_bytes_max))
    _wait_for(impatient, seconds_of(wait_s, "wait_s"))
    return Client(Caller(servers, secret, bounds))


def _from_environment() -> tuple[str | None, str | None]:
    key = os.environ.get("MROL_KEY") or None
    # As for the commands: the secret itself is nearer than the file.
    return key, (os.environ.get("MROL_KEY_FILE") or None) if key is None else None


def _wait_for(caller: Caller, wait_s: float) -> None:
    end = time.monotonic() + wait_s
    while True:
        left_s = end - time.monotonic()
        of_try = caller if wait_s == 0 else caller.with_timeout(min(caller.bounds.timeout_s, max(left_s, TRY_MIN_S)))
        try:
            _greet(of_try)
        except WrongPort:
            # It will not become another.
            raise
        except MrolError as error:
            if time.monotonic() + FIRST_PAUSE_S > end:
                if isinstance(error, ConnectFailed) and "?" not in str(error):
                    raise ConnectFailed(f"{error}; is `mrol serve` running there?") from error
                if isinstance(error, ConnectionLost):
                    may_be = f"{caller.place.shown} may be no mrol server; {right_address(caller.place)}"
                    raise ConnectionLost(f"{error}: {may_be}") from error
                raise
        else:
            return
        time.sleep(FIRST_PAUSE_S)


def _greet(caller: Caller) -> None:
    """Makes sure that an mrol server is there: it says "ok"."""
    try:
        said = bytes(caller.call(Request("GET", "/livez")).body)
        if said.strip() == LIVE:
            return
        wrong = f"it says {excerpt(said)} where that one says {excerpt(LIVE)}"
    except WrongPort:
        raise
    except BadAnswer as error:
        wrong = str(error)
    raise BadAnswer(f"{caller.place.shown} is no mrol server: {wrong}; {right_address(caller.place)}")


def _is_there(found: Map, settings: dict[str, Any]) -> bool:
    """Whether a map is there with the given resolution, levels and moments; settings that are None are not compared."""
    try:
        info = found.describe()
    except ServerError:
        return False
    there = {"resolution_m": info.resolution_m, "levels": len(info.levels), "moments": info.moments}
    return all(settings[key] in (None, value) for key, value in there.items())


def _filter_json(filter: FilterSettings | str | None) -> dict[str, Any] | str | None:
    if isinstance(filter, FilterSettings):
        return {
            "hashes": whole_of(filter.hashes, "filter.hashes"),
            "bits_per_key": number_of(filter.bits_per_key, "filter.bits_per_key"),
        }
    return None if filter is None else word_of(filter, "filter")
