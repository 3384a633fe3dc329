"""Answers that name another server, which has what this one has not (HTTP 307).

The same request goes there, with the key: so it goes to a server alone whose address the caller has given. An answer can be forged
where there is no TLS, and a server may be made to name any place; a stranger would get the key and the scans, and could answer
anything. Of the address that is named nothing but scheme, host and port counts: what is asked there is what was asked here.
"""

import json
from urllib.parse import urlsplit

from ..errors import BadAnswer, excerpt
from .address import Address
from .pool import Pool
from .request import Answer
from .servers import Servers

STATUS = 307
HOPS_MAX = 3
"""How often one call is sent on."""

PORTS = {"http": 80, "https": 443}


def target(answer: Answer, servers: Servers, hops: int) -> Pool:
    """The server that an answer names, after so many that did: the first of those that it names which is known.

    Raises `BadAnswer` where it is none of `servers`, or there were too many.
    """
    location = answer.header("location") or ""
    addresses = (_address(named) for named in [location, *_others(answer)])
    known = (servers.of(address) for address in addresses if address is not None)
    found = next((pool for pool in known if pool is not None), None)
    if found is None:
        wrong = f"{excerpt(location)}, which is none of this client's addresses: nothing was sent there"
        raise BadAnswer(f"the server sends the request on to {wrong}")
    if hops >= HOPS_MAX:
        raise BadAnswer(f"the request was sent on more than {HOPS_MAX} times, last to {found.address.shown}")
    return found


def _others(answer: Answer) -> list[str]:
    """The other servers that an answer names: those of its `elsewhere`."""
    try:
        named = json.loads(bytes(answer.body))["elsewhere"]
        return [holder["http"] for holder in named if isinstance(holder["http"], str)]
    except (ValueError, LookupError, TypeError, RecursionError):
        return []


def _address(location: str) -> "Address | None":
    """Scheme, host and port of an address; None for what has none, or a user beside them."""
    if not location.isprintable() or " " in location or "\\" in location:
        return None
    try:
        parts = urlsplit(location)
        port, host = parts.port, parts.hostname
    except ValueError:
        return None
    if parts.scheme not in PORTS or not host or "@" in parts.netloc:
        return None
    return Address(host, PORTS[parts.scheme] if port is None else port, parts.scheme == "https")
