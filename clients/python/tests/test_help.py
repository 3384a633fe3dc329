"""What `help` shows of the package's methods can be read."""

import inspect
import re
from collections.abc import Callable
from typing import Any

import pytest

import mrol

SIGNATURE_MAX = 800
"""Characters of the longest signature, that of a scan's insertion with its 23 arguments."""

FUNCTIONS = [mrol.connect, mrol.read_scan, mrol.scan_files, mrol.Pose.of, mrol.Pose.apply]
METHODS = [
    method
    for of in (mrol.Map, mrol.Client)
    for name, method in inspect.getmembers(of, inspect.isfunction)
    if not name.startswith("_")
]
ALL = pytest.mark.parametrize("method", [*FUNCTIONS, *METHODS], ids=lambda method: str(method.__qualname__))


@ALL
def test_a_signature_names_types_and_does_not_expand_them(method: Callable[..., Any]) -> None:
    signature = str(inspect.signature(method))
    assert "numpy._typing" not in signature
    assert len(signature) < SIGNATURE_MAX


@ALL
def test_each_argument_is_explained(method: Callable[..., Any]) -> None:
    shown = " ".join(re.findall(r"`([^`]+)`", inspect.getdoc(method) or ""))
    arguments = [name for name in inspect.signature(method).parameters if name not in ("self", "argument")]
    assert [name for name in arguments if not re.search(rf"\b{name}\b", shown)] == []
