"""How the server's certificate is checked, and which one is shown to it."""

import ssl

from .._files import File, check_regular, path_of_secret, shown_path
from ..errors import ArgumentError


def tls_context(ca: File | None, client_cert: File | None, client_key: File | None) -> ssl.SSLContext:
    """The settings of TLS: authorities that the system trusts, or those of the file `ca` alone (PEM)."""
    if client_key is not None and client_cert is None:
        raise ArgumentError("client_key", shown_path(client_key), "given with client_cert")
    context = _with_authorities(ca)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    if client_cert is None:
        return context
    expected = "a certificate (PEM) whose key is in it or in client_key"
    cert = path_of_secret(client_cert, "client_cert", expected)
    key = None if client_key is None else path_of_secret(client_key, "client_key", "the key of client_cert (PEM)")
    try:
        for path in (cert, key):
            if path is not None:
                check_regular(path)
        context.load_cert_chain(cert, key)
    except (OSError, ssl.SSLError) as error:
        wrong = error.strerror or str(error)
    else:
        return context
    # Here no exception has a path in it any more: one may be the key itself, in the place of its file's name.
    raise ArgumentError("client_cert", f"{shown_path(cert)}: {wrong}", expected)


def _with_authorities(ca: File | None) -> ssl.SSLContext:
    expected = "a file of certificates (PEM)"
    path = None if ca is None else path_of_secret(ca, "ca", expected)
    try:
        if path is not None:
            check_regular(path)
        return ssl.create_default_context(cafile=path)
    except (OSError, ssl.SSLError) as error:
        assert ca is not None
        wrong = error.strerror or str(error)
    raise ArgumentError("ca", f"{shown_path(ca)}: {wrong}", expected)
