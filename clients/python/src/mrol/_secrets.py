"""The secrets of this process, which no message shows.

A peer can say again what it was sent, in any part of its answer, and of that any part may come into an error. So errors leave the
secrets out of what they say, wherever they have it from.
"""

SHORTEST = 8
"""Characters of a secret that is looked for. A shorter one is a word, and would be found in the words of any message."""

KEPT_MAX = 256
"""Secrets that are known at once: keys are rotated, and a program may have many clients."""

INSTEAD = "[the key]"

_known: dict[str, None] = {}


def remember(secret: str) -> None:
    """Keeps a secret out of all messages from here on."""
    if len(secret) < SHORTEST or secret in _known:
        return
    _known[secret] = None
    for oldest in list(_known)[:-KEPT_MAX]:
        _known.pop(oldest, None)


def masked(text: str) -> str:
    """A text without the secrets."""
    for secret in list(_known):
        text = text.replace(secret, INSTEAD)
    return text


def masked_bytes(data: bytes | bytearray) -> bytes | bytearray:
    """Bytes without the secrets."""
    for secret in list(_known):
        data = data.replace(secret.encode(), INSTEAD.encode())
    return data
