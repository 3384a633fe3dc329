"""One connection to a server."""

import select
import socket
import ssl
from contextlib import suppress
from http.client import HTTPConnection, HTTPException, IncompleteRead
from typing import Any, cast

import numpy as np

from ..errors import BadAnswer, ConnectFailed, ConnectionLost, MrolError, TimedOut, WrongPort, excerpt
from .address import Address
from .deadline import Deadline
from .key import Secret
from .protocol import wrong_port
from .request import Answer, Request
from .response import Response
from .stream import BoundedStream

HEADER_BYTES = 128 << 10
"""Bytes that an answer may have besides its body: `http.client` takes 100 headers of 64 KiB, far more than there ever are."""

PIECE_BYTES = 256 << 10
"""Bytes of a body of unknown length that are read at once."""

NO_TLS = ("WRONG_VERSION_NUMBER", "HTTP_REQUEST", "RECORD_LAYER_FAILURE")
"""What OpenSSL calls an answer that is none of TLS."""


class Connection:
    """A connection, for one request at a time."""

    def __init__(self, address: Address, tls: ssl.SSLContext | None, deadline: Deadline) -> None:
        self._socket = _connected(address, tls, deadline)
        self._stream = BoundedStream(self._socket)
        self._address = address
        self._client = HTTPConnection(address.host)
        # It never connects by itself: what it opened would have no bounds.
        self._client.auto_open = 0
        self._client.response_class = Response
        self._client.sock = cast(Any, self._stream)
        self._is_broken = False
        # The server has closed its side: it answers once more, at most.
        self._is_lost = False

    def close(self) -> None:
        """Closes the connection; what is read from it fails."""
        self._is_broken = True
        with suppress(OSError):
            self._socket.close()

    def __del__(self) -> None:
        # A client that is not closed by hand ends with the last map that uses it, without a word of an unclosed socket.
        if hasattr(self, "_socket"):
            self.close()

    @property
    def wrong_port(self) -> WrongPort | None:
        """What is wrong with the address, where another protocol is spoken there."""
        return wrong_port(self._stream.opening, self._address)

    @property
    def has_ended(self) -> bool:
        """Whether the server has closed its side."""
        return self._stream.has_ended

    @property
    def is_reusable(self) -> bool:
        """Whether another request can be sent: all was read, and the server has neither closed it nor said what nobody asked."""
        if self._is_broken or self._client.sock is None:
            return False
        try:
            is_readable, _, _ = select.select([self._socket], [], [], 0)
        except (OSError, ValueError):
            # A descriptor beyond what select takes: it is tried by use.
            return self._socket.fileno() >= 0
        return not is_readable

    def ask(self, request: Request, secret: Secret, deadline: Deadline, answer_bytes_max: int) -> Answer:
        """Sends a request and reads its whole answer.

        Raises `ConnectionLost`, `TimedOut` or `BadAnswer`; the connection is of no use then.
        """
        response = self.open(request, secret, deadline, answer_bytes_max + HEADER_BYTES)
        with _Failures(self):
            body = _whole_body(response, answer_bytes_max)
            response.close()
            self._is_broken = response.will_close or self._is_lost
            return Answer(response.status, response.plain_headers, body)

    def open(self, request: Request, secret: Secret, deadline: Deadline, bytes_max: int | None) -> Response:
        """Sends a request, and reads its answer up to the body."""
        # Until an answer was read to its end, wherever Ctrl-C may come.
        self._is_broken = True
        with _Failures(self):
            deadline.guard(self._socket)
            self._stream.begin(deadline, bytes_max)
            try:
                self._send(request, secret)
            except (BrokenPipeError, ConnectionResetError) as lost:
                # A server that refuses a body by its length answers before it has read it.
                return self._answer_in_spite_of(lost)
            response = self._response()
            if self._stream.has_ended:
                # To http.client the end of a connection is the end of the headers, too.
                raise IncompleteRead(b"")
            return response

    def read(self, response: Response, count: int, deadline: Deadline) -> bytes:
        """Reads up to so many bytes of a body that is read piece by piece; less than that at its end."""
        with _Failures(self):
            self._stream.renew(deadline)
            return response.read(count)

    def read_some(self, response: Response, most: int, deadline: Deadline) -> bytes:
        """What has come of such a body, once something has, so many bytes at most; nothing at its end."""
        with _Failures(self):
            self._stream.renew(deadline)
            return response.read1(most)

    def _send(self, request: Request, secret: Secret) -> None:
        client = self._client
        client.putrequest(request.method, request.target, skip_host=True, skip_accept_encoding=True)
        client.putheader("host", self._address.authority)
        if (shown := secret.header()) is not None:
            client.putheader("authorization", shown)
        # A traceback may be shown with what its frames hold.
        del shown
        if request.accept is not None:
            client.putheader("accept", request.accept)
        if request.content_type is not None:
            client.putheader("content-type", request.content_type)
            client.putheader("content-length", str(request.body_bytes))
        client.endheaders()
        sent = 0
        for piece in request.body:
            client.send(piece)
            sent += memoryview(piece).nbytes
            if request.on_sent is not None:
                request.on_sent(sent)
        self._stream.flush()

    def _response(self) -> Response:
        response = self._client.getresponse()
        assert isinstance(response, Response)
        return response

    def _answer_in_spite_of(self, lost: OSError) -> Response:
        self._is_lost = True
        try:
            return self._response()
        except (OSError, HTTPException):
            raise lost from None


