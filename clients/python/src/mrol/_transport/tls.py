"""How the server's certificate is checked, and which one is shown to it."""

import ssl
from os import PathLike, fspath

from ..errors import ArgumentError, excerpt

Path = str | PathLike[str]


def tls_context(ca: Path | None, client_cert: Path | None, client_key: Path | None) -> ssl.SSLContext:
    """The settings of TLS: authorities that the system trusts, or those of the file `ca` alone (PEM)."""
    if client_key is not None and client_cert is None:
        raise ArgumentError("client_key", excerpt(fspath(client_key)), "given with client_cert")
    context = _with_authorities(ca)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    if client_cert is not None:
        try:
            context.load_cert_chain(client_cert, client_key)
        except (OSError, ssl.SSLError) as error:
            given = f"{excerpt(fspath(client_cert))}: {error}"
            raise ArgumentError("client_cert", given, "a certificate (PEM) whose key is in it or in client_key") from error
    return context


def _with_authorities(ca: Path | None) -> ssl.SSLContext:
    try:
        return ssl.create_default_context(cafile=ca)
    except (OSError, ssl.SSLError) as error:
        assert ca is not None
        raise ArgumentError("ca", f"{excerpt(fspath(ca))}: {error}", "a file of certificates (PEM)") from error
