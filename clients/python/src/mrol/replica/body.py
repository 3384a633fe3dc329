"""Bodies that are asked about often."""

from __future__ import annotations

from ..body import Body, BodyLike
from .native import mrol_native

BYTES_MAX = 1 << 34
"""Bytes of an array; what fits into the memory of this process is for it to know."""


class PreparedBody(Body, mrol_native.NativeBody):
    """A body that is made once and asked about often: a question about it copies nothing of it.

    It takes what `mrol.Body.of` takes. All questions take it in the place of a body; `motion_is_free` takes nothing else.
    """

    def __new__(cls, body: BodyLike) -> PreparedBody:
        return super().__new__(cls, **Body.of(body).fields(BYTES_MAX))

    def __init__(self, body: BodyLike) -> None:
        super().__init__(Body.of(body).links)
