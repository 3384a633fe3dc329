"""Which protocol the other end speaks where it is not that of the address: its first bytes tell."""

from dataclasses import replace

from ..errors import WrongPort
from .address import PORT, Address

OPENING_BYTES = 9
"""Bytes that tell: the header of a frame of HTTP/2."""

_SETTINGS = b"\x04\x00\x00\x00\x00\x00"
"""What is behind the length of the first frame of HTTP/2: its kind, no flags, and the stream 0."""

_TLS = (b"\x15\x03", b"\x16\x03")
"""The first bytes of an alert and of a handshake."""


def right_address(address: Address) -> str:
    """What to do about an address of something else."""
    right = "give the HTTP address that `mrol serve` prints"
    usual = replace(address, port=PORT)
    return right if address.socket_path is not None or usual == address else f"{right}: {usual} unless it is set to another"


def wrong_port(opening: bytes, address: Address) -> WrongPort | None:
    """The error that the first bytes of a connection are, where no HTTP/1.1 begins so."""
    if opening[3:] == _SETTINGS:
        return WrongPort(f"{address.shown} speaks gRPC, and this package HTTP: {right_address(address)}")
    if opening.startswith(_TLS) and not address.is_tls:
        return WrongPort(f"{address.shown} speaks TLS: give https://{address.authority}, and as `ca` who signed its certificate")
    return None