class _Failures:
    """Tells what goes wrong on a connection in this package's words, and marks the connection as one that cannot be used again."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        if error is None:
            return
        # Ctrl-C too leaves a connection in the middle of an answer.
        self._connection.close()
        if not isinstance(error, Exception):
            return
        if (wrong := self._connection.wrong_port) is not None:
            raise wrong from None
        if isinstance(error, MrolError):
            return
        if isinstance(error, TimeoutError):
            raise TimedOut(str(error)) from error
        # `RemoteDisconnected` is a ConnectionResetError. A status that was cut off looks like a wrong one.
        if self._connection.has_ended or isinstance(error, IncompleteRead | OSError):
            raise ConnectionLost(f"the connection broke before the answer was whole: {error}") from error
        if isinstance(error, HTTPException | ValueError | OverflowError | MemoryError | AttributeError):
            raise BadAnswer(f"this is no answer of an mrol server: {excerpt(error)}") from error


def _whole_body(response: Response, most: int) -> memoryview:
    """The body, of a length that the answer tells, or in chunks.

    One that ends where the connection does could have been cut off anywhere.
    """
    length = response.length
    if length is not None:
        if length > most:
            raise BadAnswer(f"the answer has {length} bytes, more than answer_bytes_max, {most}")
        return _body_of(response, length)
    if not response.chunked:
        raise BadAnswer("the answer does not tell how long it is")
    body = bytearray()
    while piece := response.read(PIECE_BYTES):
        body += piece
        if len(body) > most:
            raise BadAnswer(f"the answer has more bytes than answer_bytes_max, {most}")
    return memoryview(body)


def _body_of(response: Response, length: int) -> memoryview:
    # Memory that is not written to is none: a length that a server claims costs nothing until it is sent.
    body = np.empty(length, np.uint8).data
    filled = 0
    while filled < length:
        count = response.readinto(body[filled:])
        if count == 0:
            raise IncompleteRead(b"", length - filled)
        filled += count
    return body


def _connected(address: Address, tls: ssl.SSLContext | None, deadline: Deadline) -> socket.socket:
    timeout_s = deadline.remaining_s()
    try:
        if address.socket_path is not None:
            return _unix(address.socket_path, deadline)
        sock = _tcp(address.host, address.port, deadline)
    except TimeoutError as error:
        raise ConnectFailed(f"cannot connect to {address.shown}: no answer within {timeout_s:.3g} s") from error
    except (OSError, ValueError) as error:
        raise ConnectFailed(f"cannot connect to {address.shown}: {error}") from error
    try:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if tls is not None:
            sock = tls.wrap_socket(sock, server_hostname=address.host, do_handshake_on_connect=False)
            deadline.guard(sock)
            sock.do_handshake()
    except (OSError, ValueError) as error:
        sock.close()
        # Its first bytes are no TLS.
        is_other = isinstance(error, ssl.SSLError) and error.reason in NO_TLS
        hint = f"; it seems to speak no TLS: is it http://{address.authority}?" if is_other else ""
        raise ConnectFailed(f"cannot connect to {address.shown} over TLS: {error}{hint}") from error
    except BaseException:
        sock.close()
        raise
    return sock


def _tcp(host: str, port: int, deadline: Deadline) -> socket.socket:
    """A connection to the first address of a host that takes one, within one deadline for all of them.

    Each has its share of the time that is left, since one that answers nothing would leave none for those behind it.
    """
    places = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    failed: OSError | None = None
    for number, (family, kind, protocol, _, place) in enumerate(places):
        try:
            sock = socket.socket(family, kind, protocol)
        except OSError as error:
            # A family of addresses that the system has not.
            failed = error
            continue
        try:
            deadline.guard(sock)
            sock.settimeout(deadline.remaining_s() / (len(places) - number))
            sock.connect(place)
        except OSError as error:
            sock.close()
            failed = error
        except BaseException:
            sock.close()
            raise
        else:
            return sock
    raise failed or OSError(f"{host} has no address")


def _unix(path: str, deadline: Deadline) -> socket.socket:
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        deadline.guard(sock)
        sock.connect(path)
    except BaseException:
        sock.close()
        raise
    return sock
